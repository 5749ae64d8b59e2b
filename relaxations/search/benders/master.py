"""The small linear programs in the outer variables alone, and what their multipliers prove."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog

from relaxations.algebra.ball_arithmetic import EPSILON, TINY, Array
from relaxations.deadline import check_time, remaining

GAIN = 1e-3  # of half a box's width: less is not worth a step


@dataclass(frozen=True)
class Least:
    """The least value of a linear function over ``b + A s >= 0`` in a box.

    Parameters
    ----------
    point
        Shape (n,).
    weights
        Shape (n_rows,). Multipliers of the rows, nonnegative.
    """

    point: Array
    weights: Array


def least(cost: Array, b: Array, a: Array, lower: Array, upper: Array) -> Least | None:
    """Minimise ``cost @ s`` over ``b + a @ s >= 0`` and ``lower <= s <= upper``; None where nothing is feasible.

    Parameters
    ----------
    cost
        Shape (n,).
    b
        Shape (n_rows,).
    a
        Shape (n_rows, n).
    lower, upper
        Shape (n,).

    Examples
    --------
    >>> found = least(np.array([1.0]), np.array([-0.5]), np.array([[1.0]]), np.array([-1.0]), np.array([1.0]))
    >>> found.point, found.weights
    (array([0.5]), array([1.]))
    """
    check_time()
    found = linprog(  # type: ignore[call-overload]
        cost,
        A_ub=-a,
        b_ub=b,
        bounds=np.stack([lower, upper], axis=1),
        method="highs",
        # Without presolve, which ends the process on some programs (HiGHS 1.12 to 1.15).
        options={"presolve": False, "time_limit": remaining()},
    )
    check_time()
    return Least(found.x, np.maximum(-found.ineqlin.marginals, 0.0)) if found.status == 0 else None


def contradiction(b: Array, a: Array) -> tuple[Array, float] | None:
    """Return weights of rows ``b + a @ s >= 0`` that no s in [-1, 1] satisfies together, and by how much they fail.

    Parameters
    ----------
    b
        Shape (n_rows,).
    a
        Shape (n_rows, n).

    Returns
    -------
    (ndarray, shape (n_rows,), float) or None
        None where that is not proven.

    Examples
    --------
    >>> weights, margin = contradiction(np.array([-0.5, -0.5]), np.array([[1.0], [-1.0]]))  # s >= 0.5 and s <= -0.5
    >>> weights, round(margin, 9)
    (array([0.5, 0.5]), 0.5)
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
    """Return a bound below ``cost @ s`` where ``b + a @ s >= 0`` and ``|s| <= 1``; any nonnegative weights prove one.

    Parameters
    ----------
    cost
        Shape (n,).
    weights
        Shape (n_rows,).

    Returns
    -------
    float
        Rounded down.

    Examples
    --------
    >>> row = np.array([[1.0]])
    >>> 0.5 - 1e-12 < lower_bound(np.array([1.0]), np.array([-0.5]), row, np.array([1.0])) <= 0.5
    True
    """
    left = cost - weights @ a
    value = -weights @ b - np.abs(left).sum()
    size = weights @ (np.abs(b) + np.abs(a).sum(axis=1)) + np.abs(cost).sum()
    return float(value - 4 * (len(b) + len(cost) + 8) * (EPSILON * size + TINY))


@dataclass(frozen=True)
class Shrunk:
    """The part of [-1, 1] that rows leave, and the rows that say so.

    Parameters
    ----------
    lower, upper
        Shape (n,). Rounded outwards.
    taken
        Variable, side (1 for lower ends), row and end, one after the other; each rests on those before it.
    failing
        A row that nothing satisfies in what the others left.

    Examples
    --------
    >>> Shrunk(np.array([0.5]), np.array([0.25]), ((0, 1, 0, 0.5), (0, -1, 1, 0.25))).empty
    True
    """

    lower: Array
    upper: Array
    taken: tuple[tuple[int, int, int, float], ...] = ()
    failing: int | None = None

    @property
    def empty(self) -> bool:
        """Return whether nothing is left."""
        return self.failing is not None or bool((self.lower > self.upper).any())


def shrink(b: Array, a: Array, passes: int = 3) -> Shrunk:
    """Return the part of [-1, 1] that rows ``b + a @ s >= 0`` leave, one by one.

    Parameters
    ----------
    b
        Shape (n_rows,).
    a
        Shape (n_rows, n).

    Examples
    --------
    >>> left = shrink(np.array([-0.75]), np.array([[1.0, 0.5]]))  # s0 + s1 / 2 >= 3/4
    >>> left.lower.round(6), left.upper, [step[:3] for step in left.taken]
    (array([ 0.25, -0.5 ]), array([1., 1.]), [(0, 1, 0), (1, 1, 0)])
    """
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
