"""The rates of a model during a sampling interval, and their derivatives in the states.

A sign, a floor and a condition are constants of the derivatives: where they jump, integration does not use these. The
derivative of a kink (Abs, Max, Min) is written with a sign, so it is enclosed by the slopes of both sides.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, reduce

import sympy

from smid.models import Line
from smid.models.discretise import held_rates
from smid.models.symbols import signal, t

_JUMPS = (sympy.sign, sympy.floor, sympy.ceiling)


@dataclass(frozen=True, eq=False)
class Rates:
    """The states that are integrated together.

    Parameters
    ----------
    states
        Their names.
    stages
        Symbol of each state during an interval.
    rates
        In the stages, and in samples before.
    """

    states: tuple[str, ...]
    stages: tuple[sympy.Symbol, ...]
    rates: tuple[sympy.Expr, ...]

    @staticmethod
    def of(lines: Sequence[Line]) -> Rates:
        """Return the rates among some lines."""
        found = held_rates(lines)
        stages = tuple(sympy.Dummy(name, real=True) for name in found)
        now = {signal(name)[t]: stage for name, stage in zip(found, stages, strict=True)}
        return Rates(tuple(found), stages, tuple(own.xreplace(now) for own in found.values()))

    @cached_property
    def slopes(self) -> list[list[sympy.Expr]]:
        """The Jacobian."""
        return [[slope(rate, stage) for stage in self.stages] for rate in self.rates]

    @cached_property
    def bends(self) -> list[dict[tuple[int, int], sympy.Expr]]:
        """The second derivatives of each rate in two states; those in different ones are counted twice."""
        n = range(len(self.states))
        return [
            {(j, m): (1 if j == m else 2) * slope(slopes[j], self.stages[m]) for j in n for m in n if j <= m}
            for slopes in self.slopes
        ]


def slope(expression: sympy.Expr, stage: sympy.Symbol) -> sympy.Expr:
    """Return a derivative, in which what jumps is constant."""
    smooth = expression.replace(lambda node: isinstance(node, sympy.Max | sympy.Min), _with_size)
    constants = {jump: sympy.Dummy(real=True) for jump in smooth.atoms(*_JUMPS)}
    found = sympy.diff(smooth.xreplace(constants), stage)
    # A power of a state, divided by the state, is one power: so each state occurs less often.
    return sympy.powsimp(found, combine="exp").xreplace({dummy: jump for jump, dummy in constants.items()})


def _with_size(node: sympy.Expr) -> sympy.Expr:
    """Return a larger or a smaller of numbers, with the sizes of their differences."""
    side = 1 if isinstance(node, sympy.Max) else -1
    return reduce(lambda a, b: (a + b + side * sympy.Abs(a - b)) / 2, node.args)
