"""Vectorised ball arithmetic: every number is a float64 midpoint with a radius that is never too small.

An operation ``c = fl(a op b)`` in IEEE double precision is wrong by at most ``u |c|`` (``u = 2**-53``), plus the
smallest normal number where a product may underflow. A sum of ``n`` terms, in whatever order NumPy, BLAS or a sparse
product takes them, is wrong by at most ``(n - 1) u / (1 - (n - 1) u)`` times the sum of absolute values. Every radius
below uses ``EPSILON = 2 u`` in place of ``u``: the factor of two pays for the rounding of the radius itself.

References
----------
S. M. Rump, "Verification methods: rigorous results using floating-point arithmetic", Acta Numerica 19 (2010).
N. J. Higham, "Accuracy and Stability of Numerical Algorithms", 2nd ed., SIAM (2002), sections 3.1 and 4.2.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]

EPSILON = 2.0**-52
TINY = 2.0**-1022  # covers an underflow; the smallest normal number
_UP = 1.0 + 8 * EPSILON  # pays for the handful of roundings in a radius


@dataclass(frozen=True)
class Balls:
    """An array of enclosures ``[mid - rad, mid + rad]``.

    Parameters
    ----------
    mid, rad
        Midpoints, and radii that are at least the distance to the exact value.

    Examples
    --------
    >>> third = Balls.exact(1.0) / Balls.exact(3.0)
    >>> bool(third.rad > 0)
    True
    """

    mid: Array
    rad: Array

    @staticmethod
    def exact(values: ArrayLike) -> Balls:
        """Floats taken at face value: radius zero."""
        mid = np.asarray(values, dtype=np.float64)
        return Balls(mid, np.zeros_like(mid))

    @staticmethod
    def enclose(value: Fraction) -> Balls:
        """Return the ball around a rational number; radius zero where a float holds it exactly."""
        mid = float(value)
        return Balls(np.asarray(mid), np.asarray(0.0 if Fraction(mid) == value else abs(mid) * EPSILON + TINY))

    def __getitem__(self, index: Any) -> Balls:
        return Balls(self.mid[index], self.rad[index])

    def __len__(self) -> int:
        return len(self.mid)

    def __neg__(self) -> Balls:
        return Balls(-self.mid, self.rad)

    def __add__(self, other: Balls) -> Balls:
        mid = self.mid + other.mid
        return Balls(mid, (self.rad + other.rad + EPSILON * np.abs(mid)) * _UP)

    def __sub__(self, other: Balls) -> Balls:
        return self + (-other)

    def __mul__(self, other: Balls) -> Balls:
        mid = self.mid * other.mid
        rad = np.abs(self.mid) * other.rad + np.abs(other.mid) * self.rad + self.rad * other.rad
        # Zero and powers of two multiply without rounding (short of underflow): data that are only copied or negated
        # stay exact, and with them the simulations that verify a witness.
        either_zero = (self.mid == 0) | (other.mid == 0)
        exact = (_is_trivial(self.mid) | _is_trivial(other.mid)) & ((np.abs(mid) > TINY) | either_zero)
        rounding = np.where(exact, 0.0, EPSILON * np.abs(mid) + TINY)
        zero = ((self.mid == 0) & (self.rad == 0)) | ((other.mid == 0) & (other.rad == 0))
        uncertain = ~zero & ((self.rad > 0) | (other.rad > 0) | (rounding > 0))
        return Balls(mid, np.where(uncertain, (rad + rounding) * _UP + TINY, 0.0))

    def __truediv__(self, other: Balls) -> Balls:
        least = np.abs(other.mid) - other.rad  # distance of the divisor from zero
        if np.any(least <= 0):
            raise ZeroDivisionError("a divisor's enclosure contains zero")
        mid = self.mid / other.mid
        # A product that underflows here would be missed by the division.
        rad = (self.rad + np.abs(mid) * other.rad + TINY * (other.rad > 0)) / (least * (1 - 4 * EPSILON))
        return Balls(mid, (rad + EPSILON * np.abs(mid) + TINY) * _UP)

    def __pow__(self, exponent: int) -> Balls:
        result = Balls.exact(np.ones_like(self.mid))
        for _ in range(exponent):
            result = result * self
        return result

    def scaled(self, powers_of_two: Array) -> Balls:
        """Return the product with exact powers of two, which rounds nothing but what underflows."""
        mid = self.mid * powers_of_two
        rounded = (self.rad > 0) | ((np.abs(mid) < TINY) & (self.mid != 0))
        return Balls(mid, self.rad * np.abs(powers_of_two) + TINY * rounded)

    def magnitude(self) -> Array:
        """Return an upper bound of the absolute value, elementwise."""
        return (np.abs(self.mid) + self.rad) * _UP

    @property
    def lower(self) -> Array:
        """Return a lower end, rounded down."""
        return np.nextafter(self.mid - self.rad, -np.inf)

    @property
    def upper(self) -> Array:
        """Return an upper end, rounded up."""
        return np.nextafter(self.mid + self.rad, np.inf)

    def segment_sum(self, segment: Index, n_segments: int) -> Balls:
        """Return the sums over equal ``segment`` numbers, one ball for each of ``n_segments``."""
        mid = np.asarray(np.bincount(segment, self.mid, n_segments), dtype=np.float64)
        absolute = np.bincount(segment, np.abs(self.mid), n_segments)
        rad = np.bincount(segment, self.rad, n_segments)
        count = np.bincount(segment, minlength=n_segments)
        # One term is copied, not rounded: exact data stay exact.
        rounding = np.where(count > 1, count * EPSILON * absolute, 0.0)
        return Balls(mid, (rad + rounding) * (1 + (count + 8) * EPSILON))


def _is_trivial(values: Array) -> NDArray[np.bool_]:
    mantissa, _ = np.frexp(values)
    return np.asarray((np.abs(mantissa) == 0.5) | (values == 0))


def outwards(value: Fraction, direction: int) -> float:
    """Return the nearest float that does not lie inside the exact end of a closed range.

    Parameters
    ----------
    direction
        Of a lower end, which is rounded down, and of an upper end, which is rounded up.

    Returns
    -------
    float
        Infinite beyond the largest float.

    Examples
    --------
    >>> third = Fraction(1, 3)
    >>> outwards(third, -1) < third < outwards(third, 1)
    True
    >>> outwards(Fraction(1, 2), 1)
    0.5
    """
    try:
        nearest = float(value)
    except OverflowError:
        nearest = math.inf if value > 0 else -math.inf
    return math.nextafter(nearest, direction * math.inf) if direction * nearest < direction * value else nearest


def concatenate(parts: list[Balls]) -> Balls:
    """Join balls end to end.

    Parameters
    ----------
    parts
        Each of shape (n_k, ...). One at least.

    Returns
    -------
    Balls, shape (sum of n_k, ...)

    Examples
    --------
    >>> joined = concatenate([Balls.exact([1.0]), Balls.exact([2.0, 1.0]) / Balls.exact([4.0, 3.0])])
    >>> joined.mid.round(3)
    array([1.   , 0.5  , 0.333])
    >>> joined.rad > 0
    array([False,  True,  True])
    """
    return Balls(np.concatenate([p.mid for p in parts]), np.concatenate([p.rad for p in parts]))


def gram(factors: Array) -> Balls:
    """Return ``F F'`` for a stack of matrices ``F``.

    The exact product is positive semidefinite whatever the floats in ``F`` are: that is how a certificate gets a
    semidefinite multiplier without trusting any eigenvalue routine.

    Parameters
    ----------
    factors
        Shape (count, k, r).

    Returns
    -------
    Balls, shape (count, k, k)

    Examples
    --------
    >>> product = gram(np.array([[[0.1], [3.0]]]))
    >>> product.mid[0].round(3)
    array([[0.01, 0.3 ],
           [0.3 , 9.  ]])
    >>> error = Fraction(product.mid[0, 0, 0]) - Fraction(0.1) ** 2
    >>> 0 < abs(error) <= Fraction(product.rad[0, 0, 0])
    True
    """
    absolute = np.abs(factors)
    transposed = np.swapaxes(factors, -1, -2)
    terms = factors.shape[-1] + 1
    rounding = terms * EPSILON * (absolute @ np.swapaxes(absolute, -1, -2)) + terms * TINY
    return Balls(factors @ transposed, rounding * (1 + (terms + 8) * EPSILON))
