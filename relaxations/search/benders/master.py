"""The small linear programs in the outer variables alone, and the bounds that their multipliers prove."""

from __future__ import annotations

from dataclasses import dataclass

import highspy
import numpy as np
from scipy import sparse

from relaxations.algebra.arrays import Array
from relaxations.algebra.ball_arithmetic import EPSILON, TINY
from relaxations.deadline import check_time, remaining
from relaxations.points.linear_program import prepared

GAIN = 1e-3  # of half a box's width: less is not worth a step


@dataclass(frozen=True)
class Least:
    """The minimiser of a linear function over ``b + A s >= 0`` in a box, and its rows' multipliers."""

    point: Array
    weights: Array


def least(cost: Array, b: Array, a: Array, lower: Array, upper: Array) -> Least | None:
    """Return the least ``cost @ s`` over ``b + a @ s >= 0`` in a box; None where nothing is feasible."""
    check_time()
    rows = sparse.csr_array(a)
    solver = prepared(cost, rows, (-b, np.full(len(b), np.inf)), (lower, upper))
    solver.setOptionValue("time_limit", remaining())
    solver.run()
    check_time()
    if solver.getModelStatus() != highspy.HighsModelStatus.kOptimal:
        return None
    found = solver.getSolution()
    return Least(np.array(found.col_value), np.maximum(found.row_dual, 0.0))


def contradiction(b: Array, a: Array) -> tuple[Array, float] | None:
    """Return weights of rows ``b + a @ s >= 0`` that no s in [-1, 1] satisfies together, and the margin they prove.

    None where no contradiction is proven.
    """
    n = a.shape[1]
    reach = 1.0 + float(np.max(np.abs(b) + np.abs(a).sum(axis=1), initial=0.0))
    found = least(
        np.append(np.zeros(n), 1.0),
        b,
        np.column_stack([a, np.ones(len(b))]),
        np.append(-np.ones(n), -reach),
        np.append(np.ones(n), reach),
    )
    margin = 0.0 if found is None else lower_bound(np.zeros(n), b, a, found.weights)
    return (found.weights, margin) if found is not None and margin > 0 else None


def lower_bound(cost: Array, b: Array, a: Array, weights: Array) -> float:
    """Return a bound below ``cost @ s`` where ``b + a @ s >= 0`` and ``|s| <= 1``, rounded down.

    Any nonnegative weights of the rows prove one.
    """
    left = cost - weights @ a
    value = -weights @ b - np.abs(left).sum()
    size = weights @ (np.abs(b) + np.abs(a).sum(axis=1)) + np.abs(cost).sum()
    return float(value - 4 * (len(b) + len(cost) + 8) * (EPSILON * size + TINY))


@dataclass(frozen=True)
class Shrunk:
    """The part of [-1, 1] that rows allow, its ends rounded outwards, and the rows that prove it.

    Parameters
    ----------
    taken
        Variable, side (1 for lower ends), row and end, one after the other; each uses those before it.
    failing
        A row that nothing satisfies in the part that the others allow.
    """

    lower: Array
    upper: Array
    taken: tuple[tuple[int, int, int, float], ...] = ()
    failing: int | None = None

    @property
    def empty(self) -> bool:
        """Return whether no point is allowed."""
        return self.failing is not None or bool((self.lower > self.upper).any())


def shrink(b: Array, a: Array, passes: int = 3) -> Shrunk:
    """Return the part of [-1, 1] that rows ``b + a @ s >= 0`` allow, one row at a time."""
    n = a.shape[1]
    lower, upper = -np.ones(n), np.ones(n)
    taken: list[tuple[int, int, int, float]] = []
    if not len(b):
        return Shrunk(lower, upper)
    slack = 16 * (n + 4) * (EPSILON * (np.abs(b) + np.abs(a).sum(axis=1)) + TINY)
    for _ in range(passes):
        most = np.where(a > 0, a * upper, a * lower)
        total = b + slack + most.sum(axis=1)
        if total.min() < 0:
            return Shrunk(lower, upper, tuple(taken), int(np.argmin(total)))
        with np.errstate(over="ignore"):
            limit = (most - total[:, None]) / np.where(a == 0, 1.0, a)  # of s_j, by what the others leave
            limit = limit - np.sign(a) * 8 * EPSILON * np.abs(limit)
        above, below = np.where(a > 0, limit, -np.inf), np.where(a < 0, limit, np.inf)
        raised, lowered = above.max(axis=0) > lower + GAIN, below.min(axis=0) < upper - GAIN
        for j in np.flatnonzero(raised):
            row = int(above[:, j].argmax())
            lower[j] = limit[row, j]
            taken.append((int(j), 1, row, float(lower[j])))
        for j in np.flatnonzero(lowered):
            row = int(below[:, j].argmin())
            upper[j] = limit[row, j]
            taken.append((int(j), -1, row, float(upper[j])))
        if not (raised.any() or lowered.any()) or (lower > upper).any():
            break
    return Shrunk(lower, upper, tuple(taken))
