"""The proof of a search through sub-boxes, for a file that :mod:`relaxations.check` proves again.

The file states every kink as a variable, with its argument. Each region of the search has a :class:`Trail`: the steps
that were proven on its box, with the values of the kinks that the box decides, and the parts that it was split into.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np

from relaxations.algebra.polynomial import Polynomials
from relaxations.problem.problem import PolynomialProblem
from relaxations.proof.proof_steps import Hull, Kinks, Part, Recorder, Row, Sides, Step
from smid.feasible.assemble import Placed, stamp_all
from smid.feasible.feasible_set import FeasibleSet
from smid.feasible.piecewise_functions import Kind
from smid.feasible.regimes import Side


@dataclass
class Trail:
    """The proof of one region: the steps proven for the whole of it (where ``kept``), and its parts.

    A part is the variable that was split, its range, the side of a kink (0 for a range), and the proof of the part.
    """

    kept: bool = False
    steps: list[Step] = field(default_factory=list)
    parts: list[tuple[str, float, float, int, Trail]] = field(default_factory=list)

    @contextmanager
    def on(self, feasible: FeasibleSet) -> Iterator[Recorder | None]:
        """Record the steps that are proven on a set in this region's box."""
        own: list[Step] = []
        yield own.append if self.kept else None
        if own:
            self.steps.append(_on_sides(feasible, tuple(own)))

    def part(self, variable: str, low: float = 0.0, high: float = 0.0, side: int = 0) -> Trail:
        """Begin the proof of a part."""
        own = Trail(self.kept)
        self.parts.append((variable, low, high, side, own))
        return own

    def whole(self, stated: PolynomialProblem, count: int) -> list[Step]:
        """Return all steps; the hull is that of the first ``count`` variables."""
        if not self.parts:
            return self.steps
        parts = tuple(
            Part(stated.names.index(variable), low, high, tuple(own.whole(stated, count)), side)
            for variable, low, high, side, own in self.parts
        )
        return [*self.steps, Hull(stated, np.arange(count), parts)]


def stated(feasible: FeasibleSet) -> tuple[PolynomialProblem, Kinks]:
    """Return the set with every kink as a variable, and the kinks."""
    found = stamp_all(feasible.templates, feasible.data, feasible.bounds, decide=False)
    signs = [np.full(len(o.variables), o.hinge.kink.kind is Kind.SIGN) for o in found.openings]
    kinks = Kinks(
        np.concatenate([o.variables for o in found.openings]),
        np.concatenate(signs),
        Polynomials.join([o.arguments for o in found.openings]),
    )
    return found.problem, kinks


def _on_sides(feasible: FeasibleSet, steps: tuple[Step, ...]) -> Sides:
    """Return steps with the kinks that the set decides, and the rows of the open ones."""
    problem = feasible.problem
    known = [
        (placed.variable(k), int(placed.sides[k]))
        for placed in feasible.placed
        for k in np.flatnonzero(placed.sides != Side.OPEN).tolist()
    ]
    rows = [row for placed in feasible.placed for row in _rows(placed)]
    defined = [
        (int(row), problem.names[v])
        for equalities, variables in feasible.definitions
        for row, v in zip(equalities, variables, strict=True)
        if np.isfinite(problem.upper[v])
    ]
    return Sides(problem, tuple(known), tuple(rows), tuple(defined), steps)


def _rows(placed: Placed) -> list[Row]:
    """Name the inequalities of a kink, in the order in which :mod:`smid.feasible.assemble` writes them."""
    low, high = placed.within.low.tolist(), placed.within.high.tolist()
    rows = [Row("side", placed.variable(k)) for k in np.flatnonzero(placed.chosen).tolist()]
    at = np.flatnonzero(placed.sides == Side.OPEN).tolist()
    if placed.hinge.kink.kind is Kind.SIGN:
        rows += [Row("low", placed.variable(k), (low[k],)) for k in at if -np.inf < low[k] < 0]
        rows += [Row("high", placed.variable(k), (high[k],)) for k in at if 0 < high[k] < np.inf]
    else:
        rows += [Row("above", placed.variable(k)) for k in at]
        rows += [Row("chord", placed.variable(k), (low[k], high[k])) for k in at if low[k] > -np.inf]
    return rows
