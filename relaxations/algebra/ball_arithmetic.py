"""Ball arithmetic on arrays: every number is a float64 midpoint with a radius that is an upper bound of its error.

Rounding errors, with the unit roundoff ``u = 2**-53``:

- one operation: ``|fl(a op b) - (a op b)| <= u |fl(a op b)|``, plus the smallest normal number for underflow;
- a sum of n terms in any order: ``(n - 1) u / (1 - (n - 1) u)`` times the sum of absolute values.

The code uses ``EPSILON = 2 u`` in place of u. The factor of two covers the rounding errors of the radius itself.

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

from relaxations.algebra.arrays import Array, Index

EPSILON = 2.0**-52
TINY = 2.0**-1022  # the smallest normal number: a bound of the error of an underflow
_UP = 1.0 + 8 * EPSILON  # covers the rounding errors in the computation of a radius


@dataclass(frozen=True)
class Balls:
    """An array of intervals ``[mid - rad, mid + rad]``, each of which contains the exact value.

    Parameters
    ----------
    mid, rad
        Same shape; ``rad >= 0``.

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
        """Return balls of radius zero around floats."""
        mid = np.asarray(values, dtype=np.float64)
        return Balls(mid, np.zeros_like(mid))

    @staticmethod
    def enclose(value: Fraction) -> Balls:
        """Return the ball around a rational number; its radius is zero if a float equals the number."""
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
        # Products with zero and with powers of two are exact unless they underflow. So data that are only copied or
        # negated stay exact.
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
        # TINY covers an underflow of ``|mid| * other.rad``.
        rad = (self.rad + np.abs(mid) * other.rad + TINY * (other.rad > 0)) / (least * (1 - 4 * EPSILON))
        return Balls(mid, (rad + EPSILON * np.abs(mid) + TINY) * _UP)

    def __pow__(self, exponent: int) -> Balls:
        result = Balls.exact(np.ones_like(self.mid))
        for _ in range(exponent):
            result = result * self
        return result

    def scaled(self, powers_of_two: Array) -> Balls:
        """Return the product with powers of two, which is exact unless it underflows."""
        mid = self.mid * powers_of_two
        rounded = (self.rad > 0) | ((np.abs(mid) < TINY) & (self.mid != 0))
        return Balls(mid, self.rad * np.abs(powers_of_two) + TINY * rounded)

    def magnitude(self) -> Array:
        """Return an upper bound of the absolute value, elementwise."""
        return (np.abs(self.mid) + self.rad) * _UP

    @property
    def lower(self) -> Array:
        """Return a lower bound, rounded down."""
        return np.nextafter(self.mid - self.rad, -np.inf)

    @property
    def upper(self) -> Array:
        """Return an upper bound, rounded up."""
        return np.nextafter(self.mid + self.rad, np.inf)

    def positive_part(self) -> Balls:
        """Return what ``max(0, x)`` may be, elementwise."""
        low, high = np.maximum(self.lower, 0.0), np.maximum(self.upper, 0.0)
        half = np.nextafter(0.5 * (high - low), np.inf)
        rounded = EPSILON * high  # of the middle, and of the differences
        hull = Balls(0.5 * low + 0.5 * high, half + 4 * rounded + TINY)
        keep, zero = self.lower >= 0, self.upper <= 0
        return Balls(
            np.where(zero, 0.0, np.where(keep, self.mid, hull.mid)),
            np.where(zero, 0.0, np.where(keep, self.rad, hull.rad)),
        )

    def sign(self) -> Balls:
        """Return what the sign of x may be, elementwise: anything from -1 to 1 where x may be zero."""
        side = np.where(self.lower > 0, 1.0, np.where(self.upper < 0, -1.0, 0.0))
        return Balls(side, np.where(side == 0, 1.0, 0.0))

    def segment_sum(self, segment: Index, n_segments: int) -> Balls:
        """Return the sums of the entries with the same ``segment`` number, one ball for each of ``n_segments``."""
        mid = np.asarray(np.bincount(segment, self.mid, n_segments), dtype=np.float64)
        absolute = np.bincount(segment, np.abs(self.mid), n_segments)
        rad = np.bincount(segment, self.rad, n_segments)
        count = np.bincount(segment, minlength=n_segments)
        # A sum of one term is exact.
        rounding = np.where(count > 1, count * EPSILON * absolute, 0.0)
        return Balls(mid, (rad + rounding) * (1 + (count + 8) * EPSILON))


def _is_trivial(values: Array) -> NDArray[np.bool_]:
    """Return whether each value is zero or a power of two, up to its sign."""
    mantissa, _ = np.frexp(values)
    return np.asarray((np.abs(mantissa) == 0.5) | (values == 0))


def outwards(value: Fraction, direction: int) -> float:
    """Return a bound as a float: rounded down for direction -1, rounded up for direction 1.

    >>> third = Fraction(1, 3)
    >>> outwards(third, -1) < third < outwards(third, 1)
    True
    """
    try:
        nearest = float(value)
    except OverflowError:
        nearest = math.inf if value > 0 else -math.inf
    return math.nextafter(nearest, direction * math.inf) if direction * nearest < direction * value else nearest


def concatenate(parts: list[Balls]) -> Balls:
    """Return the balls of all parts along the first axis; at least one part."""
    return Balls(np.concatenate([p.mid for p in parts]), np.concatenate([p.rad for p in parts]))


def gram(factors: Array) -> Balls:
    """Return ``F F'`` for each matrix F of a stack of shape (count, k, r); the result has shape (count, k, k).

    The exact product is positive semidefinite for any floats in F. A certificate uses it as a semidefinite multiplier
    and needs no eigenvalue computation.
    """
    absolute = np.abs(factors)
    transposed = np.swapaxes(factors, -1, -2)
    terms = factors.shape[-1] + 1
    rounding = terms * EPSILON * (absolute @ np.swapaxes(absolute, -1, -2)) + terms * TINY
    return Balls(factors @ transposed, rounding * (1 + (terms + 8) * EPSILON))
