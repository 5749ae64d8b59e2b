"""Tests whether one fitted model is better than another.

Residuals are correlated, so tests that assume independence do not hold. Held-out errors are compared by a *block
bootstrap*: whole blocks of the paired differences of squares are drawn, so that correlated samples stay together
(Kuensch, Annals of Statistics 17, 1989).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.signal import correlate

from relaxations.algebra.arrays import Array

_DRAWS = 2000
_STRUCTURE = 0.2  # of residuals: beyond it, noise is not all they are
_EXCEEDED = 1.2  # by this factor a fit may exceed the noise bound


def correlation_length(residuals: Sequence[Array]) -> float:
    """Return ``1 + 2 sum of the autocorrelation``, up to its first zero crossing: samples per independent one.

    Parameters
    ----------
    residuals
        Shape (n,). Per experiment.
    """
    longest = max(len(r) for r in residuals)
    total = np.zeros(longest)
    for residual in residuals:
        centred = residual - residual.mean()
        full = correlate(centred, centred, mode="full", method="fft")[len(centred) - 1 :]
        total[: len(full)] += full
    if total[0] <= 0:
        return 1.0
    rho = total / total[0]
    negative = np.flatnonzero(rho < 2.0 / np.sqrt(sum(map(len, residuals))))
    return float(1 + 2 * rho[1 : negative[0] if len(negative) else longest].sum())


def chance(worse: Sequence[Array], better: Sequence[Array], seed: int = 0) -> float:
    """Return how likely it is that the second model errs no less than the first: a one-sided block bootstrap.

    Parameters
    ----------
    worse, better
        Shape (n,). Held-out residuals of the two models, per experiment.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> noise = rng.normal(size=300)
    >>> chance([3 * noise], [noise]) < 0.01, chance([noise], [rng.normal(size=300)]) > 0.01
    (True, True)
    """
    differences = [first**2 - second**2 for first, second in zip(worse, better, strict=True)]
    return max(float(np.mean(_means(differences, worse, seed) <= 0)), 1.0 / _DRAWS)


def spread(residuals: Sequence[Array], seed: int = 0) -> float:
    """Return the standard deviation of the root mean square of residuals, by a block bootstrap.

    Parameters
    ----------
    residuals
        Shape (n,). Per experiment.

    Examples
    --------
    >>> round(spread([np.random.default_rng(1).normal(size=800)]), 2)  # one over the root of 1600
    0.03
    """
    with np.errstate(all="ignore"):
        return float(np.std(np.sqrt(_means([r**2 for r in residuals], residuals, seed))))


def _means(values: Sequence[Array], residuals: Sequence[Array], seed: int) -> Array:
    """Return means of drawn blocks of values, as long as the correlation of the residuals asks, shape (draws,)."""
    length = int(np.clip(np.ceil(2 * correlation_length(residuals)), 5, max(5, sum(map(len, residuals)) // 8)))
    blocks = [float(np.mean(part)) for v in values for part in np.array_split(v, max(1, len(v) // length))]
    return np.asarray(np.random.default_rng(seed).choice(blocks, size=(_DRAWS, len(blocks))).mean(axis=1))


def rms(residuals: Sequence[Array]) -> float:
    """Return the root mean square over all experiments; infinite where a model diverges."""
    with np.errstate(over="ignore"):
        return float(np.sqrt(np.mean(np.concatenate(list(residuals)) ** 2)))


def structure(residuals: Sequence[Array], lags: int = 25) -> float:
    """Return how far residuals are from white: the share of their power that their own past explains, 0 for noise.

    Parameters
    ----------
    residuals
        Shape (n,). Per experiment.

    Notes
    -----
    White noise gives ``(n - k) / (n (n + 2))`` in the mean of the square at lag k (Ljung and Box, Biometrika 65, 1978).
    It is subtracted from the sum, not from each square, where clipping at zero would add up.
    """
    lag, squares, counts = np.arange(1, lags + 1), 0.0, 0
    for residual in residuals:
        if len(residual) > 2 * lags:
            centred = residual - residual.mean()
            power = float(centred @ centred)
            if power > 0:
                rho = np.array([centred[k:] @ centred[:-k] for k in range(1, lags + 1)]) / power
                n = len(residual)
                squares += float(np.sum(rho**2 - (n - lag) / (n * (n + 2))))
                counts += 1
    total = max(squares, 0.0) / max(counts, 1)
    return total / (1.0 + total)


def is_more_than_noise(residuals: Sequence[Array], bound: float | None) -> bool:
    """Return whether residuals exceed the noise bound, or are correlated where none is known.

    Parameters
    ----------
    residuals
        Shape (n,). Per experiment.
    """
    if bound is not None:
        return bool(np.abs(np.concatenate(list(residuals))).max() > _EXCEEDED * bound)
    return structure(residuals) > _STRUCTURE
