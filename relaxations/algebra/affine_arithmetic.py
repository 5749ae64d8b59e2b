"""Affine arithmetic: an unknown is a number, plus its share of each symbol in [-1, 1], plus a radius of its own.

A form is a row of floats: centre, radius, lower end, upper end, and a slope for each symbol. It encloses x in two ways:
x differs from ``centre + slopes @ symbols`` by at most the radius, and x lies between the ends. The first keeps how x
depends on what the symbols stand for, the second holds where that dependence is lost: across a sign, say, or where
nothing but a bound is known. A form of which nothing is known has an infinite radius and infinite ends.

Every operation writes a form that encloses the exact result, rounding errors included: as in
:mod:`relaxations.algebra.ball_arithmetic`, one operation errs by at most ``EPSILON`` times its result, and ``TINY``
covers underflow. The functions of the C library are taken to err by at most ``LIBRARY`` times their result; a checker
has enclosures of its own.

The functions are compiled (numba), and work on the rows of one array.

References
----------
L. H. de Figueiredo and J. Stolfi, "Affine arithmetic: concepts and applications", Numerical Algorithms 37 (2004).
S. M. Rump, "Verification methods: rigorous results using floating-point arithmetic", Acta Numerica 19 (2010).
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable
from enum import IntEnum
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import numpy as np

from relaxations.algebra.arrays import Array, Index
from relaxations.algebra.ball_arithmetic import EPSILON, TINY

CENTRE, RADIUS, LOW, HIGH, SLOPES = range(5)
LIBRARY = 8 * EPSILON

NO_PRODUCTS: Index = np.zeros((0, 0), dtype=np.int64)
"""What is of second order goes into the radius."""

_Function = TypeVar("_Function", bound=Callable[..., object])


# Numba keeps the code of a function until the function's own file changes, whatever becomes of the functions here that
# it calls. So what is kept lies in a folder named after the content of this file, of the one with its constants, and of
# all others with functions that are called.
_FILES = (Path(__file__), Path(__file__).with_name("ball_arithmetic.py"))


def compiling(*files: str) -> Callable[[_Function], _Function]:
    """Return a decorator that makes machine code of a function; a division by zero gives an infinite result.

    Parameters
    ----------
    files
        Those with functions that the function calls, beside this one and its own: a change elsewhere would not be
        noticed.
    """
    content = hashlib.sha256(b"".join(file.read_bytes() for file in (*_FILES, *map(Path, files)))).hexdigest()[:16]

    def compiled(function: _Function) -> _Function:
        config: Any = numba.config
        given = config.CACHE_DIR
        config.CACHE_DIR = str(Path(given or Path(__file__).parent / "__pycache__") / content)
        try:
            code: Any = numba.njit(cache=True, error_model="numpy")(function)
            # Else each constant that a caller gives would have machine code of its own.
            template, unliteral = code.get_call_template, cast(Any, numba.types.unliteral)
            code.get_call_template = lambda args, kws: template([unliteral(arg) for arg in args], kws)
            return cast(_Function, code)
        finally:
            config.CACHE_DIR = given

    return compiled


compiled = compiling()


class Function(IntEnum):
    """Functions of one form."""

    RECIPROCAL = 0
    SQUARE = 1
    ROOT = 2
    EXP = 3
    LOG = 4
    SIN = 5
    COS = 6
    TANH = 7
    ATAN = 8
    SIGN = 9
    FLOOR = 10
    POWER = 11
    ABS = 12


# Numba takes members of an enumeration only by their values.
_RECIPROCAL, _SQUARE, _ROOT, _EXP, _LOG, _SIN, _COS, _TANH, _ATAN, _SIGN, _FLOOR, _POWER, _ABS = map(int, Function)
_LARGEST = 1.7976931348623157e308


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
def spread(forms: Array, a: int) -> float:
    """Return an upper bound of the distance from the centre."""
    total = 0.0
    for k in range(SLOPES, forms.shape[1]):
        total += abs(forms[a, k])
    return float((total + forms[a, RADIUS]) * (1.0 + forms.shape[1] * EPSILON))


@compiled
def _tidied(forms: Array, to: int) -> None:
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
    size = abs(factor * forms[a, CENTRE]) + abs(constant)
    for k in range(SLOPES, forms.shape[1]):
        forms[to, k] = factor * forms[a, k]
        size += abs(forms[to, k])
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
    _tidied(forms, to)


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
    size = abs(forms[to, CENTRE])
    for k in range(SLOPES, forms.shape[1]):
        forms[to, k] = forms[a, k] + sign * forms[b, k]
        size += abs(forms[to, k])
    forms[to, RADIUS] = (radius + EPSILON * size) * (1.0 + (8.0 + forms.shape[1]) * EPSILON)
    forms[to, LOW] = low
    forms[to, HIGH] = high
    _tidied(forms, to)


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
    around = spread(forms, a) * spread(forms, b)
    shift, square, size = 0.0, 0.0, 0.0
    for k in range(SLOPES, forms.shape[1]):
        slope_a, slope_b = forms[a, k], forms[b, k]
        shift += 0.5 * slope_a * slope_b
        square += 0.5 * abs(slope_a * slope_b)
        forms[to, k] = mid_a * slope_b + mid_b * slope_a
        size += abs(mid_a * slope_b) + abs(mid_b * slope_a)
    forms[to, CENTRE] = mid_a * mid_b + shift
    known = square
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
    _tidied(forms, to)


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
    _tidied(forms, to)


@compiled
def _value(function: int, x: float, exponent: float) -> float:
    """Return a function's value, within `LIBRARY` of its size."""
    if function == _RECIPROCAL:
        return 1.0 / x
    if function == _SQUARE:
        return x * x
    if function == _ROOT:
        return math.sqrt(x)
    if function == _EXP:
        return math.inf if x > 709.0 else math.exp(x)
    if function == _LOG:
        return math.log(x) if x > 0.0 else -math.inf
    if function == _SIN:
        return math.sin(x)
    if function == _COS:
        return math.cos(x)
    if function == _TANH:
        return math.tanh(x)
    if function == _ATAN:
        return math.atan(x)
    if x == 0.0:
        return math.inf if exponent < 0.0 else 0.0
    return math.pow(x, exponent)


@compiled
def _slope(function: int, x: float, exponent: float) -> float:
    """Return roughly the derivative."""
    if function == _RECIPROCAL:
        return -1.0 / (x * x)
    if function == _SQUARE:
        return 2.0 * x
    if function == _ROOT:
        return 0.5 / math.sqrt(x)
    if function == _EXP:
        return math.inf if x > 709.0 else math.exp(x)
    if function == _LOG:
        return 1.0 / x
    if function == _SIN:
        return math.cos(x)
    if function == _COS:
        return -math.sin(x)
    if function == _TANH:
        return 1.0 - math.tanh(x) ** 2
    if function == _ATAN:
        return 1.0 / (1.0 + x * x)
    return exponent * math.pow(x, exponent) / x  # of a difference of exponents, the rounding would count


@compiled
def _touching(function: int, slope: float, exponent: float) -> float:
    """Return roughly where the derivative of a convex or concave function has a value."""
    if function == _RECIPROCAL:
        return math.sqrt(-1.0 / slope)  # on the positive side
    if function == _SQUARE:
        return 0.5 * slope
    if function == _ROOT:
        return 0.25 / (slope * slope)
    if function == _EXP:
        return math.log(slope)
    if function == _LOG:
        return 1.0 / slope
    return math.pow(slope / exponent, 1.0 / (exponent - 1.0))


@compiled
def _chord(forms: Array, to: int, a: int, function: int, low: float, high: float, exponent: float) -> None:
    """Write a convex or concave function: between its chord and a tangent of about the same slope."""
    at_low, at_high = _value(function, low, exponent), _value(function, high, exponent)
    if not (high > low and math.isfinite(at_low) and math.isfinite(at_high)):
        slope, point = 0.0, 0.5 * low + 0.5 * high
    else:
        slope = (at_high - at_low) / (high - low)
        point = _touching(function, slope, exponent)
        if function == _RECIPROCAL and high < 0.0:
            point = -point
        if not low < point < high:
            point = 0.5 * low + 0.5 * high
    # Less the line, the function lies between the larger value at the ends and what the tangent leaves, or opposite.
    value, tangent = _value(function, point, exponent), _slope(function, point, exponent)
    if not math.isfinite(value + tangent):
        nothing_known(forms, to)
        return
    tilt = (abs(tangent - slope) + 8.0 * LIBRARY * (abs(tangent) + abs(slope))) * (high - low)
    one, other = at_low - slope * low, at_high - slope * high
    middle = value - slope * point
    below, above = min(one, other, middle) - tilt, max(one, other, middle) + tilt
    size = abs(at_low) + abs(at_high) + abs(value) + abs(slope) * (abs(low) + abs(high) + abs(point))
    error = 0.5 * (above - below) + 2.0 * LIBRARY * size + TINY
    if not math.isfinite(error):
        nothing_known(forms, to)
        return
    linear(forms, to, a, slope, 0.5 * below + 0.5 * above, error * (1.0 + 8.0 * EPSILON))


@compiled
def _expanded(forms: Array, to: int, a: int, function: int, low: float, high: float, bend: float) -> None:
    """Write a function whose second derivative is bounded: its tangent, within half the bend times the square."""
    middle = 0.5 * low + 0.5 * high
    half = max(high - middle, middle - low)
    value, slope = _value(function, middle, 0.0), _slope(function, middle, 0.0)
    size = abs(value) + (abs(slope) + 1.0) * (abs(middle) + half)
    error = (0.5 * bend * half * half + 4.0 * LIBRARY * size + TINY) * (1.0 + 8.0 * EPSILON)
    linear(forms, to, a, slope, value - slope * middle, error)


@compiled
def _narrowed(forms: Array, to: int, low: float, high: float) -> None:
    """Narrow a result to ends that are known within the error of the library."""
    if low != 0.0:  # what is not negative has an end that is not
        low -= LIBRARY * abs(low) + TINY
    high += LIBRARY * abs(high) + TINY
    if low > forms[to, LOW]:
        forms[to, LOW] = low
    if high < forms[to, HIGH]:
        forms[to, HIGH] = high
    _tidied(forms, to)


@compiled
def _bent_at_zero(forms: Array, to: int, a: int, left: float) -> None:
    """Write the larger of a number and ``left`` times it, for a ``left`` of 0 or -1."""
    low, high = forms[a, LOW], forms[a, HIGH]
    if low >= 0.0:
        copy(forms, to, forms, a)
        return
    most = max(left * low, high) if left else max(high, 0.0)
    if high <= 0.0:
        linear(forms, to, a, left, 0.0, 0.0)
    elif math.isfinite(high - low):
        # Less a line between both slopes, the rest lies between zero and its larger value at the ends.
        slope = (high - left * low) / (high - low)
        above = max((left - slope) * low, (1.0 - slope) * high) + 4.0 * EPSILON * (high - low) + TINY
        linear(forms, to, a, slope, 0.5 * above, 0.5 * above * (1.0 + 8.0 * EPSILON) + TINY)
    else:
        nothing_known(forms, to)
    forms[to, LOW] = max(forms[to, LOW], left * high if high < 0.0 else 0.0)
    forms[to, HIGH] = min(forms[to, HIGH], most)
    _tidied(forms, to)


@compiled
def larger(forms: Array, to: int, a: int, b: int) -> None:
    """Write the larger of two numbers: b, and what a is more."""
    low, high = max(forms[a, LOW], forms[b, LOW]), max(forms[a, HIGH], forms[b, HIGH])
    add(forms, to, a, b, -1.0)
    _bent_at_zero(forms, to, to, 0.0)
    add(forms, to, to, b, 1.0)
    forms[to, LOW] = max(forms[to, LOW], low)
    forms[to, HIGH] = min(forms[to, HIGH], high)
    _tidied(forms, to)


@compiled
def apply(forms: Array, to: int, a: int, function: int, exponent: float) -> None:
    """Write a function of a form, at the real numbers where it has a real value.

    Parameters
    ----------
    exponent
        Of a power of a number that is not negative; the other functions do not read it.
    """
    low, high = forms[a, LOW], forms[a, HIGH]
    if function == _SIGN:
        between(
            forms,
            to,
            1.0 if low > 0.0 else 0.0 if low == 0.0 else -1.0,
            -1.0 if high < 0.0 else 0.0 if high == 0.0 else 1.0,
        )
        return
    if function == _FLOOR:
        between(forms, to, np.floor(low), np.floor(high))  # that of math is an integer of 64 bits
        return
    if function == _ABS:
        _bent_at_zero(forms, to, a, -1.0)
        return
    if function in (_ROOT, _LOG, _POWER):
        if not high >= 0.0:
            nothing_known(forms, to)
            return
        if function == _LOG and high == 0.0:  # below every number, so that a positive power of zero is zero
            between(forms, to, -math.inf, -_LARGEST)
            return
        low = max(low, 0.0)
        exponent = 0.5 if function == _ROOT else exponent
    elif function == _RECIPROCAL and not (low > 0.0 or high < 0.0):
        nothing_known(forms, to)
        if low == 0.0 and high > 0.0:
            forms[to, LOW] = math.nextafter(1.0 / high, 0.0)
        if high == 0.0 and low < 0.0:
            forms[to, HIGH] = math.nextafter(1.0 / low, 0.0)
        return
    bounded = math.isfinite(low) and math.isfinite(high)
    if function in (_SIN, _COS):
        if bounded and high - low < 3.0:
            _expanded(forms, to, a, function, low, high, 1.0)
        else:
            between(forms, to, -1.0, 1.0)
        _narrowed(forms, to, -1.0, 1.0)
        return
    at_low, at_high = _value(function, low, exponent), _value(function, high, exponent)
    if function in (_TANH, _ATAN):
        if bounded and high - low < 4.0:
            _expanded(forms, to, a, function, low, high, 0.77 if function == _TANH else 0.65)
        else:
            between(forms, to, -2.0, 2.0)
        _narrowed(forms, to, at_low, at_high)
        return
    # Convex or concave functions.
    if bounded:
        _chord(forms, to, a, function, low, high, exponent)
    else:
        nothing_known(forms, to)
    if function == _SQUARE:
        least = 0.0 if low <= 0.0 <= high else min(at_low, at_high)
        _narrowed(forms, to, least, max(at_low, at_high))
    elif function == _RECIPROCAL or (function == _POWER and exponent < 0.0):
        _narrowed(forms, to, at_high, at_low)
    else:
        _narrowed(forms, to, at_low, at_high)
