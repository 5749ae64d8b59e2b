"""Interval arithmetic on arrays of floats: every operation rounds outwards.

An end beyond the largest float is infinite. `relaxations.algebra.ball_arithmetic` is for numbers with a small error.
Wide intervals, intervals with an end at zero and intervals with an infinite end need both ends, as here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from relaxations.algebra.arrays import Array, Mask

__all__ = ["Intervals"]


@dataclass(frozen=True)
class Intervals:
    """Arrays of lower and upper ends, of equal shape; ends may be infinite.

    Examples
    --------
    >>> third = Intervals.of(1.0) / 3.0
    >>> bool(third.lower < third.upper)
    True
    """

    lower: Array
    upper: Array

    @staticmethod
    def of(lower: ArrayLike, upper: ArrayLike | None = None) -> Intervals:
        """Return the intervals between two ends, or those of exact numbers."""
        ends = np.broadcast_arrays(lower, lower if upper is None else upper)
        return Intervals(*(np.asarray(end, dtype=np.float64) for end in ends))

    @staticmethod
    def within(radius: ArrayLike) -> Intervals:
        """Return the intervals from minus the radius to the radius."""
        size = np.asarray(radius, dtype=np.float64)
        return Intervals(-size, size)

    def __getitem__(self, index: Any) -> Intervals:
        return Intervals(self.lower[index], self.upper[index])

    def __neg__(self) -> Intervals:
        return Intervals(-self.upper, -self.lower)

    def __add__(self, other: Intervals | ArrayLike) -> Intervals:
        b = _intervals(other)
        with np.errstate(over="ignore"):
            return Intervals(_down(self.lower + b.lower), _up(self.upper + b.upper))

    def __sub__(self, other: Intervals | ArrayLike) -> Intervals:
        return self + (-_intervals(other))

    def __mul__(self, other: Intervals | ArrayLike) -> Intervals:
        b = _intervals(other)
        with np.errstate(invalid="ignore", over="ignore"):
            products = [x * y for x in (self.lower, self.upper) for y in (b.lower, b.upper)]
        # Zero times an infinite end is zero.
        ends = [np.where(np.isnan(p), 0.0, p) for p in products]
        return Intervals(_down(np.minimum.reduce(ends)), _up(np.maximum.reduce(ends)))

    def __truediv__(self, other: float) -> Intervals:
        """Divide by one positive number."""
        return Intervals(_down(self.lower / other), _up(self.upper / other))

    def square(self) -> Intervals:
        """Return the squares."""
        largest = np.maximum(np.abs(self.lower), np.abs(self.upper))
        least = np.where((self.lower <= 0) & (self.upper >= 0), 0.0, np.minimum(np.abs(self.lower), np.abs(self.upper)))
        with np.errstate(over="ignore"):
            return Intervals(np.maximum(_down(least * least), 0.0), _up(largest * largest))

    def meet(self, other: Intervals) -> Intervals:
        """Return the intersection; empty where the ends cross."""
        return Intervals(np.maximum(self.lower, other.lower), np.minimum(self.upper, other.upper))

    def hull(self, other: Intervals) -> Intervals:
        """Return the least interval that holds both."""
        return Intervals(np.minimum(self.lower, other.lower), np.maximum(self.upper, other.upper))

    def where(self, condition: Mask, other: Intervals) -> Intervals:
        """Return these where the condition holds, the other ones elsewhere."""
        return Intervals(np.where(condition, self.lower, other.lower), np.where(condition, self.upper, other.upper))

    @property
    def magnitude(self) -> Array:
        """Return the largest absolute values."""
        return np.maximum(np.abs(self.lower), np.abs(self.upper))

    @property
    def width(self) -> Array:
        """Return the widths, rounded up."""
        return _up(self.upper - self.lower)

    @property
    def empty(self) -> bool:
        """Tell whether any interval is empty."""
        return bool((self.lower > self.upper).any())


def _intervals(value: Intervals | ArrayLike) -> Intervals:
    return value if isinstance(value, Intervals) else Intervals.of(value)


def _down(values: Array) -> Array:
    return np.nextafter(values, -np.inf)


def _up(values: Array) -> Array:
    return np.nextafter(values, np.inf)
