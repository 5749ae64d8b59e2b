"""The least bound within which a free run explains its data, from a fit downhill: a minimax fit.

Minimises the largest error over parameters and initial states by sequential linear programming in a trust region: a
linear program minimises the largest linearised error over a box of steps, and the box grows or shrinks with what became
of the promise.  What it finds is attained but local; `smid.error_bound` encloses the global least.

Reference: Madsen, An algorithm for minimax solution of overdetermined systems of non-linear equations, Journal of the
Institute of Mathematics and its Applications 16 (1975) 321-328.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import linprog

from relaxations.algebra.arrays import Array
from smid.fitting.fit import Fitting

__all__ = ["minimax"]

_STEPS = 20
_WORTH = 1e-3  # of the largest error: for a smaller promise no step is taken
_SHORTEST = 1e-3


def minimax(problem: Fitting, vector: Array) -> tuple[Array, float]:
    """Descend from a start to a local minimum of the largest error.

    Parameters
    ----------
    vector
        Shape (n_free,). Where to begin; a least-squares fit is a good place.

    Returns
    -------
    vector : ndarray, shape (n_free,)
    largest : float
        The largest error there, over the samples that count, in standard deviations of its channel; infinite where the
        start runs away.

    Examples
    --------
    >>> from smid.data import Dataset
    >>> from smid.models import OutputError
    >>> data = Dataset.from_arrays(input={"u": [1.0, 1, 1, 1]}, output={"y": [0.0, 1, 2, 4]}, sampling_time=1.0)
    >>> gain = OutputError(na=0, offset=True)
    >>> problem = Fitting(gain, data, [np.array([False, True, True, True])])
    >>> _, largest = minimax(problem, problem.start({"b0": 1.0, "offset": 0.0}))
    >>> round(largest * problem.scale["y"], 3)  # a constant leaves half the range
    1.5
    """
    lower, upper = problem.box
    vector = np.clip(vector, lower, upper)
    error = problem.residual(vector)
    largest, radius = float(np.abs(error).max()), 1.0
    if not np.isfinite(largest):
        return vector, largest
    slopes = _finite(problem.jacobian(vector))
    for _ in range(_STEPS):
        # A step of one changes the RMS error by the largest error.
        size = np.sqrt(np.mean(slopes**2, axis=0))
        unit = np.divide(largest, size, out=np.zeros_like(size), where=size > 0)
        step, promised = _program(error, slopes * unit, *_room(vector, unit, lower, upper, radius))
        if largest - promised < _WORTH * largest:
            break
        tried = np.clip(vector + unit * step, lower, upper)
        found = problem.residual(tried)
        share = (largest - float(np.abs(found).max())) / (largest - promised)
        if share > 0.1:
            vector, error, largest = tried, found, float(np.abs(found).max())
            slopes = _finite(problem.jacobian(vector))
        radius *= 2.0 if share > 0.7 else 1.0 if share > 0.1 else 0.3
        if radius < _SHORTEST:
            break
    return vector, largest


def _finite(slopes: Array) -> Array:
    """Take a slope that does not exist, of a root at zero, for none."""
    return np.nan_to_num(slopes, posinf=0.0, neginf=0.0)


def _room(vector: Array, unit: Array, lower: Array, upper: Array, radius: float) -> tuple[Array, Array]:
    """Return the least and the largest step of each number, in its unit."""
    below, above = (np.divide(end - vector, unit, out=np.zeros_like(unit), where=unit > 0) for end in (lower, upper))
    return np.maximum(below, -radius), np.minimum(above, radius)


def _program(error: Array, slopes: Array, least: Array, most: Array) -> tuple[Array, float]:
    """Minimise the largest linearised error over a box; return the step, and what it promises."""
    count = slopes.shape[1]
    above = np.hstack([slopes, -np.ones((len(error), 1))])
    below = np.hstack([-slopes, -np.ones((len(error), 1))])
    found = linprog(
        np.append(np.zeros(count), 1.0),
        A_ub=np.vstack([above, below]),
        b_ub=np.concatenate([-error, error]),
        bounds=[*zip(least, most, strict=True), (0.0, None)],
        method="highs",
    )
    if found.x is None:
        return np.zeros(count), float(np.abs(error).max())
    return found.x[:count], float(found.x[count])
