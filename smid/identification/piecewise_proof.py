"""The proof of a search through cells, for a file that :mod:`relaxations.check` proves again.

The file states every kink as a variable, with its argument. A part of the search carries a :class:`Trail`: what was
proven on its box, on rows into which the kinks that the box decides are put, and the parts that it was split into.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np

from relaxations.algebra.polynomial import Polynomials
from relaxations.problem.problem import PolynomialProblem
from relaxations.proof.proof_steps import Hull, Kinks, Part, Record, Row, Sides, Step
from smid.feasible.assemble import Placed, stamp_all
from smid.feasible.feasible_set import FeasibleSet
from smid.feasible.piecewise_functions import Kind
from smid.feasible.regimes import Side


@dataclass
class Trail:
    """The proof of one part.

    Parameters
    ----------
    kept
        Without, no steps are recorded.
    steps
        What was proven of it as a whole.
    parts
        The variable that was split, its range, or else the side of a kink, and what followed.
    """

    kept: bool = False
    steps: list[Step] = field(default_factory=list)
    parts: list[tuple[str, float, float, int, Trail]] = field(default_factory=list)

    @contextmanager
    def on(self, feasible: FeasibleSet) -> Iterator[Record | None]:
        """Record what is proven on a stamping of the set."""
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
    """Return the set with every kink as a variable, and what these are.

    Examples
    --------
    >>> import sympy
    >>> from smid.data import Dataset
    >>> from smid.models import OutputError, Parameter
    >>> data = Dataset.from_arrays(input=[1.0, 1, 1, 0, 1], output=[0.0, 0.5, 0.7, 0.8, 0.4], sampling_time=1.0)
    >>> d = Parameter("d", 0, 0.5)
    >>> model = OutputError(bounds={"a1": (-0.9, 0), "b0": (0, 2)})
    >>> model = model.insert_before("u", lambda u: sympy.Max(0, u - d.symbol), parameters=[d])
    >>> problem, kinks = stated(FeasibleSet(model, data, 0.1))
    >>> [problem.names[v] for v in kinks.variables]
    ['kink1[0]', 'kink1[1]', 'kink1[2]', 'kink1[3]']
    """
    found = stamp_all(feasible.structure, feasible.data, feasible.bounds, decide=False)
    signs = [np.full(len(o.variables), o.hinge.kink.kind is Kind.SIGN) for o in found.openings]
    kinks = Kinks(
        np.concatenate([o.variables for o in found.openings]),
        np.concatenate(signs),
        Polynomials.join([o.arguments for o in found.openings]),
    )
    return found.problem, kinks


def _on_sides(feasible: FeasibleSet, steps: tuple[Step, ...]) -> Sides:
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
