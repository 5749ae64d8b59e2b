"""Ranges of numbers that are not known exactly: a lower and an upper bound, rounded outwards.

A sensor propagates ranges where a sample was lost, and over the trained range of its inputs. Sums and products are in
ball arithmetic (`relaxations.algebra.ball_arithmetic`). For tanh and exp the error of the library is taken to be at
most four units in the last place, which the libraries of C and numpy stay below.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from relaxations.algebra.arrays import Array
from relaxations.algebra.ball_arithmetic import EPSILON, TINY, Balls

__all__ = ["Range"]

LIBRARY = 4.0 * EPSILON  # relative error of tanh and exp


@dataclass(frozen=True, eq=False)
class Range:
    """Bounds of numbers, of one shape.

    Parameters
    ----------
    lower, upper
        Same shape; lower does not exceed upper.
    """

    lower: Array
    upper: Array

    @staticmethod
    def exact(values: ArrayLike) -> Range:
        """Return the range of numbers that are known."""
        array = np.asarray(values, dtype=np.float64)
        return Range(array, array)

    @staticmethod
    def of(balls: Balls) -> Range:
        """Return the bounds of balls; those of radius zero stay exact."""
        known = balls.rad == 0
        return Range(np.where(known, balls.mid, balls.lower), np.where(known, balls.mid, balls.upper))

    @property
    def balls(self) -> Balls:
        """Balls that contain the range."""
        mid = 0.5 * self.lower + 0.5 * self.upper
        rad = np.maximum(self.upper - mid, mid - self.lower)
        return Balls(mid, np.where(rad > 0, rad * (1.0 + EPSILON) + TINY, 0.0))

    @property
    def width(self) -> Array:
        """Upper minus lower bound."""
        return self.upper - self.lower

    def __getitem__(self, index: Any) -> Range:
        return Range(np.asarray(self.lower[index]), np.asarray(self.upper[index]))

    def hull(self, other: Range) -> Range:
        """Return the least range that contains both."""
        return Range(np.minimum(self.lower, other.lower), np.maximum(self.upper, other.upper))

    def meet(self, other: Range) -> Range:
        """Return what two ranges of the same numbers have in common; their hull where rounding parts them."""
        lower, upper = np.maximum(self.lower, other.lower), np.minimum(self.upper, other.upper)
        joined = self.hull(other)
        return Range(np.where(lower <= upper, lower, joined.lower), np.where(lower <= upper, upper, joined.upper))

    def tanh(self) -> Range:
        """Return the hyperbolic tangents.

        Examples
        --------
        >>> Range.exact([0.0]).tanh().width
        array([0.])
        """
        lower, upper = (np.tanh(end) for end in (self.lower, self.upper))
        slack = [LIBRARY * np.abs(end) for end in (lower, upper)]
        return Range(np.maximum(lower - slack[0], -1.0), np.minimum(upper + slack[1], 1.0))

    def exp(self) -> Range:
        """Return the exponentials."""
        return Range(np.exp(self.lower) * (1.0 - LIBRARY), np.exp(self.upper) * (1.0 + LIBRARY))

    def square(self) -> Range:
        """Return the squares."""
        ends = np.stack([self.lower**2, self.upper**2])
        across = (self.lower < 0) & (self.upper > 0)
        return Range(np.where(across, 0.0, ends.min(axis=0) * (1.0 - EPSILON)), ends.max(axis=0) * (1.0 + EPSILON))


def joined(ranges: Sequence[Range]) -> Range:
    """Return ranges of vectors as one, along the first axis."""
    return Range(np.concatenate([r.lower for r in ranges]), np.concatenate([r.upper for r in ranges]))
