r"""Correlation of an error with its own past and with an input, within the band where 99 % of chance lies.

With e and u of mean zero, over the samples of all stretches together,

.. math::  r_{xy}(\tau) = \sum_t x_{t+\tau} y_t \Big/ \sqrt{\sum_t x_t^2 \, \sum_t y_t^2}.

White errors of n samples keep :math:`|r_{ee}(\tau)| \le 2.58 / \sqrt n` at 99 % of the lags. Errors independent of the
input keep :math:`|r_{eu}(\tau)| \le 2.58 \sqrt{P / n}` with :math:`P = \sum_k r_{ee}(k) r_{uu}(k)`: two slow signals
look alike more often. An input correlated at negative lags reacts on the error: feedback.

Reference: Ljung, System Identification, 2nd ed., section 16.6.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import correlate
from scipy.stats import binom, norm

from relaxations.algebra.arrays import Array, Mask

FEWEST = 40
"""A record of fewer samples is not searched for structure."""
MOST_LAGS = 25
SIGNIFICANT = 0.01
"""Probability by chance below which a residual fails a test."""
_BAND = float(norm.ppf(0.995))


@dataclass(frozen=True, eq=False)
class Correlation:
    """Correlation of an error at some lags, with its 99 % band.

    Parameters
    ----------
    against
        Channel of the input; empty for the error's own past.
    lags
        Shape (m,). In samples; a positive lag is that of the error behind the input.
    values
        Shape (m,). From -1 to 1.
    band
        Half width of the 99 % band around zero.
    """

    against: str
    lags: NDArray[np.int64]
    values: Array
    band: float

    @property
    def chance(self) -> float:
        """Probability that chance alone gives a correlation as large as the largest one at any lag.

        It is Bonferroni's. The lags of a white signal are independent: for its own past, chance may also give as many
        lags outside the band (binomial), and the probability is twice the smaller of the two.
        """
        largest = float(np.abs(self.values).max()) / self.band * _BAND
        chance = self.lags.size * 2 * float(norm.sf(largest))
        if not self.against:
            chance = 2 * min(chance, float(binom.sf(int(self.outside.sum()) - 1, self.lags.size, 0.01)))
        return min(1.0, chance)

    @property
    def strongest(self) -> int:
        """Lag of the largest correlation."""
        return int(self.lags[np.argmax(np.abs(self.values))])

    @property
    def outside(self) -> Mask:
        """Tell which lags lie outside the band, shape (m,)."""
        return np.asarray(np.abs(self.values) > self.band)


def autocorrelation(error: Sequence[Array]) -> Correlation | None:
    """Return the correlation of an error with its own past; None where it is constant, or too short.

    Parameters
    ----------
    error
        Shape (n,). Per stretch of consecutive samples.

    Examples
    --------
    >>> white = np.random.default_rng(0).standard_normal(500)
    >>> int(autocorrelation([white]).outside.sum()), bool(autocorrelation([np.cumsum(white)]).outside.all())
    (0, True)
    """
    n, reach = sum(map(len, error)), _reach(error)
    whole = _correlation(error, error, reach)
    if whole is None:
        return None
    return Correlation("", np.arange(1, reach + 1), whole[reach + 1 :], _BAND / np.sqrt(n))


def cross_correlation(error: Sequence[Array], input: Sequence[Array], name: str) -> Correlation | None:
    """Return the correlation of an error with an input; None where one of them is constant, or too short.

    Parameters
    ----------
    error, input
        Shape (n,). Per stretch of consecutive samples.

    Examples
    --------
    >>> u = np.random.default_rng(0).standard_normal(500)
    >>> found = cross_correlation([np.roll(u, 3)], [u], "u")
    >>> found.lags[found.outside]
    array([3])
    """
    n, reach = sum(map(len, error)), _reach(error)
    values = _correlation(error, input, reach)
    own, other = _correlation(error, error, reach), _correlation(input, input, reach)
    if values is None or own is None or other is None:
        return None
    # Noise of the estimates may take the sum below its value for white signals.
    power = max(float(own @ other), 1.0)
    return Correlation(name, np.arange(-reach, reach + 1), values, _BAND * float(np.sqrt(power / n)))


def _reach(parts: Sequence[Array]) -> int:
    """Return the largest lag: a quarter of the longest stretch at most."""
    return min(MOST_LAGS, max(map(len, parts)) // 4)


def _correlation(x: Sequence[Array], y: Sequence[Array], reach: int) -> Array | None:
    """Return r_xy at the lags -reach ... reach."""
    if sum(map(len, x)) < FEWEST:
        return None
    first, second = (np.concatenate(list(parts)).mean() for parts in (x, y))
    total, power_x, power_y = np.zeros(2 * reach + 1), 0.0, 0.0
    for a, b in zip(x, y, strict=True):
        e, u = a - first, b - second
        long = np.pad(correlate(e, u, mode="full", method="fft"), reach)  # stretches may be shorter than the reach
        middle = reach + len(u) - 1
        total += long[middle - reach : middle + reach + 1]
        power_x, power_y = power_x + float(e @ e), power_y + float(u @ u)
    scale = np.sqrt(power_x * power_y)
    return total / scale if scale > 0 else None
