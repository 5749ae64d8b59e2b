r"""Derivatives of a noisy signal by spline-type modulating functions.

Shinbrot multiplies a differential equation by a function phi that vanishes, with its derivatives, at both ends of a
window, and integrates: by parts, every derivative of the signal goes over to phi, which is known exactly.

    y_i(t) = (-1)^i \int phi^(i)(tau - t) y(tau) d tau

Maletinsky takes for phi the B-spline of order n, a chain of n moving averages of width w.  Its i-th derivative is i
differences and n - i averages, so the whole filter is

    y_i = D^i A^(n-i) y,    A y = (1/w) \int_{t-w/2}^{t+w/2} y,    D y = (y(t + w/2) - y(t - w/2)) / w

Averages are taken by the trapezoidal rule over the samples.  With w = m T, z = exp(j omega T) and s = omega w / 2, the
frequency responses are

    A:  sin(s) / (m tan(omega T / 2))        D:  2 j sin(s) / w

real and imaginary, so nothing is delayed, and their ratio D / A is ``j (2 / T) tan(omega T / 2)``: applied to every
signal of an equation the filter is exact up to the trapezoidal rule, though each signal alone is smoothed.

References: hybrid thesis, appendix I, (i.1)-(i.9), figure 6.10; Maletinsky, "Identification of continuous dynamical
systems with spline-type modulating functions method", IFAC (1979); Preisig, Rippin, Computers and Chemical Engineering
17 (1993).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from smid.data import DataError
from smid.models import ModelError

__all__ = ["ModulatingFilter"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ModulatingFilter:
    """A spline-type modulating function, to be run over samples.

    Parameters
    ----------
    order
        Of the spline, n: derivatives below it are smoothed.
    width
        Samples between its knots, even.

    Raises
    ------
    ModelError
        If the order is no positive, or the width no positive even number.

    Examples
    --------
    >>> t = 0.1 * np.arange(7)
    >>> ModulatingFilter(order=3, width=2).derivative(t**2, 0.1, 1).round(9)
    array([0.6])
    """

    order: int = 3
    width: int = 2

    def __post_init__(self) -> None:
        if self.order < 1 or self.width < 2 or self.width % 2:
            raise ModelError(f"order = {self.order}, width = {self.width}: give a positive order and an even width")

    @property
    def margin(self) -> int:
        """Samples that are lost at each end."""
        return self.order * self.width // 2

    def derivative(self, samples: ArrayLike, sampling_time: float, derivative: int) -> Array:
        """Differentiate.

        Parameters
        ----------
        samples
            Shape (n,).
        sampling_time
            In seconds.
        derivative
            How often, from 0, which smooths only, to the order less one.

        Returns
        -------
        ndarray, shape (n - 2 margin,)
            At the samples from `margin` on; per second for each derivative.

        Raises
        ------
        DataError
            If there are too few samples or one is not finite, or the sampling time is not positive.
        ModelError
            If the derivative is not below the order.
        """
        y = np.asarray(samples, dtype=np.float64)
        if y.ndim != 1 or not np.isfinite(y).all() or y.size <= 2 * self.margin:
            raise DataError(f"samples of shape {y.shape}: give more than {2 * self.margin} finite ones")
        if not (np.isfinite(sampling_time) and sampling_time > 0):
            raise DataError(f"sampling_time = {sampling_time} is refused: give a positive number of seconds")
        self._check(derivative)
        m = self.width
        for number in range(self.order):
            if number < derivative:
                y = (y[m:] - y[:-m]) / (m * sampling_time)
            else:
                # The mean about the first sample; sums of large angles would lose digits.
                sums = np.concatenate([[0.0], np.cumsum((y[1:] + y[:-1]) / 2.0 - y[0])])
                y = (sums[m:] - sums[:-m]) / m + y[0]
        return y

    def response(self, frequency: ArrayLike, sampling_time: float, derivative: int) -> NDArray[np.complex128]:
        """Return the frequency response.

        Parameters
        ----------
        frequency
            Shape (k,). In rad/s, below half the sampling rate.
        sampling_time
            In seconds.
        derivative
            As in `derivative`.

        Returns
        -------
        ndarray of complex, shape (k,)
            What a sine of that frequency is multiplied by; ``(j frequency)^derivative`` would be ideal.

        Raises
        ------
        ModelError
            If the derivative is not below the order.

        Examples
        --------
        >>> abs(ModulatingFilter().response([0.0, 1.0], 0.02, 1)).round(3)
        array([0., 1.])
        """
        self._check(derivative)
        omega, window = np.asarray(frequency, dtype=np.float64), self.width * sampling_time
        # sin(s) / (m tan(s / m)) is 0/0 at zero frequency, where the mean passes unchanged.
        half, tangent = omega * window / 2.0, self.width * np.tan(omega * sampling_time / 2.0)
        mean = np.where(omega == 0.0, 1.0, np.sin(half) / np.where(omega == 0.0, 1.0, tangent))
        return np.asarray((2j * np.sin(half) / window) ** derivative * mean ** (self.order - derivative))

    def _check(self, derivative: int) -> None:
        if not 0 <= derivative < self.order:
            raise ModelError(
                f"derivative = {derivative} of a spline of order {self.order} is not smooth: "
                f"give 0 to {self.order - 1}, or a higher order"
            )
