"""Affine forms in fixed-point numbers: how a number depends on symbols in [-1, 1], and between which ends it lies.

A form with a finite radius says two things of a number x: for the values that the symbols have, x differs from
``mid + sum slope_k e_k`` by at most the radius; and ``low <= x <= high``. With an infinite radius only the second is
said. Each operation returns a form that holds for the result wherever the forms of its arguments hold for these. An
expression has no real value at some points (the root of a negative number): of these nothing is said, as they are no
points of a set whose equations need the value.

Everything is computed in whole units (:mod:`.fixed`). A shift to the right rounds down, by less than one unit, and each
such unit is added to the radius; the ends are rounded outwards.

Reference: de Figueiredo and Stolfi, Affine arithmetic: concepts and applications, Numerical Algorithms 37 (2004).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from math import inf

from relaxations.check.runs.fixed import BITS, ONE, End, above, below, up

LARGEST = ONE << 640
"""A number beyond is unbounded: so a small file cannot make long ones."""

Range = tuple[End, End]

Products = Mapping[tuple[int, int], int]
"""The symbol that stands for the product of two others, the smaller one first; for ``2 e e - 1`` of one with itself."""

NONE: Products = {}


@dataclass(frozen=True, slots=True)
class Form:
    """What is known of a number, in units."""

    mid: int
    slopes: dict[int, int]
    radius: End
    low: End
    high: End

    @property
    def bounded(self) -> bool:
        """Return whether both ends are finite."""
        return isinstance(self.low, int) and isinstance(self.high, int)


UNKNOWN = Form(0, {}, inf, -inf, inf)


def between(low: End, high: End) -> Form:
    """Return the form of a number between two ends."""
    low, high = _limited(low, high)
    if not (isinstance(low, int) and isinstance(high, int)):
        return Form(0, {}, inf, low, high)
    mid = (low + high) >> 1
    return Form(mid, {}, max(high - mid, mid - low), low, high)


def number(value: Fraction) -> Form:
    """Return the form of a number."""
    return between(below(value), above(value))


def symbol(low: End, high: End, k: int) -> Form:
    """Return the form of an unknown between two ends, which has a symbol of its own."""
    form = between(low, high)
    if not isinstance(form.radius, int):
        return form
    return Form(form.mid, {k: form.radius} if form.radius else {}, 0, form.low, form.high)


def spread(form: Form) -> End:
    """Return the largest distance from the centre."""
    return sum(map(abs, form.slopes.values())) + form.radius


def narrowed(form: Form, low: End, high: End) -> Form:
    """Return the form of a number that is known to lie between two ends, too."""
    return _tidied(form.mid, form.slopes, form.radius, max(form.low, low), min(form.high, high))


def _limited(low: End, high: End) -> Range:
    low = -inf if low < -LARGEST else LARGEST if low > LARGEST else low
    high = inf if high > LARGEST else -LARGEST if high < -LARGEST else high
    # Ends that exclude each other belong to no point.
    return (low, high) if low <= high else (-inf, inf)


def _tidied(mid: int, slopes: dict[int, int], radius: End, low: End, high: End) -> Form:
    """Return a form whose two statements narrow each other."""
    if not isinstance(radius, int):
        return between(low, high)
    reach = sum(map(abs, slopes.values())) + radius
    if abs(mid) + reach > LARGEST:
        return between(low, high)
    low, high = _limited(max(low, mid - reach), min(high, mid + reach))
    # Slopes beside a radius as wide as the whole range tell nothing.
    if not isinstance(low, int) or 2 * radius > high - low:
        return between(low, high)
    return Form(mid, slopes, radius, low, high)


def add(a: Form, b: Form) -> Form:
    """Return ``a + b``."""
    low, high = a.low + b.low, a.high + b.high
    radius = a.radius + b.radius
    if not isinstance(radius, int) or not (a.slopes or b.slopes):
        return between(low, high)
    slopes = dict(a.slopes)
    for k, slope in b.slopes.items():
        slopes[k] = slopes.get(k, 0) + slope
    return _tidied(a.mid + b.mid, slopes, radius, low, high)


def multiply(a: Form, b: Form, products: Products = NONE) -> Form:
    """Return ``a b``.

    With the deviations ``A = sum a_k e_k + a_0`` and ``B`` of both, ``|a_0|`` at most the radius of a,

        a b  =  mid_a mid_b + mid_a B + mid_b A + A B,

    and A B differs from half the sum of ``a_k b_k`` by at most the product of both spreads less half the sum of
    ``|a_k b_k|``: a square in a symbol lies between 0 and 1. A product of two symbols that has a symbol is a slope.
    """
    ends = [_times(x, y) for x in (a.low, a.high) for y in (b.low, b.high)]
    least, most = min(ends), max(ends)
    low = least >> BITS if isinstance(least, int) else least
    high = up(most, BITS) if isinstance(most, int) else most
    if not (isinstance(a.radius, int) and isinstance(b.radius, int)) or not (a.slopes or b.slopes):
        return between(low, high)
    reach = (sum(map(abs, a.slopes.values())) + a.radius) * (sum(map(abs, b.slopes.values())) + b.radius)
    mid_a, mid_b = a.mid, b.mid
    slopes = {k: mid_b * slope >> BITS for k, slope in a.slopes.items()}
    roundings, twice, size = len(a.slopes) + len(b.slopes) + 4, 0, 0
    for k, slope in b.slopes.items():
        slopes[k] = slopes.get(k, 0) + (mid_a * slope >> BITS)
        if k in a.slopes:
            own = a.slopes[k] * slope
            twice, size = twice + own, size + abs(own)
    known = size // 2
    for (j, k), own in products.items():
        one = a.slopes.get(j, 0) * b.slopes.get(k, 0)
        if j == k:
            part, known = one >> 1, known + abs(one) // 2
        else:
            other = a.slopes.get(k, 0) * b.slopes.get(j, 0)
            part, known = one + other, known + abs(one) + abs(other)
        if part:
            slopes[own], roundings = slopes.get(own, 0) + (part >> BITS), roundings + 2
    radius = abs(mid_a) * b.radius + abs(mid_b) * a.radius + reach - known
    mid = (mid_a * mid_b + twice // 2) >> BITS
    return _tidied(mid, slopes, up(radius, BITS) + roundings, low, high)


def _times(x: End, y: End) -> End:
    """Return the product of two ends, of which each may be infinite; a number is finite, so 0 times any is 0."""
    if not x or not y:
        return 0
    return x * y if isinstance(x, int) and isinstance(y, int) else inf if (x > 0) == (y > 0) else -inf


def hull(a: Form, b: Form) -> Form:
    """Return a form that holds for either of two numbers."""
    low, high = min(a.low, b.low), max(a.high, b.high)
    if not (isinstance(a.radius, int) and isinstance(b.radius, int)):
        return between(low, high)
    mid = (a.mid + b.mid) >> 1
    slopes = {k: (a.slopes.get(k, 0) + b.slopes.get(k, 0)) >> 1 for k in {**a.slopes, **b.slopes}}
    apart = max(
        abs(form.mid - mid) + sum(abs(form.slopes.get(k, 0) - slope) for k, slope in slopes.items()) + form.radius
        for form in (a, b)
    )
    return _tidied(mid, slopes, apart, low, high)


def negative(a: Form) -> Form:
    """Return ``-a``."""
    return Form(-a.mid, {k: -slope for k, slope in a.slopes.items()}, a.radius, -a.high, -a.low)


def scaled(a: Form, factor: Fraction) -> Form:
    """Return a form times a number."""
    n, d = factor.numerator, factor.denominator
    ends = (a.low, a.high) if n >= 0 else (a.high, a.low)
    low, high = (_times(n, end) for end in ends)
    low, high = (low // d if isinstance(low, int) else low), (-(-high // d) if isinstance(high, int) else high)
    if not isinstance(a.radius, int) or not a.slopes:
        return between(low, high)
    slopes = {k: n * slope // d for k, slope in a.slopes.items()}
    return _tidied(n * a.mid // d, slopes, -(-abs(n) * a.radius // d) + len(slopes) + 1, low, high)


def gathered(a: Form, symbols: int, own: int) -> Form:
    """Return a form whose radius and slopes in symbols from a number on are one slope, in a symbol of its own."""
    if not isinstance(a.radius, int):
        return a
    slopes = {k: slope for k, slope in a.slopes.items() if k < symbols}
    slopes[own] = a.radius + sum(abs(slope) for k, slope in a.slopes.items() if k >= symbols)
    return Form(a.mid, slopes, 0, a.low, a.high)


def scattered(a: Form, symbols: int, own: int, before: Form) -> Form:
    """Return a form with the symbols that were gathered from one before, in place of their own."""
    if own not in a.slopes or not isinstance(a.radius, int) or not isinstance(before.radius, int):
        return a
    slopes, slope = dict(a.slopes), a.slopes[own]
    del slopes[own]
    further = {k: part for k, part in before.slopes.items() if k >= symbols}
    size = sum(map(abs, further.values())) + before.radius
    if not size:
        return Form(a.mid, slopes, a.radius, a.low, a.high)
    for k, part in further.items():
        slopes[k] = slopes.get(k, 0) + slope * part // size
    radius = a.radius - (-abs(slope) * before.radius // size) + len(further)
    return _tidied(a.mid, slopes, radius, a.low, a.high)


def line(a: Form, slope: int, low: int, high: int, ends: Range) -> Form:
    """Return the form of ``slope a`` plus a number between low and high, itself between two ends."""
    assert isinstance(a.radius, int)
    slopes = {k: slope * own >> BITS for k, own in a.slopes.items()}
    middle = (low + high) >> 1
    radius = up(abs(slope) * a.radius, BITS) + max(high - middle, middle - low) + len(slopes) + 2
    return _tidied((slope * a.mid >> BITS) + middle, slopes, radius, *ends)


def positive(a: Form) -> Form:
    """Return ``max(0, a)``."""
    if a.low >= 0:
        return a
    if a.high <= 0:
        return between(0, 0)
    ends = 0, a.high
    if not (isinstance(a.low, int) and isinstance(a.high, int) and isinstance(a.radius, int)):
        return between(*ends)
    # Less a line of slope 0 to 1, it is smallest (zero) at the kink and largest at an end.
    slope = (a.high << BITS) // (a.high - a.low)
    return line(a, slope, 0, max(up(-slope * a.low, BITS), a.high - (slope * a.high >> BITS)), ends)


def sign(a: Form) -> Form:
    """Return the sign."""
    return between((a.low > 0) * ONE - (a.low < 0) * ONE, (a.high > 0) * ONE - (a.high < 0) * ONE)


def floor(a: Form) -> Form:
    """Return the largest whole number that is not above."""
    low, high = (end >> BITS << BITS if isinstance(end, int) else end for end in (a.low, a.high))
    return between(low, high)
