"""Local search for feasible points in the space of the outer variables; it collects the cuts near them.

Every cut is linearised at a point, with the signs that it has there. The minimiser of the linear program over these
cuts is asked for a new cut, until the points no longer change (J. E. Kelley, "The cutting-plane method for solving
convex programs", J. SIAM 8 (1960) 703-712, here local). A linearised cut lies below its convex left side. So it
excludes every point that the cut itself excludes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relaxations.algebra.arrays import Array, Index
from relaxations.search.benders.cuts import Cuts
from relaxations.search.benders.master import least
from relaxations.search.benders.program import ask
from relaxations.solvers import Solver

FAR = 1.0  # a point whose noise would have to be twice as large: what is linearised there says little of here
NEAR = 0.05  # of the room inside: a cut that leaves no more at a point is near it
STEPS = 40
CARRIES = 1e-9  # multipliers from this share of the largest one: what is smaller is the solver's error


@dataclass(frozen=True)
class Point:
    """A point of the outer variables; feasible where its excess is not positive."""

    p: Array
    excess: float


@dataclass
class Asker:
    """Asks the linear program at points, counts them, and keeps the cuts that it learns."""

    cuts: Cuts
    solver: Solver = "clarabel"
    asked: int = 0

    def __call__(self, p: Array) -> Point | None:
        """Return a point with its excess; None where the solver has no answer."""
        self.asked += 1
        answer = ask(self.cuts.split, p, self.solver)
        if answer is None:
            return None
        size = np.abs(answer.multipliers)
        carrying = np.where(size > CARRIES * size.max(initial=0.0), answer.multipliers, 0.0)
        self.cuts = self.cuts.join(Cuts.of(self.cuts.split, carrying[None]))
        return Point(p, answer.excess)


def inmost(asker: Asker, start: Array, lower: Array, upper: Array) -> Point | None:
    """Return a point with as low an excess as a local search gets, well inside the set; None without any answer."""
    n = len(start)
    p = np.clip(start, lower, upper)
    answer = asker(p)
    if answer is None:
        return None
    best, radius = answer, 0.25 * (upper - lower)
    cost = np.append(np.zeros(n), 1.0)
    for _ in range(STEPS):
        # Minimise the largest linearised excess within the trust radius.
        value, slope = asker.cuts.tangents(best.p)
        found = least(
            cost,
            value,
            np.column_stack([slope, np.ones(len(value))]),
            np.append(np.maximum(lower - best.p, -radius), -1.0),
            np.append(np.minimum(upper - best.p, radius), abs(best.excess) + 1e3),
        )
        if found is None:
            break
        # Stop where the linear program promises little.
        promised = best.excess - found.point[-1]
        if promised <= 0.2 * max(-best.excess, 0.0) or (radius < 1e-9 * (upper - lower)).all():
            break
        # Take the point where it is better, and adapt the radius.
        answer = asker(best.p + found.point[:-1])
        if answer is None or answer.excess >= best.excess:
            radius = 0.5 * radius
            continue
        if best.excess - answer.excess > 0.5 * promised:
            radius = 2.0 * radius
        best = answer
    return best


def outmost(
    asker: Asker, cost: Array, inside: Point, lower: Array, upper: Array, share: float
) -> tuple[Point, Index, Index]:
    """Return the point of the set where a linear function is least, as far as a local search gets.

    The search begins at a feasible point with room, and stops once the excess is below a share of that room. The point
    may exceed by that much. The cuts that are active there, and those that almost are, come with it.
    """
    point, radius = inside, 0.1 * (upper - lower)
    active = np.zeros(0, dtype=np.int64)
    room = -inside.excess
    for _ in range(STEPS):
        # Minimise over the linearised cuts, at the last point or else at the feasible one.
        found = None
        for base in (point.p, inside.p):
            value, slope = asker.cuts.tangents(base)
            below, above = np.maximum(lower - base, -radius), np.minimum(upper - base, radius)
            found = least(cost, value, slope, below, above)
            if found is not None:
                break
        if found is None:
            break
        # Stop where the point is feasible enough and hardly moves.
        active = np.flatnonzero(found.weights > 1e-9 * np.max(found.weights, initial=1e-300))
        trial = base + found.point
        if point.excess <= share * room and abs(cost @ (trial - point.p)) <= share * abs(cost @ (trial - inside.p)):
            break
        # Ask for a new cut, and adapt the radius.
        answer = asker(trial)
        if answer is None:
            break
        if answer.excess > FAR:
            radius = 0.3 * radius
            continue
        if answer.excess <= share * room and (np.abs(found.point) > 0.99 * radius).any():
            radius = 2.0 * radius
        point = answer
    near = np.flatnonzero(asker.cuts.tangents(point.p)[0] <= NEAR * room)
    return point, active, near
