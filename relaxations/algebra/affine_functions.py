"""Functions of one form of affine arithmetic, and the larger of two.

A convex or concave function lies between its chord and a tangent of about the same slope, one with a bounded second
derivative about its tangent. The functions of the C library are taken to err by at most ``LIBRARY`` times their result;
a checker has enclosures of its own.

Reference: L. H. de Figueiredo and J. Stolfi, "Affine arithmetic: concepts and applications", Numerical Algorithms 37
(2004).
"""

from __future__ import annotations

import math
from enum import IntEnum

import numpy as np

from relaxations.algebra.affine_arithmetic import HIGH, LOW, add, between, copy, linear, nothing_known, tidied
from relaxations.algebra.arrays import Array
from relaxations.algebra.ball_arithmetic import EPSILON, TINY
from relaxations.algebra.compiled import compiled

LIBRARY = 8 * EPSILON


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
    tidied(forms, to)


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
    tidied(forms, to)


@compiled
def larger(forms: Array, to: int, a: int, b: int) -> None:
    """Write the larger of two numbers: b, and what a is more."""
    low, high = max(forms[a, LOW], forms[b, LOW]), max(forms[a, HIGH], forms[b, HIGH])
    add(forms, to, a, b, -1.0)
    _bent_at_zero(forms, to, to, 0.0)
    add(forms, to, to, b, 1.0)
    forms[to, LOW] = max(forms[to, LOW], low)
    forms[to, HIGH] = min(forms[to, HIGH], high)
    tidied(forms, to)


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
