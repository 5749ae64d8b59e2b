"""Elementary functions of affine forms: each between two parallel lines, and between its own ends.

Where a function is convex or concave, the lines have about the slope of its chord. The others are expanded around the
middle, and the remainder is at most half of their largest second derivative times the square of the distance.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from math import inf, isqrt

from relaxations.check.runs import fixed
from relaxations.check.runs.affine import (
    NONE,
    UNKNOWN,
    Form,
    Products,
    Range,
    add,
    between,
    floor,
    line,
    multiply,
    narrowed,
    negative,
    positive,
    sign,
)
from relaxations.check.runs.fixed import BITS, ONE, End, Ends, above, below, up

Value = Callable[[int], tuple[int, End]]
Finite = Callable[[int], Ends]


@dataclass(frozen=True)
class _Curve:
    """A convex or concave function: ends of its values and derivatives.

    Parameters
    ----------
    touching
        Returns roughly where it has a derivative; by default the tangent is that at the middle.
    """

    convex: bool
    value: Value
    slope: Value
    touching: Callable[[int], int] | None = None


def _bent(a: Form, curve: _Curve, ends: Range) -> Form:
    """Return a convex or concave function of a form, whose values lie between two ends.

    Less a line, a convex function is at most its larger value at the ends of the argument, and at least what its
    tangent at a point between is there, which is smallest at an end. A concave function is the opposite.
    """
    low, high = a.low, a.high
    if not (isinstance(low, int) and isinstance(high, int) and isinstance(a.radius, int)) or high - low < 4:
        return between(*ends)
    (first, first_up), (last, last_up) = curve.value(low), curve.value(high)
    if not (isinstance(first_up, int) and isinstance(last_up, int)):
        return between(*ends)
    # The line's slope, and the point of the tangent.
    slope = ((last - first) << BITS) // (high - low)
    point = curve.touching(slope) if curve.touching and slope else low
    point = point if low < point < high else (low + high) >> 1
    (middle, middle_up), (tangent, tangent_up) = curve.value(point), curve.slope(point)
    if not (isinstance(middle_up, int) and isinstance(tangent_up, int)):
        return between(*ends)
    # Function and tangent, less the line, at both ends; all times ONE.
    if curve.convex:
        most = max((value << BITS) - slope * x for x, value in ((low, first_up), (high, last_up)))
        least = min(
            (middle << BITS) + min(t * (x - point) for t in (tangent, tangent_up)) - slope * x for x in (low, high)
        )
    else:
        least = min((value << BITS) - slope * x for x, value in ((low, first), (high, last)))
        most = max(
            (middle_up << BITS) + max(t * (x - point) for t in (tangent, tangent_up)) - slope * x for x in (low, high)
        )
    return line(a, slope, least >> BITS, up(most, BITS), ends)


def _rising(value: Value, low: End, high: End, before: End) -> Range:
    """Return the ends of a function that rises, and is at least ``before``."""
    return value(low)[0] if isinstance(low, int) else before, value(high)[1] if isinstance(high, int) else inf


def _inverse_square(x: int) -> tuple[int, int]:
    return -(ONE**3) // (x * x), -(ONE**3 // (x * x))


def _half_inverse_root(x: int) -> tuple[int, int]:
    low, high = fixed.root(x)
    return ONE**2 // (2 * high), -(-(ONE**2) // (2 * low))


_SQUARE = _Curve(True, fixed.square, lambda x: (2 * x, 2 * x), lambda slope: slope >> 1)
_RECIPROCAL = _Curve(True, fixed.reciprocal, _inverse_square, lambda slope: isqrt(ONE**3 // -slope) if slope < 0 else 0)
_ROOT = _Curve(False, fixed.root, _half_inverse_root, lambda slope: ONE**3 // (4 * slope * slope))
_EXP = _Curve(True, fixed.exp, fixed.exp, lambda slope: fixed.log(slope)[0] if slope > 0 else 0)
_LOG = _Curve(False, fixed.log, fixed.reciprocal, lambda slope: ONE**2 // slope)
_PHI = _Curve(True, fixed.phi, fixed.phi_slope)


def square(a: Form) -> Form:
    """Return the square."""
    least, most = sorted((abs(a.low), abs(a.high)))
    ends = _rising(fixed.square, 0 if a.low <= 0 <= a.high else least, most, 0)
    return _bent(a, _SQUARE, ends)


def reciprocal(a: Form) -> Form:
    """Return the inverse."""
    if a.high < 0:
        return negative(reciprocal(negative(a)))
    if a.low < 0 or a.high == 0:
        return UNKNOWN
    low = fixed.reciprocal(a.high)[0] if isinstance(a.high, int) else 0
    if not isinstance(a.low, int) or a.low == 0:
        return between(low, inf)
    return _bent(a, _RECIPROCAL, (low, fixed.reciprocal(a.low)[1]))


def root(a: Form) -> Form:
    """Return the root."""
    known = _without_negative(a)
    return UNKNOWN if known is None else _bent(known, _ROOT, _rising(fixed.root, known.low, known.high, 0))


def exp(a: Form) -> Form:
    """Return the exponential."""
    return _bent(a, _EXP, _rising(fixed.exp, a.low, a.high, 0))


def log(a: Form) -> Form:
    """Return the logarithm."""
    if a.high <= 0:
        return UNKNOWN
    if a.low <= 0:
        return between(-inf, fixed.log(a.high)[1] if isinstance(a.high, int) else inf)
    return _bent(a, _LOG, _rising(fixed.log, a.low, a.high, -inf))


def power(a: Form, exponent: Fraction) -> Form:
    """Return a positive power, which is no whole number, of a number that is not negative."""
    known = _without_negative(a)
    if known is None:
        return UNKNOWN
    value = partial(fixed.power, exponent=exponent)

    def slope_at(x: int) -> tuple[int, End]:
        low, high = fixed.power(x, abs(exponent - 1))
        if exponent < 1:
            low, high = (ONE**2 // high if isinstance(high, int) else 0), (-(-(ONE**2) // low) if low else inf)
        return below(low * exponent / ONE), above(high * exponent / ONE) if isinstance(high, int) else inf

    def touching(slope: int) -> int:
        if slope <= 0:
            return 0
        return fixed.exp(below(Fraction(fixed.log(slope)[0] - fixed.log(above(exponent))[0], ONE) / (exponent - 1)))[0]

    curve = _Curve(exponent > 1, value, slope_at, touching)
    return _bent(known, curve, _rising(value, known.low, known.high, 0))


def raised(a: Form, exponent: Form, products: Products = NONE) -> Form:
    """Return a power whose exponent is a form: of a negative number, it has a value where the exponent is whole."""
    low, high = exponent.low, exponent.high
    whole = not (isinstance(low, int) and isinstance(high, int)) or high >> BITS != (low - 1) >> BITS
    return UNKNOWN if a.low < 0 and whole else exp(multiply(exponent, log(a), products))


def geometric(base: Form, count: Form) -> Form:
    """Return ``(1 - base**count) / (1 - base)``, which a base of one does not divide by zero.

    With ``phi(z) = (exp(z) - 1) / z`` it is ``count phi(count log(base)) / phi(log(base))``.
    """
    one = between(ONE, ONE)
    if base.low <= 0:
        return multiply(add(one, negative(raised(base, count))), reciprocal(add(one, negative(base))))
    logarithm = log(base)
    return multiply(count, multiply(_phi(multiply(count, logarithm)), reciprocal(_phi(logarithm))))


def _phi(a: Form) -> Form:
    return _bent(a, _PHI, _rising(fixed.phi, a.low, a.high, 0))


def size(a: Form) -> Form:
    """Return a number that is known not to be negative."""
    return narrowed(a, 0, inf)


def _without_negative(a: Form) -> Form | None:
    """Return a form with its negative part left out; None where nothing is left."""
    if a.high < 0:
        return None
    return a if a.low >= 0 else Form(a.mid, a.slopes, a.radius, 0, a.high)


# ---------------------------------------------------------------- expanded around the middle


def _expanded(
    a: Form, value: Callable[[int], Ends], slope_at: Callable[[int], Ends], bend: Fraction, widest: int, ends: Range
) -> Form:
    """Return a function with a bounded second derivative, whose values lie between two ends."""
    low, high = a.low, a.high
    if not (isinstance(low, int) and isinstance(high, int) and isinstance(a.radius, int)) or high - low > widest * ONE:
        return between(*ends)
    middle = (low + high) >> 1
    half = max(high - middle, middle - low)
    (least, most), (slope, slope_up) = value(middle), slope_at(middle)
    remainder = above(bend * half * half / 2 / ONE**2) + up((slope_up - slope) * half, BITS)
    shift = slope * middle
    return line(a, slope, least - up(shift, BITS) - remainder, most - (shift >> BITS) + remainder, ends)


def sin(a: Form) -> Form:
    """Return the sine."""
    return _expanded(a, fixed.sin, fixed.cos, Fraction(1), 3, (-ONE, ONE))


def cos(a: Form) -> Form:
    """Return the cosine."""
    return _expanded(a, fixed.cos, partial(fixed.sin, quarters=2), Fraction(1), 3, (-ONE, ONE))


def tanh(a: Form) -> Form:
    """Return the hyperbolic tangent, whose second derivative is at most 4 / sqrt(27)."""

    def slope_at(x: int) -> tuple[int, int]:
        least, most = sorted(map(abs, fixed.tanh(x)))
        return ONE - up(most * most, BITS), ONE - (least * least >> BITS)

    low = fixed.tanh(a.low)[0] if isinstance(a.low, int) else -ONE
    high = fixed.tanh(a.high)[1] if isinstance(a.high, int) else ONE
    return _expanded(a, fixed.tanh, slope_at, Fraction(77, 100), 4, (low, high))


def atan(a: Form) -> Form:
    """Return the arc tangent, whose second derivative is at most 3 sqrt(3) / 8."""

    def slope_at(x: int) -> tuple[int, int]:
        whole = ONE + (x * x >> BITS)
        return ONE**2 // (whole + 1), -(-(ONE**2) // whole)

    low = fixed.atan(a.low)[0] if isinstance(a.low, int) else -2 * ONE
    high = fixed.atan(a.high)[1] if isinstance(a.high, int) else 2 * ONE
    return _expanded(a, fixed.atan, slope_at, Fraction(65, 100), 4, (low, high))


FUNCTIONS: dict[str, Callable[[Form], Form]] = {
    "positive": positive,
    "sign": sign,
    "size": size,
    "floor": floor,
    "square": square,
    "reciprocal": reciprocal,
    "sqrt": root,
    "exp": exp,
    "log": log,
    "sin": sin,
    "cos": cos,
    "tanh": tanh,
    "atan": atan,
}
