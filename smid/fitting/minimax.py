"""Minimax fit: parameters and initial states with the smallest maximum error of the free run.

Sequential linear programming in a trust region: each linear program minimises the largest linearised error over a box
of steps. The box grows or shrinks with the ratio of actual to predicted reduction. The minimum is attained, but local;
`smid.error_bound` bounds the global one.

Reference: Madsen, An algorithm for minimax solution of overdetermined systems of non-linear equations, Journal of the
Institute of Mathematics and its Applications 16 (1975) 321-328.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import linprog

from relaxations.algebra.arrays import Array
from smid.fitting.constraints import Constraints
from smid.fitting.fit import Fitting

__all__ = ["minimax"]

_STEPS = 20
_WORTH = 1e-3  # smallest predicted reduction, as a share of the largest error
_SHORTEST = 1e-3


def minimax(problem: Fitting, vector: Array, constraints: Constraints | None = None) -> tuple[Array, float]:
    """Return a local minimiser of the largest error, shape (n_free,), and this error.

    The error is in standard deviations of its channel. It is infinite if the free run diverges at the start.
    A least-squares fit is a good start. It must keep the constraints, if some are given.
    """
    lower, upper = problem.box
    vector = np.clip(vector, lower, upper)
    error = problem.residual(vector)
    largest, radius = float(np.abs(error).max()), 1.0
    if not np.isfinite(largest):
        return vector, largest
    slopes = _finite(problem.jacobian(vector))
    for _ in range(_STEPS):
        # Scale so that a unit step changes the RMS error by the largest error.
        size = np.sqrt(np.mean(slopes**2, axis=0))
        unit = np.divide(largest, size, out=np.zeros_like(size), where=size > 0)
        room, tilt = np.empty(0), np.empty((0, len(vector)))
        if constraints is not None:
            room, tilt = np.maximum(constraints.value(vector), 0.0), constraints.slopes(vector) * unit
        step, promised = _program(error, slopes * unit, *_room(vector, unit, lower, upper, radius), room, tilt)
        if largest - promised < _WORTH * largest:
            break
        tried = np.clip(vector + unit * step, lower, upper)
        found = problem.residual(tried)
        # Accept the step and adapt the radius by actual over predicted reduction.
        share = (largest - float(np.abs(found).max())) / (largest - promised)
        if constraints is not None and constraints.violated(tried):
            share = 0.0
        if share > 0.1:
            vector, error, largest = tried, found, float(np.abs(found).max())
            slopes = _finite(problem.jacobian(vector))
        radius *= 2.0 if share > 0.7 else 1.0 if share > 0.1 else 0.3
        if radius < _SHORTEST:
            break
    return vector, largest


def _finite(slopes: Array) -> Array:
    """Replace an infinite or undefined slope, as of a root at zero, by zero."""
    return np.nan_to_num(slopes, posinf=0.0, neginf=0.0)


def _room(vector: Array, unit: Array, lower: Array, upper: Array, radius: float) -> tuple[Array, Array]:
    """Return the smallest and largest step of each number, in its unit."""
    below, above = (np.divide(end - vector, unit, out=np.zeros_like(unit), where=unit > 0) for end in (lower, upper))
    return np.maximum(below, -radius), np.minimum(above, radius)


def _program(error: Array, slopes: Array, least: Array, most: Array, room: Array, tilt: Array) -> tuple[Array, float]:
    """Return the step of least predicted largest error in a box, with ``room + tilt @ step >= 0``, and this error."""
    count = slopes.shape[1]
    above = np.hstack([slopes, -np.ones((len(error), 1))])
    below = np.hstack([-slopes, -np.ones((len(error), 1))])
    found = linprog(
        np.append(np.zeros(count), 1.0),
        A_ub=np.vstack([above, below, np.hstack([-tilt, np.zeros((len(room), 1))])]),
        b_ub=np.concatenate([-error, error, room]),
        bounds=[*zip(least, most, strict=True), (0.0, None)],
        method="highs",
    )
    if found.x is None:
        return np.zeros(count), float(np.abs(error).max())
    return found.x[:count], float(found.x[count])
