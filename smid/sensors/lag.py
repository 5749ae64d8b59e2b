"""A first-order lag whose pole may change from sample to sample.

    y_t = g_t + a_t (y_{t-1} - g_t),    a_t = exp(-T_s / tau_t)

It is stable and has gain one for any tau. Its derivatives satisfy the same recursion,

    d_t = a_t d_{t-1} + source_t,    source_t = (1 - a_t) g_t' + (y_{t-1} - g_t) a_t',    d = y'

which is solved for all samples at once by recursive doubling: after k passes, d has the effect of the last 2^k sources.

Reference: Kogge, Stone, "A parallel algorithm for the efficient solution of a general class of recurrence equations",
IEEE Trans. Computers C-22 (1973).
"""

from __future__ import annotations

import numpy as np

from relaxations.algebra.arrays import Array

__all__ = ["lag", "lag_derivatives"]

_FADED = 1e-17


def lag(signal: Array, decay: Array, before: float) -> Array:
    """Return the lagged signal, shape (n,).

    Parameters
    ----------
    signal
        Shape (n,). The input g.
    decay
        Shape (n,). The pole a at each sample, from 0 to 1.
    before
        Output before the first sample.

    Examples
    --------
    >>> lag(np.array([1.0, 1.0, 1.0]), np.array([0.5, 0.5, 0.5]), 0.0)
    array([0.5  , 0.75 , 0.875])
    """
    y, result = before, []
    for g, a in zip(signal.tolist(), decay.tolist(), strict=True):
        y = g + a * (y - g)
        result.append(y)
    return np.array(result)


def lag_derivatives(sources: Array, decay: Array) -> Array:
    """Return ``d_t = a_t d_{t-1} + source_t`` from zero, for sources of shape (p, n) and poles of shape (n,).

    Examples
    --------
    >>> lag_derivatives(np.array([[1.0, 0.0, 0.0]]), np.array([0.5, 0.5, 0.5]))
    array([[1.  , 0.5 , 0.25]])
    """
    result, reach, shift = sources.copy(), decay, 1
    while shift < decay.size and reach.max() > _FADED:
        result[:, shift:] += reach[shift:] * result[:, :-shift]
        reach = np.concatenate([np.zeros(shift), reach[shift:] * reach[:-shift]])
        shift *= 2
    return result
