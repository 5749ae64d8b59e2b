"""A tanh network as a block, with certified ranges.

Over a box of arguments the values lie in the natural range, layer by layer, and in that of the mean value form,

    f(c) + sum_k f_k'([x]) (x_k - c_k),    c the middle of the box

The box is split into cells; each cell takes what both ranges have in common.

Reference: Moore, Kearfott, Cloud, "Introduction to Interval Analysis" (2009), chapter 6.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.algebra.ball_arithmetic import EPSILON, TINY, Balls
from smid.networks import TanhNetwork
from smid.sensors.program import CELLS, Block, Code
from smid.sensors.ranges import Range
from smid.sensors.tensor import Tensor

__all__ = ["NetworkBlock", "cells_of"]


def cells_of(box: Sequence[Range], count: int) -> Range:
    """Return at most ``count`` cells, shape (k, cells), that cover a box of k ranges of shape ().

    Examples
    --------
    >>> cells_of([Range(np.array(0.0), np.array(1.0)), Range.exact(5.0)], 2).upper
    array([[0.5, 1. ],
           [5. , 5. ]])
    """
    open_ends = [bool(side.width > 0) for side in box]
    each = parts_of(count, sum(open_ends))
    edges = [np.linspace(s.lower, s.upper, each + 1 if wide else 2) for s, wide in zip(box, open_ends, strict=True)]
    lower, upper = (np.meshgrid(*(e[part] for e in edges), indexing="ij") for part in (slice(-1), slice(1, None)))
    return Range(np.stack([x.ravel() for x in lower]), np.stack([x.ravel() for x in upper]))


def parts_of(count: int, wide: int) -> int:
    """Return into how many parts each of some wide ranges is cut for at most ``count`` cells.

    Examples
    --------
    >>> [parts_of(16, wide) for wide in range(6)]
    [16, 16, 4, 2, 2, 1]
    """
    return int(count ** (1.0 / max(1, wide)) + 1e-9)


@dataclass(frozen=True, eq=False)
class NetworkBlock(Block):
    """A network of one or more signals."""

    network: TanhNetwork

    def rest(self, first: Sequence[Array]) -> Array:  # noqa: ARG002
        """Return no memory; see `Block.rest`."""
        return np.zeros(0)

    def advance(self, signals: Sequence[Array], memory: Array) -> tuple[Array, Array]:
        """Return the outputs of the network; see `Block.advance`."""
        return self.network(np.stack(signals, axis=1)), memory

    def enclose(self, signals: Sequence[Range], memory: Range, cells: int) -> tuple[Range, Range]:
        """Return the range over the box of signals; see `Block.enclose`."""
        box = cells_of(signals, cells)
        middle = 0.5 * box.lower + 0.5 * box.upper
        count = middle.shape[1]
        values, gradient = self._over(Range(np.hstack([box.lower, middle]), np.hstack([box.upper, middle])))
        reach = (box.balls - Balls.exact(middle)).magnitude()
        spread = (gradient.magnitude()[:, :count] * reach).sum(axis=0) * (1.0 + 1e-14)
        mean_value = Range.of(values[count:].balls + Balls(np.zeros_like(spread), spread))
        found = values[:count].meet(mean_value)
        return Range(found.lower.min(), found.upper.max()), memory

    def _over(self, box: Range) -> tuple[Range, Balls]:
        """Return the natural range of the values, shape (cells,), and that of the gradient, shape (k, cells)."""
        *hidden, (matrix, bias) = self.network.layers()
        signal, squares = box, []
        for weights, biases in hidden:
            signal = Range.of(_affine(weights, biases, signal.balls)).tanh()
            squares.append(signal.square().balls)
        value = Range.of(_affine(matrix, bias, signal.balls)[0])
        delta = Balls.exact(np.repeat(matrix.T, value.lower.size, axis=1))
        for (weights, _), square in zip(reversed(hidden), reversed(squares), strict=True):
            delta = delta * (Balls.exact(np.ones_like(square.mid)) - square)
            delta = _affine(weights.T, np.zeros(weights.shape[1]), delta)
        return value, delta

    def onnx(self, signals: Sequence[Tensor], memory: Tensor) -> tuple[Tensor, Tensor]:
        """Return the layers; see `Block.onnx`."""
        graph = memory.graph
        value = graph.join(*signals)
        *hidden, (matrix, bias) = self.network.layers()
        for weights, biases in hidden:
            value = (graph.add("MatMul", weights, value) + graph.tensor(biases)).tanh()
        return graph.add("MatMul", matrix, value) + graph.tensor(bias), memory

    def code(self, name: str, signals: Sequence[str]) -> Code:
        """Return the layers as loops over tables, with the terms of each sum in the order of `TanhNetwork`."""
        tables, lines, before = [], [f"{{ const double x0[] = {{{', '.join(signals)}}};"], len(signals)
        layers = self.network.layers()
        for number, (matrix, bias) in enumerate(layers, 1):
            rows = ",\n  ".join(_numbers(row) for row in matrix)
            tables.append(f"static const double {name}_w{number}[{bias.size}][{before}] = {{\n  {rows}}};")
            tables.append(f"static const double {name}_b{number}[{bias.size}] = {_numbers(bias)};")
            activation = "sum" if number == len(layers) else "tanh(sum)"
            lines.append(
                f"  double x{number}[{bias.size}];\n"
                f"  for (int i = 0; i < {bias.size}; i++) {{\n"
                f"    double sum = {name}_b{number}[i];\n"
                f"    for (int k = 0; k < {before}; k++) sum += {name}_w{number}[i][k] * x{number - 1}[k];\n"
                f"    x{number}[i] = {activation};\n"
                "  }"
            )
            before = bias.size
        lines.append(f"  {name} = x{len(layers)}[0]; }}")
        return Code(update="\n".join(lines), constants="\n".join(tables))

    def range_code(self, name: str, signals: Sequence[str]) -> Code:
        """Return the cells, each with both ranges; see `Block.range_code`."""
        table, layers = name.removeprefix("r"), self.network.layers()
        widths = [len(signals), *(bias.size for _, bias in layers)]
        forward, backward, last = list[str](), list[str](), len(layers)
        for k in range(1, last + 1):
            rows, columns = widths[k], widths[k - 1]
            weights = f"&{table}_w{k}[0][0]"
            forward.append(f"affine({rows}, {columns}, {weights}, {columns}, 1, {table}_b{k}, a, z);")
            if k < last:
                forward.append(
                    f"for (int i = 0; i < {rows}; i++) {{ t{k}[i] = tanh_range(bounds(z[i])); a[i] = balls(t{k}[i]); }}"
                )
                backward = [
                    f"for (int i = 0; i < {rows}; i++)",
                    f"  z[i] = times(gradient[i], minus(exact(1.0), balls(square_range(t{k}[i]))));",
                    f"affine({columns}, {rows}, {weights}, 1, {columns}, NULL, z, gradient);",
                    *backward,
                ]
        kept = [f"range t{k}[{widths[k]}];" for k in range(1, last)]
        lines = [
            f"ball a[{max(widths)}], z[{max(widths)}];",
            *kept,
            f"for (int k = 0; k < {widths[0]}; k++) a[k] = balls(x[k]);",
            *forward,
            "const range value = bounds(z[0]);",
            f"for (int i = 0; i < {widths[-2]}; i++) gradient[i] = exact({table}_w{last}[0][i]);",
            *backward,
            "return value;",
        ]
        function = f"static range {table}_cell(const range *x, ball *gradient) {{\n  " + "\n  ".join(lines) + "\n}"
        n = len(signals)
        parts = [parts_of(CELLS, wide) for wide in range(n + 1)]
        return Code(
            f"{{ const range box[] = {{{', '.join(signals)}}};\n"
            f"  static const int split[] = {{{', '.join(map(str, parts))}}};\n"
            f"  int wide = 0, count = 1, each;\n"
            f"  for (int k = 0; k < {n}; k++) wide += box[k].upper > box[k].lower;\n"
            "  each = split[wide];\n"
            "  while (wide--) count *= each;\n"
            f"  {name}.lower = HUGE_VAL; {name}.upper = -HUGE_VAL;\n"
            "  for (int number = 0; number < count; number++) {\n"
            f"    range x[{n}], middle[{n}];\n"
            f"    ball gradient[{max(widths)}], unused[{max(widths)}];\n"
            "    int rest = number;\n"
            "    double spread = 0.0;\n"
            f"    for (int k = 0; k < {n}; k++) {{\n"
            "      x[k] = box[k];\n"
            "      if (box[k].upper > box[k].lower) { x[k] = part(box[k], rest % each, each); rest /= each; }\n"
            "      middle[k].lower = middle[k].upper = 0.5 * x[k].lower + 0.5 * x[k].upper;\n"
            "    }\n"
            f"    range value = {table}_cell(x, gradient);\n"
            f"    ball centre = balls({table}_cell(middle, unused));\n"
            f"    for (int k = 0; k < {n}; k++)\n"
            "      spread += magnitude(gradient[k]) * magnitude(minus(balls(x[k]), exact(middle[k].lower)));\n"
            "    const ball reach = {0.0, spread * (1.0 + 1e-14)};\n"
            "    value = meet(value, bounds(plus(centre, reach)));\n"
            f"    {name}.lower = smaller({name}.lower, value.lower);\n"
            f"    {name}.upper = larger({name}.upper, value.upper);\n"
            "  } }",
            constants=function,
        )


def _affine(matrix: Array, bias: Array, signal: Balls) -> Balls:
    """Return ``matrix signal + bias``, shape (m, cells), from signals of shape (k, cells)."""
    absolute, terms = np.abs(matrix), matrix.shape[1] + 2
    # A sum of k products and the bias in any order, see `relaxations.algebra.ball_arithmetic`.
    size = absolute @ np.abs(signal.mid) + np.abs(bias)[:, None]
    rad = absolute @ signal.rad + terms * EPSILON * size + terms * TINY
    return Balls(matrix @ signal.mid + bias[:, None], rad * (1.0 + (terms + 8) * EPSILON))


def _numbers(values: Array) -> str:
    return "{" + ", ".join(repr(x) for x in values.tolist()) + "}"
