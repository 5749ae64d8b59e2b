"""Affine arithmetic: an unknown is a number, plus its share of each symbol in [-1, 1], plus a radius of its own.

A form is a row of floats: centre, radius, lower end, upper end, and a slope for each symbol. It encloses x in two ways:
x differs from ``centre + slopes @ symbols`` by at most the radius, and x lies between the ends. The first keeps how x
depends on what the symbols stand for, the second holds where that dependence is lost: across a sign, say, or where
nothing but a bound is known. A form of which nothing is known has an infinite radius and infinite ends.

Every operation writes a form that encloses the exact result, rounding errors included: as in
:mod:`relaxations.algebra.ball_arithmetic`, one operation errs by at most ``EPSILON`` times its result, and ``TINY``
covers underflow. Functions of one form are in :mod:`relaxations.algebra.affine_functions`.

All are compiled (numba), and work on the rows of one array.

References
----------
L. H. de Figueiredo and J. Stolfi, "Affine arithmetic: concepts and applications", Numerical Algorithms 37 (2004).
S. M. Rump, "Verification methods: rigorous results using floating-point arithmetic", Acta Numerica 19 (2010).
"""

from __future__ import annotations

import math

import numpy as np

from relaxations.algebra.arrays import Array, Index
from relaxations.algebra.ball_arithmetic import EPSILON, TINY
from relaxations.algebra.compiled import compiled

CENTRE, RADIUS, LOW, HIGH, SLOPES = range(5)

NO_PRODUCTS: Index = np.zeros((0, 0), dtype=np.int64)
"""What is of second order goes into the radius."""


@compiled
def nothing_known(forms: Array, to: int) -> None:
    """Write the form that encloses every real number."""
    forms[to, CENTRE] = 0.0
    forms[to, RADIUS] = math.inf
    forms[to, LOW] = -math.inf
    forms[to, HIGH] = math.inf
    for k in range(SLOPES, forms.shape[1]):
        forms[to, k] = 0.0


@compiled
def interval(forms: Array, to: int, centre: float, radius: float) -> None:
    """Write the form of a number within a radius of another."""
    forms[to, CENTRE] = centre
    forms[to, RADIUS] = radius
    forms[to, LOW] = math.nextafter(centre - radius, -math.inf) if radius > 0.0 else centre
    forms[to, HIGH] = math.nextafter(centre + radius, math.inf) if radius > 0.0 else centre
    for k in range(SLOPES, forms.shape[1]):
        forms[to, k] = 0.0


@compiled
def between(forms: Array, to: int, low: float, high: float) -> None:
    """Write the form of a number between two ends."""
    if not (math.isfinite(low) and math.isfinite(high)):
        nothing_known(forms, to)
    else:
        centre = 0.5 * low + 0.5 * high
        interval(forms, to, centre, max(high - centre, centre - low) * (1.0 + 4.0 * EPSILON) + TINY)
    forms[to, LOW] = low
    forms[to, HIGH] = high


@compiled
def copy(target: Array, to: int, forms: Array, a: int) -> None:
    """Write a form into another array, as far as that is wide."""
    for k in range(target.shape[1]):
        target[to, k] = forms[a, k]


@compiled
def _size_of_slopes(forms: Array, a: int) -> float:
    """Return the sum of the magnitudes of the slopes, four sums at once: a processor need not wait for each in turn."""
    one, other, third, fourth, width = 0.0, 0.0, 0.0, 0.0, forms.shape[1]
    last = width - (width - SLOPES) % 4
    for k in range(SLOPES, last, 4):
        one += abs(forms[a, k])
        other += abs(forms[a, k + 1])
        third += abs(forms[a, k + 2])
        fourth += abs(forms[a, k + 3])
    for k in range(last, width):
        one += abs(forms[a, k])
    return float((one + other) + (third + fourth))


@compiled
def spread(forms: Array, a: int) -> float:
    """Return an upper bound of the distance from the centre."""
    return float((_size_of_slopes(forms, a) + forms[a, RADIUS]) * (1.0 + forms.shape[1] * EPSILON))


@compiled
def tidied(forms: Array, to: int) -> None:
    """Narrow both enclosures of a result by each other."""
    if not math.isfinite(forms[to, CENTRE] + forms[to, RADIUS]):
        low, high = forms[to, LOW], forms[to, HIGH]
        between(forms, to, -math.inf if math.isnan(low) else low, math.inf if math.isnan(high) else high)
        return
    reach = spread(forms, to)
    centre = forms[to, CENTRE]
    if not forms[to, LOW] >= centre - reach:
        forms[to, LOW] = math.nextafter(centre - reach, -math.inf)
    if not forms[to, HIGH] <= centre + reach:
        forms[to, HIGH] = math.nextafter(centre + reach, math.inf)
    # Slopes beside a radius as wide as the whole range tell nothing.
    low, high = forms[to, LOW], forms[to, HIGH]
    if forms[to, RADIUS] > 0.5 * (high - low) and low <= high:
        between(forms, to, low, high)


@compiled
def linear(forms: Array, to: int, a: int, factor: float, constant: float, error: float) -> None:
    """Write ``factor a + constant``, within an error; the ends follow from the result alone."""
    low = min(factor * forms[a, LOW], factor * forms[a, HIGH])
    high = max(factor * forms[a, LOW], factor * forms[a, HIGH])
    for k in range(SLOPES, forms.shape[1]):
        forms[to, k] = factor * forms[a, k]
    size = abs(factor * forms[a, CENTRE]) + abs(constant) + _size_of_slopes(forms, to)
    forms[to, CENTRE] = factor * forms[a, CENTRE] + constant
    if constant == 0.0 and error == 0.0 and abs(factor) == 1.0:  # nothing is rounded: x - x stays zero
        forms[to, RADIUS], forms[to, LOW], forms[to, HIGH] = forms[a, RADIUS], low, high
        return
    rounding = (4.0 + forms.shape[1] * EPSILON) * EPSILON * size + forms.shape[1] * TINY
    forms[to, RADIUS] = (abs(factor) * forms[a, RADIUS] + error + rounding) * (1.0 + 8.0 * EPSILON)
    # Each end has its own rounding: the other one may be infinite.
    below = error + 4.0 * EPSILON * (abs(low) + abs(constant)) + TINY
    above = error + 4.0 * EPSILON * (abs(high) + abs(constant)) + TINY
    forms[to, LOW] = math.nextafter(low + constant - below, -math.inf)
    forms[to, HIGH] = math.nextafter(high + constant + above, math.inf)
    tidied(forms, to)


@compiled
def add(forms: Array, to: int, a: int, b: int, sign: float) -> None:
    """Write ``a + sign b``, for a sign of 1 or -1."""
    low_b, high_b = (forms[b, LOW], forms[b, HIGH]) if sign > 0 else (-forms[b, HIGH], -forms[b, LOW])
    low, high = forms[a, LOW] + low_b, forms[a, HIGH] + high_b
    # A sum of zero is exact: a sum of what is not negative is not negative.
    low = low if low == 0.0 else math.nextafter(low, -math.inf)
    high = high if high == 0.0 else math.nextafter(high, math.inf)
    radius = forms[a, RADIUS] + forms[b, RADIUS]
    forms[to, CENTRE] = forms[a, CENTRE] + sign * forms[b, CENTRE]
    for k in range(SLOPES, forms.shape[1]):
        forms[to, k] = forms[a, k] + sign * forms[b, k]
    size = abs(forms[to, CENTRE]) + _size_of_slopes(forms, to)
    forms[to, RADIUS] = (radius + EPSILON * size) * (1.0 + (8.0 + forms.shape[1]) * EPSILON)
    forms[to, LOW] = low
    forms[to, HIGH] = high
    tidied(forms, to)


@compiled
def _inner(forms: Array, a: int, b: int) -> tuple[float, float]:
    """Return the sum of the products of two forms' slopes, and that of their magnitudes, two of each at once."""
    one, other, size, more, width = 0.0, 0.0, 0.0, 0.0, forms.shape[1]
    last = width - (width - SLOPES) % 2
    for k in range(SLOPES, last, 2):
        first, second = forms[a, k] * forms[b, k], forms[a, k + 1] * forms[b, k + 1]
        one += first
        other += second
        size += abs(first)
        more += abs(second)
    for k in range(last, width):
        one += forms[a, k] * forms[b, k]
        size += abs(forms[a, k] * forms[b, k])
    return one + other, size + more


@compiled
def _product(a: float, b: float) -> float:
    """Return a product of ends, where zero times infinity is zero."""
    return 0.0 if a == 0.0 or b == 0.0 else a * b


@compiled
def multiply(forms: Array, to: int, a: int, b: int, products: Index) -> None:
    """Write ``a b`` to a place of its own. A square of a symbol is half as wide as it seems.

    Parameters
    ----------
    products
        Shape (n, n). For each two of the first n symbols, the smaller place first, in which column their product has a
        slope; -1: it goes into the radius. Of a symbol e with itself it is the slope of ``2 e e - 1``.
    """
    ends = (
        _product(forms[a, LOW], forms[b, LOW]),
        _product(forms[a, LOW], forms[b, HIGH]),
        _product(forms[a, HIGH], forms[b, LOW]),
        _product(forms[a, HIGH], forms[b, HIGH]),
    )
    low = math.nextafter(min(ends) * (1.0 - math.copysign(EPSILON, min(ends))), -math.inf)
    high = math.nextafter(max(ends) * (1.0 + math.copysign(EPSILON, max(ends))), math.inf)
    if forms[a, LOW] >= 0.0 and forms[b, LOW] >= 0.0:
        low = max(low, 0.0)
    mid_a, mid_b = forms[a, CENTRE], forms[b, CENTRE]
    radius_a, radius_b = forms[a, RADIUS], forms[b, RADIUS]
    size_a, size_b = spread(forms, a), spread(forms, b)
    around = size_a * size_b
    for k in range(SLOPES, forms.shape[1]):
        forms[to, k] = mid_a * forms[b, k] + mid_b * forms[a, k]
    shift, square = _inner(forms, a, b)
    forms[to, CENTRE] = mid_a * mid_b + 0.5 * shift
    size = abs(mid_a) * size_b + abs(mid_b) * size_a
    known = 0.5 * square
    for j in range(products.shape[0]):
        own_a, own_b = forms[a, SLOPES + j], forms[b, SLOPES + j]
        if own_a == 0.0 and own_b == 0.0:
            continue
        for k in range(j, products.shape[0]):
            column = products[j, k]
            if column < 0:
                continue
            if j == k:
                one, other = 0.5 * own_a * own_b, 0.0
            else:
                one, other = own_a * forms[b, SLOPES + k], own_b * forms[a, SLOPES + k]
            forms[to, column] += one + other
            known += abs(one) + abs(other)
    size += abs(mid_a * mid_b) + known
    rounding = (8.0 + 4.0 * forms.shape[1]) * EPSILON * (size + around) + 4.0 * forms.shape[1] * TINY
    radius = abs(mid_a) * radius_b + abs(mid_b) * radius_a + max(around - known, 0.0)
    forms[to, RADIUS] = (radius + rounding) * (1.0 + 16.0 * EPSILON)
    forms[to, LOW] = low
    forms[to, HIGH] = high
    tidied(forms, to)


@compiled
def hull(forms: Array, to: int, a: int, b: int) -> None:
    """Write a form that encloses what either of two forms encloses."""
    low, high = min(forms[a, LOW], forms[b, LOW]), max(forms[a, HIGH], forms[b, HIGH])
    radius = max(forms[a, RADIUS], forms[b, RADIUS])
    centre = 0.5 * forms[a, CENTRE] + 0.5 * forms[b, CENTRE]
    apart, size = 0.5 * abs(forms[a, CENTRE] - forms[b, CENTRE]), abs(forms[a, CENTRE]) + abs(forms[b, CENTRE])
    for k in range(SLOPES, forms.shape[1]):
        one, other = forms[a, k], forms[b, k]
        apart += 0.5 * abs(one - other)
        size += abs(one) + abs(other)
        forms[to, k] = 0.5 * one + 0.5 * other
    forms[to, CENTRE] = centre
    forms[to, RADIUS] = (radius + apart + (4.0 + forms.shape[1]) * EPSILON * size) * (1.0 + 8.0 * EPSILON) + TINY
    forms[to, LOW] = low
    forms[to, HIGH] = high
    tidied(forms, to)
