"""Intervals of real numbers, many at once, every operation rounded outwards.

`relaxations.algebra.ball_arithmetic` holds numbers that are all but known; here the widths are the point, and a ball
would lose half of each where zero is an end.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["Array", "Enclosure", "Mask"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Enclosure:
    """Arrays of lower and upper ends, of equal shape; ends may be infinite.

    Examples
    --------
    >>> third = Enclosure.of(1.0) / 3.0
    >>> bool(third.lower < third.upper)
    True
    """

    lower: Array
    upper: Array

    @staticmethod
    def of(lower: ArrayLike, upper: ArrayLike | None = None) -> Enclosure:
        """Return numbers taken at face value, or the intervals between two."""
        ends = np.broadcast_arrays(lower, lower if upper is None else upper)
        return Enclosure(*(np.asarray(end, dtype=np.float64) for end in ends))

    @staticmethod
    def within(radius: ArrayLike) -> Enclosure:
        """Return the intervals from minus the radius to the radius."""
        size = np.asarray(radius, dtype=np.float64)
        return Enclosure(-size, size)

    def __getitem__(self, index: Any) -> Enclosure:
        return Enclosure(self.lower[index], self.upper[index])

    def __neg__(self) -> Enclosure:
        return Enclosure(-self.upper, -self.lower)

    def __add__(self, other: Enclosure | ArrayLike) -> Enclosure:
        b = _enclosure(other)
        return Enclosure(_down(self.lower + b.lower), _up(self.upper + b.upper))

    def __sub__(self, other: Enclosure | ArrayLike) -> Enclosure:
        return self + (-_enclosure(other))

    def __mul__(self, other: Enclosure | ArrayLike) -> Enclosure:
        b = _enclosure(other)
        with np.errstate(invalid="ignore"):
            products = [x * y for x in (self.lower, self.upper) for y in (b.lower, b.upper)]
        # Zero times an infinite end: the factor is zero, whatever the other one is.
        ends = [np.where(np.isnan(p), 0.0, p) for p in products]
        return Enclosure(_down(np.minimum.reduce(ends)), _up(np.maximum.reduce(ends)))

    def __truediv__(self, other: float) -> Enclosure:
        """Divide by one positive number."""
        return Enclosure(_down(self.lower / other), _up(self.upper / other))

    def square(self) -> Enclosure:
        """Return the squares."""
        largest = np.maximum(np.abs(self.lower), np.abs(self.upper))
        least = np.where((self.lower <= 0) & (self.upper >= 0), 0.0, np.minimum(np.abs(self.lower), np.abs(self.upper)))
        return Enclosure(np.maximum(_down(least * least), 0.0), _up(largest * largest))

    def signed_square(self) -> Enclosure:
        """Return ``x |x|``, which rises with x."""
        return Enclosure(_down(self.lower * np.abs(self.lower)), _up(self.upper * np.abs(self.upper)))

    def meet(self, other: Enclosure) -> Enclosure:
        """Return what both hold; empty where the ends cross."""
        return Enclosure(np.maximum(self.lower, other.lower), np.minimum(self.upper, other.upper))

    def hull(self, other: Enclosure) -> Enclosure:
        """Return the least interval that holds both."""
        return Enclosure(np.minimum(self.lower, other.lower), np.maximum(self.upper, other.upper))

    def where(self, condition: Mask, other: Enclosure) -> Enclosure:
        """Return these where the condition holds, the other ones elsewhere."""
        return Enclosure(np.where(condition, self.lower, other.lower), np.where(condition, self.upper, other.upper))

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


def _enclosure(value: Enclosure | ArrayLike) -> Enclosure:
    return value if isinstance(value, Enclosure) else Enclosure.of(value)


def _down(values: Array) -> Array:
    return np.nextafter(values, -np.inf)


def _up(values: Array) -> Array:
    return np.nextafter(values, np.inf)
