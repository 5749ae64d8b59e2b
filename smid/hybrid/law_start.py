"""Start of a sum of laws: its least-squares fit to the curve that a network has learned."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
import sympy

from relaxations.algebra.arrays import Array
from smid.hybrid.laws import Argument, Law
from smid.models import Model, Parameter
from smid.models.edit_lines import free_name

__all__ = ["Columns", "LawStart", "evaluated"]

_REACH = 10.0  # largest coefficient, by that of which the law alone is as large as the curve

Columns = dict[tuple[str, tuple[float, ...]], Array]
"""Parts of laws at the samples, by name and by the values of their shapes."""


@dataclass(frozen=True, eq=False)
class LawStart:
    """A sum of laws with parameters, at its least-squares fit to the learned curve."""

    laws: tuple[Law, ...]
    argument: Argument
    parameters: tuple[Parameter, ...]
    symbols: Mapping[str, sympy.Symbol]
    values: Mapping[str, float]
    misfit: float

    def expression(self, x: sympy.Expr) -> sympy.Expr:
        """Return the sum as a function of an argument."""
        at = replace(self.argument, x=x)
        parts = ((name, part) for law in self.laws for name, part in law.parts.items())
        return sympy.Add(*(self.symbols[name] * part(at, self.symbols) for name, part in parts))

    @staticmethod
    def of(
        laws: tuple[Law, ...],
        argument: Argument,
        samples: tuple[Array, Array],
        model: Model,
        prefix: str,
        known: Columns,
    ) -> LawStart:
        """Return the start of a sum.

        Parameters
        ----------
        samples
            Arguments and outputs of the network, shape (n,) each.
        prefix
            Of the parameters' names, which are free in the model.
        known
            Parts of laws at the samples, which are remembered here.
        """
        x, y = samples
        parts = {name: part for law in laws for name, part in law.parts.items()}
        shapes = {name: shape for law in laws for name, shape in law.shapes.items()}
        shaped = {name: tuple(law.shapes) for law in laws for name in law.parts}
        names = {name: free_name(model, f"{prefix}_{name}") for name in (*parts, *shapes)}
        symbols = {name: sympy.Symbol(own, real=True) for name, own in names.items()}
        reach, own = argument.reach, argument.symbol
        at = replace(argument, x=own)
        # Of the shapes a grid, of the coefficients the least squares.
        best: tuple[float, dict[str, float], Array, Array] | None = None
        for tried in product(*(shape.starts(reach).tolist() for shape in shapes.values())):
            chosen = dict(zip(shapes, tried, strict=True))
            numbers = {symbols[name]: value for name, value in chosen.items()}
            found = []
            for name, part in parts.items():
                place = name, tuple(chosen[shape] for shape in shaped[name])
                if place not in known:
                    known[place] = evaluated(part(at, symbols).xreplace(numbers), own, x)
                found.append(known[place])
            columns = np.stack(found, axis=1)
            sizes = np.maximum(np.abs(columns).max(axis=0), np.finfo(float).tiny)
            coefficients = np.linalg.lstsq(columns / sizes, y, rcond=1e-10)[0] / sizes
            misfit = float(np.mean((columns @ coefficients - y) ** 2))
            if best is None or misfit < best[0]:
                best = misfit, chosen, coefficients, sizes
        assert best is not None
        misfit, chosen, coefficients, sizes = best
        ends = _REACH * max(float(np.abs(y).max()), np.finfo(float).tiny) / sizes
        parameters = [Parameter(names[part], -end, end) for part, end in zip(parts, ends.tolist(), strict=True)] + [
            Parameter(names[name], *shape.box(reach)) for name, shape in shapes.items()
        ]
        inside = np.clip(coefficients, -ends, ends).tolist()
        values = {names[name]: value for name, value in (*zip(parts, inside, strict=True), *chosen.items())}
        return LawStart(laws, argument, tuple(parameters), symbols, values, misfit)


def evaluated(expression: sympy.Expr, symbol: sympy.Symbol, x: Array) -> Array:
    """Return an expression in one symbol at samples, shape (n,)."""
    return np.asarray(np.broadcast_to(sympy.lambdify(symbol, expression, "numpy")(x), x.shape), dtype=np.float64)
