"""Fixed-point numbers: whole numbers of units of ``2**-BITS``, and elementary functions of them within two units.

A function takes a whole number of units and returns two, between which its exact value lies. Nothing is taken from the
C library: sums, products and quotients are those of whole numbers, which Python computes exactly, and a shift to the
right rounds down.

The functions compute with ``GUARD`` more bits, in fine units of ``2**-FINE``. Each sums fewer than 100 terms, of which
each errs by less than 4 fine units, and reads an argument that errs by less than ``2**38`` of them (the reduction by a
multiple of pi or log 2). All their derivatives there are below 2, so `SLACK` covers the whole error.

Reference: Brent and Zimmermann, Modern Computer Arithmetic, Cambridge (2010), chapter 4.
"""

from __future__ import annotations

from fractions import Fraction
from math import inf, isqrt

BITS = 128
ONE = 1 << BITS

End = int | float  # a float is infinite
Ends = tuple[int, int]

GUARD = 64
FINE = BITS + GUARD
SLACK = 1 << 40

_WHOLE = 1 << FINE
_LARGEST_ANGLE = ONE << 32
_LARGEST_EXPONENT = ONE << 9


def below(value: Fraction) -> int:
    """Return the largest number of units that is at most a value."""
    return (value.numerator << BITS) // value.denominator


def above(value: Fraction) -> int:
    """Return the least number of units that is at least a value."""
    return -((-value.numerator << BITS) // value.denominator)


def up(value: int, bits: int) -> int:
    """Return ``value / 2**bits``, rounded up."""
    return -(-value >> bits)


def _atan_inverse(n: int, sign: int) -> int:
    """Return atan(1/n) (sign -1), or artanh(1/n) (sign 1), in units of ``2**-(FINE + GUARD)``."""
    power, total, k = (1 << (FINE + GUARD)) // n, 0, 0
    while power:
        total += (sign**k) * (power // (2 * k + 1))
        power //= n * n
        k += 1
    return total


# Fewer than 400 terms each, so an error below 2**20 of these small units: less than one fine unit, two when shifted.
_PI = (16 * _atan_inverse(5, -1) - 4 * _atan_inverse(239, -1)) >> GUARD
_LOG_2 = (2 * _atan_inverse(3, 1)) >> GUARD


def _around(fine: int) -> Ends:
    """Return the units around a fine number."""
    return (fine - SLACK) >> GUARD, up(fine + SLACK, GUARD)


def exp(x: int) -> tuple[int, End]:
    """Return ends of the exponential."""
    if x > _LARGEST_EXPONENT:
        return ONE, inf
    if x < -BITS * ONE:  # e**-128 is below 2**-128
        return 0, 1
    # exp(x) = 2**k exp(rest), with a rest of at most half of log 2.
    fine = x << GUARD
    k = (2 * fine + _LOG_2) // (2 * _LOG_2)
    rest = fine - k * _LOG_2
    total = term = _WHOLE
    for n in range(1, 49):
        term = (term * rest >> FINE) // n
        total += term
    low, high = total - SLACK, total + SLACK
    shift = GUARD - k
    return (low >> shift, up(high, shift)) if shift >= 0 else (low << -shift, high << -shift)


def log(x: int) -> Ends:
    """Return ends of the logarithm of a positive number."""
    # x = 2**n m units, with m from 1/2 to 1, and log m = 2 artanh((m - 1) / (m + 1)).
    n = x.bit_length()
    m = x << (FINE - n) if n <= FINE else x >> (n - FINE)
    z = ((m - _WHOLE) << FINE) // (m + _WHOLE)
    square, power, total = z * z >> FINE, z, 0
    for k in range(64):
        total += power // (2 * k + 1)
        power = power * square >> FINE
    return _around(2 * total + (n - BITS) * _LOG_2)


def sin(x: int, quarters: int = 0) -> Ends:
    """Return ends of the sine of an angle, plus some quarters of a turn."""
    if abs(x) > _LARGEST_ANGLE:
        return -ONE, ONE
    fine = x << GUARD
    k = (2 * fine + _PI // 2) // _PI
    rest = fine - (k * _PI >> 1)
    side = (k + quarters) % 4
    term = total = rest if side % 2 == 0 else _WHOLE
    square = rest * rest >> FINE
    first = 2 if side % 2 == 0 else 1
    for n in range(first, first + 60, 2):
        term = -(term * square >> FINE) // (n * (n + 1))
        total += term
    low, high = _around(total if side < 2 else -total)
    return max(low, -ONE), min(high, ONE)


def cos(x: int) -> Ends:
    """Return ends of the cosine."""
    return sin(x, 1)


def atan(x: int) -> Ends:
    """Return ends of the arc tangent."""
    size = abs(x) << GUARD
    inverted = size > _WHOLE
    # atan(z) = pi/2 - atan(1/z), and twice atan(z) = 2 atan(z / (1 + sqrt(1 + z^2))).
    z = (_WHOLE << FINE) // size if inverted else size
    for _ in range(2):
        z = (z << FINE) // (_WHOLE + isqrt((_WHOLE << FINE) + z * z))
    square, power, total = z * z >> FINE, z, 0
    for k in range(48):
        total += (-1) ** k * (power // (2 * k + 1))
        power = power * square >> FINE
    angle = _PI // 2 - 4 * total if inverted else 4 * total
    return _around(angle if x >= 0 else -angle)


def tanh(x: int) -> Ends:
    """Return ends of the hyperbolic tangent."""
    # (1 - q) / (1 + q) falls with q = exp(-2 |x|), which is at most 1.
    q_low, q_high = exp(-2 * abs(x))
    q_high = min(q_high, ONE)
    assert isinstance(q_high, int)
    low = ((ONE - q_high) << BITS) // (ONE + q_high)
    high = -(((q_low - ONE) << BITS) // (ONE + q_low))
    return (low, high) if x >= 0 else (-high, -low)


def phi(x: int) -> tuple[int, End]:
    """Return ends of ``(exp(x) - 1) / x``, which is one at zero."""
    if abs(x) >= ONE:
        low, high = exp(x)
        return _quotient(low - ONE, high - ONE, x)
    # The sum of x**n / (n + 1)!.
    fine, total = x << GUARD, 0
    term = _WHOLE
    for n in range(2, 50):
        total += term
        term = (term * fine >> FINE) // n
    return _around(total)


def phi_slope(x: int) -> tuple[int, End]:
    """Return ends of the derivative of `phi`."""
    if abs(x) >= ONE:
        (low, high), (least, most) = exp(x), phi(x)
        return _quotient(low - most, high - least, x) if isinstance(most, int) else (0, inf)
    # The sum of n x**(n - 1) / (n + 1)!.
    fine, total = x << GUARD, 0
    term = _WHOLE // 2
    for n in range(1, 49):
        total += n * term
        term = (term * fine >> FINE) // (n + 2)
    return _around(total)


def _quotient(low: End, high: End, x: int) -> tuple[int, End]:
    """Return ends of a number between two ends, of which the upper one may be infinite, over another that is not 0."""
    assert isinstance(low, int)
    if x < 0:
        assert isinstance(high, int)
        low, high, x = -high, -low, -x
    return (low << BITS) // x, -((-high << BITS) // x) if isinstance(high, int) else inf


def root(x: int) -> Ends:
    """Return ends of the root of a number that is not negative."""
    low = isqrt(x << BITS)
    return low, low if low * low == x << BITS else low + 1


def square(x: int) -> Ends:
    """Return ends of the square."""
    return x * x >> BITS, up(x * x, BITS)


def reciprocal(x: int) -> Ends:
    """Return ends of the inverse of a number that is not zero."""
    whole = ONE << BITS
    return whole // x, -(-whole // x)


def power(x: int, exponent: Fraction) -> tuple[int, End]:
    """Return ends of a positive power of a number that is not negative."""
    if x == 0:
        return 0, 0
    low, high = (Fraction(end, ONE) * exponent for end in log(x))
    return exp(below(low))[0], exp(above(high))[1]
