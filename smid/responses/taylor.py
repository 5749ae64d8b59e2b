"""Taylor models of second order: a quadratic polynomial of a few variables, and a bound of all that it leaves out.

Interval enclosures forget that numbers depend on the same parameters, and grow along a recursion. A Taylor model keeps
value, slopes and curvature, so that only terms of third order, and rounding, are added up as magnitudes.

References
----------
K. Makino and M. Berz, "Taylor models and other validated functional inclusion methods", International Journal of Pure
and Applied Mathematics 4 (2003) 379-456.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.algebra.ball_arithmetic import EPSILON, TINY
from relaxations.algebra.polynomial import Polynomials

_UP = 1 + 64 * EPSILON  # covers the rounding of a magnitude


@dataclass(frozen=True)
class Taylor:
    """An array of functions ``value + slopes @ t + t' curvature t`` up to ``error``, for all t in [-1, 1]^n.

    Parameters
    ----------
    value, error
        Shape (...).
    slopes, curvature
        Shapes (n, ...) and (n, n, ...).

    Examples
    --------
    >>> t = Taylor.linear(2.0, np.array([0.5]))  # from 1.5 to 2.5
    >>> square = t * t
    >>> float(square.value), square.slopes, square.curvature, float(square.error) < 1e-13
    (4.0, array([2.]), array([[0.25]]), True)
    """

    value: Array
    slopes: Array
    curvature: Array
    error: Array

    @staticmethod
    def linear(value: Array | float, slopes: Array, error: Array | float = 0.0) -> Taylor:
        """Return the models without curvature; slopes of shape (n, ...)."""
        own = np.asarray(value, dtype=np.float64)
        curvature = np.zeros((len(slopes), *slopes.shape))
        return Taylor(own, slopes, curvature, np.zeros_like(own) + error)

    @property
    def size(self) -> Array:
        """Return an upper bound of the magnitude."""
        return (np.abs(self.value) + self._linear + self._quadratic + self.error) * _UP

    @property
    def _linear(self) -> Array:
        return np.asarray(np.abs(self.slopes).sum(axis=0))

    @property
    def _quadratic(self) -> Array:
        return np.asarray(np.abs(self.curvature).sum(axis=(0, 1)))

    def __getitem__(self, index: Any) -> Taylor:
        own, every = (index if isinstance(index, tuple) else (index,)), slice(None)
        parts = (self.value[own], self.slopes[(every, *own)], self.curvature[(every, every, *own)], self.error[own])
        return Taylor(*parts)

    def __neg__(self) -> Taylor:
        return Taylor(-self.value, -self.slopes, -self.curvature, self.error)

    def __add__(self, other: Taylor) -> Taylor:
        error = self.error + other.error + 2 * EPSILON * (self.size + other.size)
        parts = (self.value + other.value, self.slopes + other.slopes, self.curvature + other.curvature, error * _UP)
        return Taylor(*parts)

    def __sub__(self, other: Taylor) -> Taylor:
        return self + (-other)

    def __mul__(self, other: Taylor) -> Taylor:
        cross = self.slopes[:, None] * other.slopes[None]
        third = self._linear * other._quadratic + self._quadratic * other._linear + self._quadratic * other._quadratic
        rest = self.size * other.error + other.size * self.error
        return Taylor(
            self.value * other.value,
            self.value * other.slopes + self.slopes * other.value,
            self.value * other.curvature + self.curvature * other.value + 0.5 * (cross + np.swapaxes(cross, 0, 1)),
            (third + rest + 16 * EPSILON * self.size * other.size + TINY * ((self.size > 0) & (other.size > 0))) * _UP,
        )

    def __truediv__(self, other: Taylor) -> Taylor:
        """Divide; the error is infinite where the divisor may be zero."""
        # 1 / (c (1 + x)) = (1 - x + x^2 - x^3 / (1 + x)) / c
        c = np.where(other.value == 0, 1.0, other.value)
        x = other.scaled(1 / c, EPSILON)
        x = Taylor(np.zeros_like(c), x.slopes, x.curvature, x.error)
        possible = (other.value != 0) & (x.size < 1)
        reach = np.where(possible, x.size, 0.0)
        inverse = x * x - x
        rest = reach**3 / (1 - reach) + 16 * EPSILON * (1 + reach)
        inverse = Taylor(1 + inverse.value, inverse.slopes, inverse.curvature, (inverse.error + rest) * _UP)
        found = (self * inverse).scaled(1 / c, EPSILON)
        return Taylor(found.value, found.slopes, found.curvature, np.where(possible, found.error, np.inf))

    def scaled(self, factors: Array, relative: float | Array = 0.0) -> Taylor:
        """Return the product with numbers, which are known up to a relative error."""
        rounding = (4 * EPSILON + relative) * self.size * np.abs(factors)
        error = (self.error * np.abs(factors) + rounding + TINY * ((self.size > 0) & (factors != 0))) * _UP
        return Taylor(self.value * factors, self.slopes * factors, self.curvature * factors, error)

    def sum(self, axis: int) -> Taylor:
        """Return the sum along an axis that is counted from the end."""
        count = self.value.shape[axis]
        error = self.error.sum(axis=axis) + 2 * count * EPSILON * self.size.sum(axis=axis)
        value, slopes, curvature = (part.sum(axis=axis) for part in (self.value, self.slopes, self.curvature))
        return Taylor(value, slopes, curvature, error * (1 + (count + 8) * EPSILON))


def joined(models: Sequence[Taylor], axis: int = -1) -> Taylor:
    """Return models one after the other along an axis that is counted from the end."""
    names = ("value", "slopes", "curvature", "error")
    return Taylor(*(np.concatenate([getattr(m, name) for m in models], axis) for name in names))


def evaluate(polynomials: Polynomials, point: Sequence[Taylor], n: int) -> Taylor:
    """Return polynomials of numbers that are models of n variables; the last axis counts the polynomials."""
    none = np.zeros(n)
    rows: list[Taylor] = []
    for terms in polynomials.terms():
        row = Taylor.linear(0.0, none)
        for mid, rad, variables in terms:
            term = Taylor.linear(mid, none, rad)
            for v in variables:
                term = term * point[v]
            row = row + term
        rows.append(row[None])
    return joined(rows)
