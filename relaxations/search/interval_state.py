"""The ends of intervals while they are computed: what is proven so far, and the witnesses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.problem.problem import PolynomialProblem
from relaxations.proof.bounding import Emptiness, Relaxed

FLOOR = 1e-8  # a gap below this share of the value itself is rounding, however narrow the interval


@dataclass
class Ends:
    """Certified ends of all variables of a problem, verified points, and the work done so far.

    A gap is tight below ``tolerance`` times the interval's width, or below ``absolute`` in the variable's unit.
    ``pool`` holds the verified points, ``status`` the solver's words for each end: sign 1 for lower ends, -1 for upper
    ones. ``empty`` is the proof, once the set is proven empty.
    """

    lower: Array
    upper: Array
    tolerance: float
    absolute: float
    pool: list[Array]
    status: dict[tuple[int, int], str] = field(default_factory=dict)
    solves: int = 0
    rounds: int = 0
    empty: Emptiness | None = None
    order: int = 0
    relaxed: Relaxed | None = None

    def box(self, problem: PolynomialProblem) -> PolynomialProblem:
        """Return the problem on the box that is proven."""
        return problem.with_box(self.lower, self.upper)

    def tighten(self, k: int, sign: int, bound: float) -> float:
        """Take a certified lower bound of ``sign * x[k]``; return how much it gained."""
        if sign > 0:
            gained = max(bound - self.lower[k], 0.0)
            self.lower[k] = max(self.lower[k], bound)
        else:
            gained = max(self.upper[k] + bound, 0.0)
            self.upper[k] = min(self.upper[k], -bound)
        return float(gained)

    def inner(self, k: int) -> tuple[float, float]:
        """Return the least and the largest value at a verified point; NaN where there is none."""
        values = [p[k] for p in self.pool]
        return (min(values), max(values)) if values else (np.nan, np.nan)

    def negligible(self, k: int) -> float:
        """Return the gap that counts as tight however narrow the interval."""
        return max(self.absolute, allowed_gap(float(self.lower[k]), float(self.upper[k]), 0.0))

    def allowed_gap(self, k: int) -> float:
        """Return the gap that counts as tight."""
        return max(self.absolute, allowed_gap(float(self.lower[k]), float(self.upper[k]), self.tolerance))

    def end_tight(self, k: int, sign: int) -> bool:
        """Return whether an end meets its witness."""
        inner = self.inner(k)
        if np.isnan(inner[0]):
            return False
        gap = inner[0] - self.lower[k] if sign > 0 else self.upper[k] - inner[1]
        return bool(gap <= self.allowed_gap(k))

    def tight(self, targets: Sequence[int]) -> bool:
        """Return whether both ends of all targets meet their witnesses."""
        return all(self.end_tight(k, sign) for k in targets for sign in (1, -1))


def allowed_gap(lower: float, upper: float, tolerance: float) -> float:
    """Return the gap of an interval that counts as tight: a share of its width, or rounding of its values."""
    return max(tolerance * (upper - lower), FLOOR * max(abs(lower), abs(upper)))


def shrinkage(before: Array, after: Array) -> float:
    """Return the largest share of its width that an interval lost, from the widths before and after."""
    return float(np.max(1 - after[before > 0] / before[before > 0], initial=0.0))
