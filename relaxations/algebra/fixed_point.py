"""Interval arithmetic on Python integers: an interval is a pair of integers, scaled by a power of two.

Sums are exact and products round outwards by one unit of the last place. Slow next to floats, but of any precision, and
some ten times faster than a general interval library on the long recursions that verify a witness.
"""

from __future__ import annotations

import math

Interval = tuple[int, int]


def from_float(value: float, bits: int) -> Interval:
    """Return the interval of one float, scaled by ``2**bits``.

    Parameters
    ----------
    value
        Finite.
    bits
        Binary places after the point.

    Returns
    -------
    tuple of (int, int)
        The value itself where it has no more places than that, its neighbours otherwise.

    Examples
    --------
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
    """Return the interval grown by a radius on both sides.

    Parameters
    ----------
    radius
        At least zero; rounded up.
    bits
        Binary places after the point, of ``value`` and of the result.

    Returns
    -------
    tuple of (int, int)

    Examples
    --------
    >>> to_floats(widened(from_float(0.75, 4), 0.1, 4), 4)  # the radius becomes 2/16
    (0.6249999999999999, 0.8750000000000001)
    """
    reach = from_float(radius, bits)[1]
    return value[0] - reach, value[1] + reach


def multiply(x: Interval, y: Interval, bits: int) -> Interval:
    """Return the product, rounded outwards.

    Parameters
    ----------
    bits
        Binary places after the point, of both and of the result.

    Returns
    -------
    tuple of (int, int)

    Examples
    --------
    >>> multiply((-8, 4), (12, 13), 4)  # [-1/2, 1/4] times [3/4, 13/16] is [-13/32, 13/64]
    (-7, 4)
    """
    if y[0] == y[1]:
        x, y = y, x
    (a, b), (c, d) = x, y
    if a == b:
        # A float is few digits and many zeros, which need not be multiplied.
        digits, zeros = _digits(a)
        low, high = (digits * c, digits * d) if a >= 0 else (digits * d, digits * c)
        if zeros > bits:
            return low << zeros - bits, high << zeros - bits
        return low >> bits - zeros, -(-high >> bits - zeros)
    corners = (a * c, a * d, b * c, b * d)
    return min(corners) >> bits, -(-max(corners) >> bits)


def divide(x: Interval, y: Interval, bits: int) -> Interval | None:
    """Return the quotient, rounded outwards; None where the divisor holds zero.

    Parameters
    ----------
    bits
        Binary places after the point, of both and of the result.

    Returns
    -------
    tuple of (int, int) or None

    Examples
    --------
    >>> divide(from_float(1.0, 8), from_float(3.0, 8), 8)  # 256 / 3 lies between
    (85, 86)
    >>> divide((256, 256), (-1, 1), 8) is None
    True
    """
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
    """Return an odd number and the power of two that it was multiplied by."""
    zeros = max((value & -value).bit_length() - 1, 0)
    return value >> zeros, zeros


def to_floats(value: Interval, bits: int) -> tuple[float, float]:
    """Return the ends as floats, rounded outwards.

    Parameters
    ----------
    bits
        Binary places after the point.

    Returns
    -------
    tuple of (float, float)
        Infinite where an end is beyond the range of floats.

    Examples
    --------
    >>> low, high = to_floats(divide((1 << 80, 1 << 80), (3 << 80, 3 << 80), 80), 80)
    >>> low < 1 / 3 < high, high - low < 1e-15
    (True, True)
    """
    low, high = (_to_float(end, bits) for end in value)
    return math.nextafter(low, -math.inf), math.nextafter(high, math.inf)


def middle(value: Interval, bits: int) -> float:
    """Return the middle as a float.

    Parameters
    ----------
    bits
        Binary places after the point.

    Returns
    -------
    float
        The nearest one to the exact middle.

    Examples
    --------
    >>> middle((12, 13), 4)  # of 0.75 and 0.8125
    0.78125
    """
    return _to_float(value[0] + value[1], bits + 1)


def _to_float(value: int, bits: int) -> float:
    # True division of integers rounds correctly; one beyond the range of floats is infinite.
    try:
        return value / (1 << bits)
    except OverflowError:
        return math.inf if value > 0 else -math.inf
