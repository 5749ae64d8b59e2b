"""Interval arithmetic on Python integers: an interval is a pair of integers, in units of ``2**-bits``.

Sums are exact. Products and quotients are rounded outwards by at most one unit. The number of bits is not limited. On
the recursions of :mod:`relaxations.points.witness` this is about ten times faster than a general interval library.
"""

from __future__ import annotations

import math

Interval = tuple[int, int]


def from_float(value: float, bits: int) -> Interval:
    """Return the interval of a finite float: a point if the float has at most ``bits`` binary places.

    >>> from_float(0.75, 4), from_float(0.1, 4)
    ((12, 12), (1, 2))
    """
    mantissa, exponent = math.frexp(value)
    shift = exponent - 53 + bits
    whole = int(mantissa * 2.0**53)
    if shift >= 0:
        return whole << shift, whole << shift
    return whole >> -shift, -(-whole >> -shift)


def widened(value: Interval, radius: float, bits: int) -> Interval:
    """Return the interval ``[low - radius, high + radius]``; the radius, at least zero, is rounded up."""
    reach = from_float(radius, bits)[1]
    return value[0] - reach, value[1] + reach


def multiply(x: Interval, y: Interval, bits: int) -> Interval:
    """Return the product, rounded outwards.

    >>> multiply((-8, 4), (12, 13), 4)  # [-1/2, 1/4] times [3/4, 13/16] is [-13/32, 13/64]
    (-7, 4)
    """
    if y[0] == y[1]:
        x, y = y, x
    (a, b), (c, d) = x, y
    if a == b:
        # A float has at most 53 significant bits: multiply these, and shift by its trailing zeros.
        digits, zeros = _digits(a)
        low, high = (digits * c, digits * d) if a >= 0 else (digits * d, digits * c)
        if zeros > bits:
            return low << zeros - bits, high << zeros - bits
        return low >> bits - zeros, -(-high >> bits - zeros)
    corners = (a * c, a * d, b * c, b * d)
    return min(corners) >> bits, -(-max(corners) >> bits)


def divide(x: Interval, y: Interval, bits: int) -> Interval | None:
    """Return the quotient, rounded outwards; None if the divisor contains zero."""
    (a, b), (c, d) = x, y
    if c <= 0 <= d:
        return None
    if c < 0:
        a, b, c, d = -b, -a, -d, -c
    lows, highs = [], []
    for end in {c, d}:
        digits, zeros = _digits(end)
        lows.append((a << bits >> zeros) // digits)
        highs.append(-((-b << bits >> zeros) // digits))
    return min(lows), max(highs)


def _digits(value: int) -> tuple[int, int]:
    """Return the odd factor of an integer and the exponent of its power of two."""
    zeros = max((value & -value).bit_length() - 1, 0)
    return value >> zeros, zeros


def to_floats(value: Interval, bits: int) -> tuple[float, float]:
    """Return both bounds as floats, rounded outwards; infinite if a bound exceeds the range of floats."""
    low, high = (_to_float(end, bits) for end in value)
    return math.nextafter(low, -math.inf), math.nextafter(high, math.inf)


def middle(value: Interval, bits: int) -> float:
    """Return the float nearest to the midpoint."""
    return _to_float(value[0] + value[1], bits + 1)


def _to_float(value: int, bits: int) -> float:
    # Python's division of integers is correctly rounded.
    """Return ``value / 2**bits``, correctly rounded, or infinity."""
    try:
        return value / (1 << bits)
    except OverflowError:
        return math.inf if value > 0 else -math.inf
