r"""Derivatives of a noisy signal by spline-type modulating functions.

The signal y is convolved with a derivative of a B-spline phi of order n, a chain of n moving averages of width w
(integration by parts moves the derivative from y to phi):

    y_i(t) = (-1)^i \int phi^(i)(tau - t) y(tau) d tau = D^i A^(n-i) y,
    A y = (1/w) \int_{t-w/2}^{t+w/2} y,    D y = (y(t + w/2) - y(t - w/2)) / w

Averages use the trapezoidal rule over the samples. With w = m T and s = omega w / 2, the frequency responses are

    A:  sin(s) / (m tan(omega T / 2))        D:  2 j sin(s) / w

A is real and D imaginary, so the filter adds no delay. Their ratio D / A is ``j (2 / T) tan(omega T / 2)``: applied to
every signal of an equation, the filter is exact up to the trapezoidal rule, although each signal alone is smoothed.

References: hybrid thesis, appendix I, (i.1)-(i.9), figure 6.10; Maletinsky, "Identification of continuous dynamical
systems with spline-type modulating functions method", IFAC (1979); Preisig, Rippin, Computers and Chemical Engineering
17 (1993).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from relaxations.algebra.arrays import Array
from smid.data import DataError
from smid.models import ModelError

__all__ = ["ModulatingFilter"]


@dataclass(frozen=True)
class ModulatingFilter:
    """A spline-type modulating function that differentiates and smooths samples.

    Parameters
    ----------
    order
        n, of the spline. Derivatives up to n - 1 are smoothed.
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
        """Number of samples lost at each end."""
        return self.order * self.width // 2

    def derivative(self, samples: ArrayLike, sampling_time: float, derivative: int) -> Array:
        """Return a derivative at the samples from `margin` on, shape (n - 2 margin,).

        Parameters
        ----------
        sampling_time
            In seconds.
        derivative
            From 0 (smoothing only) to `order` - 1.

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
                # Relative to the first sample: sums of large numbers would lose digits.
                sums = np.concatenate([[0.0], np.cumsum((y[1:] + y[:-1]) / 2.0 - y[0])])
                y = (sums[m:] - sums[:-m]) / m + y[0]
        return y

    def response(self, frequency: ArrayLike, sampling_time: float, derivative: int) -> NDArray[np.complex128]:
        """Return the frequency response; ideal would be ``(j frequency)^derivative``.

        Parameters
        ----------
        frequency
            Shape (k,). In rad/s, below half the sampling rate.
        sampling_time
            In seconds.

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
        # sin(s) / (m tan(s / m)) is 0/0 at zero frequency, where the response is 1.
        half, tangent = omega * window / 2.0, self.width * np.tan(omega * sampling_time / 2.0)
        mean = np.where(omega == 0.0, 1.0, np.sin(half) / np.where(omega == 0.0, 1.0, tangent))
        return np.asarray((2j * np.sin(half) / window) ** derivative * mean ** (self.order - derivative))

    def _check(self, derivative: int) -> None:
        if not 0 <= derivative < self.order:
            raise ModelError(
                f"derivative = {derivative} of a spline of order {self.order} is not smooth: "
                f"give 0 to {self.order - 1}, or a higher order"
            )
