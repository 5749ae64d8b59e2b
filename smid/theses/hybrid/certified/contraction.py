"""Certified bounds of variables in a linear problem, and of their quotients."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from relaxations.algebra.intervals import Intervals
from relaxations.algebra.polynomial import Polynomials
from relaxations.problem.problem import PolynomialProblem
from relaxations.proof.bounding import Relaxed, relax

__all__ = ["contracted", "quotient", "relaxed_problem"]


def relaxed_problem(problem: PolynomialProblem) -> Relaxed:
    """Return a linear problem ready for certified bounds: the lift without a complicating variable."""
    return relax(problem, "lift", 1)


def contracted(relaxed: Relaxed, box: Intervals) -> Intervals:
    """Return the certified box of the first variables of a linear problem; empty if it is proven infeasible."""
    lower, upper = box.lower.copy(), box.upper.copy()
    for j in np.flatnonzero(box.lower < box.upper).tolist():
        lower[j] = max(lower[j], _bound(relaxed, {(j,): 1.0}))
        upper[j] = min(upper[j], -_bound(relaxed, {(j,): -1.0}))
        if lower[j] > upper[j]:
            break
    return Intervals(lower, upper)


def quotient(relaxed: Relaxed, j: int, over: Intervals, known: Intervals) -> Intervals:
    """Return the certified interval of the j-th variable divided by the first, which lies in `over`.

    For a known end q of the quotient, the bound ``x_j - q x_0 >= gap`` moves the end by gap / x_0.
    """
    ends = []
    for sign, end in ((1.0, float(known.lower)), (-1.0, float(known.upper))):
        gap = _bound(relaxed, {(j,): sign, (0,): -sign * end})
        move = gap / float(over.upper if gap > 0 else over.lower) if np.isfinite(gap) else -np.inf
        ends.append(np.nextafter(sign * end + np.nextafter(move, -np.inf), -np.inf))
    return known.meet(Intervals.of(ends[0], -ends[1]))


def _bound(relaxed: Relaxed, objective: Mapping[tuple[int, ...], float]) -> float:
    return relaxed.bound(Polynomials.from_terms([objective])).bound
