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
from smid.sensors.program import Block, Code
from smid.sensors.ranges import Range

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
    each = int(count ** (1.0 / max(1, sum(open_ends))) + 1e-9)
    edges = [np.linspace(s.lower, s.upper, each + 1 if wide else 2) for s, wide in zip(box, open_ends, strict=True)]
    lower, upper = (np.meshgrid(*(e[part] for e in edges), indexing="ij") for part in (slice(-1), slice(1, None)))
    return Range(np.stack([x.ravel() for x in lower]), np.stack([x.ravel() for x in upper]))


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


def _affine(matrix: Array, bias: Array, signal: Balls) -> Balls:
    """Return ``matrix signal + bias``, shape (m, cells), from signals of shape (k, cells)."""
    absolute, terms = np.abs(matrix), matrix.shape[1] + 2
    # A sum of k products and the bias in any order, see `relaxations.algebra.ball_arithmetic`.
    size = absolute @ np.abs(signal.mid) + np.abs(bias)[:, None]
    rad = absolute @ signal.rad + terms * EPSILON * size + terms * TINY
    return Balls(matrix @ signal.mid + bias[:, None], rad * (1.0 + (terms + 8) * EPSILON))


def _numbers(values: Array) -> str:
    return "{" + ", ".join(repr(x) for x in values.tolist()) + "}"
