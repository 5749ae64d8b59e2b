"""Interval arithmetic on Python integers: an interval is a pair of integers, scaled by a power of two.

Sums are exact and products round outwards by one unit of the last place. Slow next to floats, but of any precision, and
some ten times faster than a general interval library on the long recursions that verify a witness.
"""

from __future__ import annotations

import math

Interval = tuple[int, int]


def from_float(value: float, bits: int) -> Interval:
    """Return the interval of one float, scaled by ``2**bits``.

    Examples
    --------
    >>> from_float(0.75, 4)
    (12, 12)
    """
    mantissa, exponent = math.frexp(value)
    shift = exponent - 53 + bits
    whole = int(mantissa * 2.0**53)
    if shift >= 0:
        return whole << shift, whole << shift
    return whole >> -shift, -(-whole >> -shift)


def widened(value: Interval, radius: float, bits: int) -> Interval:
    """Return the interval grown by a radius on both sides."""
    reach = from_float(radius, bits)[1]
    return value[0] - reach, value[1] + reach


def multiply(x: Interval, y: Interval, bits: int) -> Interval:
    """Return the product, rounded outwards."""
    (a, b), (c, d) = x, y
    if a == b and c == d:
        product = a * c
        return product >> bits, -(-product >> bits)
    corners = (a * c, a * d, b * c, b * d)
    return min(corners) >> bits, -(-max(corners) >> bits)


def divide(x: Interval, y: Interval, bits: int) -> Interval | None:
    """Return the quotient, rounded outwards; None where the divisor holds zero."""
    (a, b), (c, d) = x, y
    if c <= 0 <= d:
        return None
    if c < 0:
        a, b, c, d = -b, -a, -d, -c
    low, high = a << bits, b << bits
    return min(low // c, low // d), max(-(-high // c), -(-high // d))


def to_floats(value: Interval, bits: int) -> tuple[float, float]:
    """Return the ends as floats, rounded outwards."""
    low, high = (_to_float(end, bits) for end in value)
    return math.nextafter(low, -math.inf), math.nextafter(high, math.inf)


def middle(value: Interval, bits: int) -> float:
    """Return the middle as a float."""
    return _to_float(value[0] + value[1], bits + 1)


def _to_float(value: int, bits: int) -> float:
    # True division of integers rounds correctly; one beyond the range of floats is infinite.
    try:
        return value / (1 << bits)
    except OverflowError:
        return math.inf if value > 0 else -math.inf
