"""Good points in the space of the outer variables, and the cuts that matter there.

Cuts are linearised at a point, each with the signs that it has there; what the linear program over them finds is asked
for a new cut, until nothing new is learnt (J. E. Kelley, "The cutting-plane method for solving convex programs",
J. SIAM 8 (1960) 703-712, here local). A linearised cut lies below its convex left side, so it never lets a point by
that the cut itself excludes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relaxations.algebra.ball_arithmetic import Array, Index
from relaxations.search.benders.cuts import Cuts
from relaxations.search.benders.master import least
from relaxations.search.benders.program import ask
from relaxations.solvers import Solver

FAR = 1.0  # a point whose noise would have to be twice as large: what is linearised there says little of here
NEAR = 0.05  # of the room inside: a cut that leaves no more at a point is near it
STEPS = 40


@dataclass(frozen=True)
class Point:
    """A point of the outer variables.

    Parameters
    ----------
    p
        Shape (n_outer,).
    excess
        Feasible where this is not positive.

    Examples
    --------
    >>> Point(np.array([0.5]), -0.1).excess <= 0  # feasible, with room
    True
    """

    p: Array
    excess: float


@dataclass
class Asker:
    """Asks the linear program at points, and keeps the cuts that it learns.

    Parameters
    ----------
    asked
        Linear programs so far.

    Examples
    --------
    >>> from relaxations.search.benders.split import Split
    >>> from relaxations.formats.expressions import problem_of, variables
    >>> a, x = variables("a x")
    >>> problem, _ = problem_of(x, [a * x == 1, a >= 0.1, a <= 2, x >= 0, x <= 2])
    >>> asker = Asker(Cuts.of(Split.of(problem, np.array([0])), np.zeros((0, 1))))
    >>> round(asker(np.array([0.25])).excess, 4), len(asker.cuts)  # a must be 1/2 at least
    (2.0, 1)
    """

    cuts: Cuts
    solver: Solver = "clarabel"
    asked: int = 0

    def __call__(self, p: Array) -> Point | None:
        """Return a point with its excess; None where the solver has no answer."""
        self.asked += 1
        answer = ask(self.cuts.split, p, self.solver)
        if answer is None:
            return None
        self.cuts = self.cuts.join(Cuts.of(self.cuts.split, answer.multipliers[None]))
        return Point(p, answer.excess)


def inmost(asker: Asker, start: Array, lower: Array, upper: Array) -> Point | None:
    """Look for a point with much room: its excess is as low as a local search gets; None without any answer.

    Parameters
    ----------
    start, lower, upper
        Shape (n_outer,).

    Examples
    --------
    >>> from relaxations.search.benders.split import Split
    >>> from relaxations.formats.expressions import problem_of, variables
    >>> a, x = variables("a x")
    >>> problem, _ = problem_of(x, [a * x == 1, a >= 0.1, a <= 2, x >= 0, x <= 2])
    >>> asker = Asker(Cuts.of(Split.of(problem, np.array([0])), np.zeros((0, 1))))
    >>> inside = inmost(asker, np.array([0.2]), problem.lower[:1], problem.upper[:1])
    >>> bool(inside.p[0] > 0.5), inside.excess < -0.4  # x = 1 / a lies well within [0, 2]
    (True, True)
    """
    n = len(start)
    p = np.clip(start, lower, upper)
    answer = asker(p)
    if answer is None:
        return None
    best, radius = answer, 0.25 * (upper - lower)
    cost = np.append(np.zeros(n), 1.0)
    for _ in range(STEPS):
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
        promised = best.excess - found.point[-1]
        if promised <= 0.2 * max(-best.excess, 0.0) or (radius < 1e-9 * (upper - lower)).all():
            break
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
    """Look for the point of the set where a linear function is least.

    Parameters
    ----------
    cost
        Shape (n_outer,).
    inside
        A feasible one with room, to begin with.
    lower, upper
        Shape (n_outer,).
    share
        Stop once the excess is below this share of the room inside.

    Returns
    -------
    point : Point
        May still exceed by a little.
    active, near : ndarray of int
        The cuts that hold it, and those that almost do.

    Examples
    --------
    >>> from relaxations.search.benders.split import Split
    >>> from relaxations.formats.expressions import problem_of, variables
    >>> a, x = variables("a x")
    >>> problem, _ = problem_of(x, [a * x == 1, a >= 0.1, a <= 2, x >= 0, x <= 2])
    >>> asker = Asker(Cuts.of(Split.of(problem, np.array([0])), np.zeros((0, 1))))
    >>> inside = asker(np.array([1.0]))
    >>> point, *_ = outmost(asker, np.array([1.0]), inside, problem.lower[:1], problem.upper[:1], 1e-6)
    >>> point.p.round(4)
    array([0.5])
    """
    point, radius = inside, 0.1 * (upper - lower)
    active = np.zeros(0, dtype=np.int64)
    room = -inside.excess
    for _ in range(STEPS):
        found = None
        for base in (point.p, inside.p):
            value, slope = asker.cuts.tangents(base)
            below, above = np.maximum(lower - base, -radius), np.minimum(upper - base, radius)
            found = least(cost, value, slope, below, above)
            if found is not None:
                break
        if found is None:
            break
        active = np.flatnonzero(found.weights > 1e-9 * np.max(found.weights, initial=1e-300))
        trial = base + found.point
        if point.excess <= share * room and abs(cost @ (trial - point.p)) <= share * abs(cost @ (trial - inside.p)):
            break
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
