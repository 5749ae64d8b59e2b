r"""An autoregressive model of a stationary record: its spectrum, and how correlated its samples are.

A record x of n samples with mean removed is described by :math:`A(q) x_t = w_t` with white w, fitted by the
Yule-Walker equations (Levinson's recursion, so that A is stable for every record) at the order of least BIC.  From it
come the spectrum :math:`S(\omega) = \sigma_w^2 / |A(e^{-j\omega})|^2`, and the whitened record A(q) x.

Reference: Brockwell and Davis, Time Series: Theory and Methods, 2nd ed., sections 8.1-8.2 and 9.3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from relaxations.algebra.arrays import Array

LARGEST_ORDER = 12


def autocovariance(x: Array, lags: int, mean: float | None = None) -> Array:
    """Return the biased autocovariance of a record at the lags 0 ... lags.

    Shape (lags + 1,), in the squared unit of x.

    Parameters
    ----------
    x
        Shape (n,).

    Examples
    --------
    >>> autocovariance(np.array([1.0, -1.0, 1.0, -1.0]), 1)
    array([ 1.  , -0.75])
    """
    centred = x - (x.mean() if mean is None else mean)
    transform = np.fft.rfft(centred, 2 * x.size)
    return np.asarray(np.fft.irfft(np.abs(transform) ** 2)[: lags + 1] / x.size, dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Autoregression:
    """A stationary autoregressive description of a record.

    Parameters
    ----------
    coefficients
        Shape (p + 1,). The polynomial A, with 1 in front.
    variance
        Of the record, in its unit squared.
    innovation
        Variance of w, in the unit squared; zero where the record is constant.
    """

    coefficients: Array
    variance: float
    innovation: float

    @property
    def explained(self) -> float:
        """Share of the variance that the record's own past tells one step ahead."""
        return 1.0 - self.innovation / self.variance if self.variance > 0 else 0.0

    def whiten(self, columns: Array) -> Array:
        """Return A(q) applied to each column, shape (n - p, ...): the start, where the past is missing, is cut off."""
        return np.asarray(lfilter(self.coefficients, [1.0], columns, axis=0), dtype=np.float64)[
            self.coefficients.size - 1 :
        ]

    def spectrum(self, size: int) -> Array:
        """Return S at the first size // 2 + 1 of `size` equidistant frequencies; the mean over all is the variance."""
        return self.innovation / np.abs(np.fft.rfft(self.coefficients, size)) ** 2


def autoregression(x: Array) -> Autoregression:
    """Describe a record by an autoregression of the order of least BIC.

    Parameters
    ----------
    x
        Shape (n,).

    Examples
    --------
    >>> noise = np.random.default_rng(0).standard_normal(2000)
    >>> found = autoregression(np.asarray(lfilter([1.0], [1.0, -0.8], noise)))
    >>> round(found.explained, 1)  # 0.8^2
    0.6
    """
    return levinson(autocovariance(x, min(LARGEST_ORDER, x.size // 10)), x.size)


def levinson(gamma: Array, n: int) -> Autoregression:
    """Return the autoregression of least BIC that an autocovariance tells.

    Parameters
    ----------
    gamma
        Shape (p + 1,). At the lags 0 ... p, the largest order.

    Examples
    --------
    >>> levinson(np.array([1.0, 0.8, 0.64]), 1000).coefficients
    array([ 1. , -0.8])
    """
    best = Autoregression(np.ones(1), float(gamma[0]), float(gamma[0]))
    if gamma[0] <= 0:
        return best
    a, variance = np.ones(1), float(gamma[0])
    least = n * np.log(variance)
    for order in range(1, gamma.size):
        reflection = -float(a @ gamma[order:0:-1]) / variance
        a = np.append(a, 0.0) + reflection * np.append(a, 0.0)[::-1]
        variance *= 1.0 - reflection**2
        if variance <= 1e-14 * gamma[0]:
            break  # a deterministic record: more coefficients would only fit rounding
        criterion = n * np.log(variance) + order * np.log(n)
        if criterion < least:
            least, best = criterion, Autoregression(a, float(gamma[0]), float(variance))
    return best
