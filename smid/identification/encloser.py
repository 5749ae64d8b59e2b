"""What computes the parameter intervals of a feasible set: one protocol, fulfilled for two kinds of models.

Models without Max, Min, Abs and sign, or whose priors and data decide all of them, are polynomial
(:mod:`smid.identification.polynomial`); the others are piecewise (:mod:`smid.identification.piecewise`).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from numbers import Real
from typing import Any, Protocol

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.algebra.polynomial import Polynomials
from relaxations.deadline import Progress
from relaxations.problem.problem import PolynomialProblem
from relaxations.proof.bounding import relax
from relaxations.proof.method import Cuts, Method
from relaxations.search.enclosure import Enclosure, Interval, Reason
from relaxations.search.interval_state import allowed_gap
from relaxations.search.plan import Plan
from relaxations.solvers import Solver
from smid.data.window import Window
from smid.identification.estimate import CentreStatus
from smid.identification.finite_box import Boxed
from smid.models import ModelError

NOTHING = Polynomials.from_terms([{}])  # the objective of a search for any feasible point


@dataclass(frozen=True)
class Settings:
    """How intervals are computed; :func:`smid.identify` documents each setting but the last.

    Parameters
    ----------
    witnesses
        Whether a polynomial model looks for verified points. Where only emptiness is asked for, they cost most.

    Raises
    ------
    ModelError
        For a number that is negative.
    """

    method: str | Method | Cuts = "auto"
    order: int | None = None
    solver: Solver = "clarabel"
    tolerance: float = 1e-4
    rounds: int = 10
    nodes: int = 0
    executor: Executor | None = None
    progress: Progress | None = None
    witnesses: bool = True

    def __post_init__(self) -> None:
        for name in ("tolerance", "rounds", "nodes"):
            value = getattr(self, name)
            if not (isinstance(value, Real) and float(value) >= 0):
                raise ModelError(f"{name} = {value}: give a number of at least 0")


@dataclass(frozen=True)
class Enclosed:
    """What an encloser found: the box, why it stopped, and the enclosure (None where it ended before any bound).

    The box is None where it ended before one was looked for. The proof is about some ``windows`` of the record, or
    about all of it where there are none.
    """

    boxed: Boxed | None
    reason: Reason
    enclosure: Enclosure | None = None
    windows: tuple[Window, ...] = ()


@dataclass(frozen=True)
class Certified:
    """What was found, and the contents of the certificates that prove it; none where the priors prove it."""

    found: Enclosed
    certificates: tuple[dict[str, Any], ...]


class Encloser(Protocol):
    """Computes certified intervals of a feasible set. Its constructor refuses a wrong call before any work."""

    def enclose(self) -> Enclosed:
        """Return the intervals; where it is stopped, those proven so far."""

    def certified(self, found: Enclosed) -> Certified:
        """Return what was found with the ends that certificates prove, and the contents of these certificates."""

    def centre(self, enclosure: Enclosure) -> tuple[CentreStatus, Array | None]:
        """Decide whether the interval centres are feasible; where not, return the nearest feasible point found."""


def nearest_witness(enclosure: Enclosure) -> Array | None:
    """Return the verified point whose parameters lie nearest to the centres, in widths; None without any."""
    centre = np.array([i.centre for i in enclosure.intervals])
    width = np.array([max(i.width, 1e-300) for i in enclosure.intervals])
    away = [float(np.abs((point[: len(centre)] - centre) / width).max()) for point in enclosure.witnesses]
    return enclosure.witnesses[int(np.argmin(away))] if away else None


def with_inner_ends(intervals: Iterable[Interval], points: Sequence[Array]) -> tuple[Interval, ...]:
    """Return intervals whose inner ends are those of verified points of their variables; NaN without any."""
    found = tuple(intervals)
    inner = np.array(points or [np.full(len(found), np.nan)])
    ends = zip(found, inner.min(axis=0).tolist(), inner.max(axis=0).tolist(), strict=True)
    return tuple(replace(i, inner_lower=low, inner_upper=high) for i, low, high in ends)


def is_tight(interval: Interval, tolerance: float) -> bool:
    """Return whether the gap is one that the tolerance allows."""
    return interval.gap <= allowed_gap(interval.lower, interval.upper, tolerance)


def where_open(reason: Reason) -> Reason:
    """Return why an end may be open although the proof met points that it took for inner ones."""
    return Reason.ROUNDS if reason is Reason.TIGHT else reason


def proven_infeasible(problem: PolynomialProblem, plan: Plan, solver: Solver) -> bool:
    """Return whether the lift, where it applies, proves that no point is feasible."""
    return plan.lifts and relax(problem, plan.method, plan.order, solver).bound(NOTHING).bound == np.inf
