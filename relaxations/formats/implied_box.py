"""Bounds that single constraints imply: ``x**2 + y**2 <= 1`` bounds both variables.

In ``sum of terms >= 0``, a term ``c x^p`` of one variable is at least minus the largest value of the other terms on the
box. If this value is finite, x is bounded by a root, which is rounded outwards. Finite bounds are not changed, because
the relaxation tightens them.

References
----------
P. Belotti, S. Cafieri, J. Lee and L. Liberti, "Feasibility-based bounds tightening via fixed points", COCOA 2010,
LNCS 6508, 65-76.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from math import ceil, floor

Names = tuple[str, ...]
Terms = Mapping[Names, Fraction]
Box = dict[str, tuple[Fraction | None, Fraction | None]]


def implied_box(constraints: Sequence[tuple[Terms, bool]], box: Box) -> Box:
    """Return the box with finite bounds where the constraints, used one after the other, imply them.

    A constraint is ``(terms, equality)``: ``terms >= 0``, or ``terms == 0``. A bound of ``None`` is infinite.

    >>> one = Fraction(1)
    >>> implied_box([({(): one, ("x", "x"): -one}, False)], {"x": (None, None)})
    {'x': (Fraction(-1, 1), Fraction(1, 1))}
    """
    box = dict(box)
    sides: list[Terms] = []
    for terms, equality in constraints:
        sides.append(terms)
        if equality:
            sides.append({m: -c for m, c in terms.items()})
    changed = True
    while changed and any(end is None for pair in box.values() for end in pair):
        changed = False
        for terms in sides:
            changed = _apply(terms, box) or changed
    return box


def _apply(terms: Terms, box: Box) -> bool:
    """Replace infinite bounds by those that one ``terms >= 0`` implies; return whether a bound changed."""
    changed = False
    largest = {m: _largest(m, c, box) for m, c in terms.items()}
    for m, c in terms.items():
        if len(set(m)) != 1 or None not in box[m[0]]:
            continue
        others = Fraction(0)
        for other, value in largest.items():
            if other != m and value is None:
                break
            others += value if other != m and value is not None else 0
        else:
            # c x^p + others >= 0
            changed = _fill(m[0], len(m), c, -others / c, box) or changed
    return changed


def _fill(v: str, power: int, c: Fraction, limit: Fraction, box: Box) -> bool:
    """Replace infinite bounds of v by those of ``c v^power >= c limit``; return whether a bound changed."""
    low, high = box[v]
    new_low, new_high = low, high
    if power % 2:
        if c > 0 and low is None:
            new_low = -_root_above(-limit, power)
        elif c < 0 and high is None:
            new_high = _root_above(limit, power)
    elif c < 0:
        # With a negative limit the set is empty. Any box is valid then, and the relaxation proves it.
        reach = _root_above(max(limit, Fraction(0)), power)
        new_low, new_high = -reach if low is None else low, reach if high is None else high
    box[v] = (new_low, new_high)
    return box[v] != (low, high)


def _root_above(value: Fraction, power: int) -> Fraction:
    """Return a rational number that is at least the root, and slightly above it."""
    if power == 1:
        return value
    size = abs(value)
    # The number of binary places gives the root sixty significant bits.
    places = 60 - (size.numerator.bit_length() - size.denominator.bit_length()) // power
    scaled = size * Fraction(2) ** (places * power)
    if value < 0:
        return -_integer_root(floor(scaled), power) / Fraction(2) ** places
    root = _integer_root(ceil(scaled), power)
    return (root if root**power >= scaled else root + 1) / Fraction(2) ** places


def _integer_root(n: int, power: int) -> int:
    """Return the largest integer whose power is at most n, by Newton's method from above."""
    guess = 1 << -(-n.bit_length() // power)
    while guess**power > n:
        guess = ((power - 1) * guess + n // guess ** (power - 1)) // power
    return guess


def _largest(m: Names, c: Fraction, box: Box) -> Fraction | None:
    """Return an upper bound of a term on the box; None for infinity."""
    low: Fraction | None = c
    high: Fraction | None = c
    for v in dict.fromkeys(m):
        low, high = _times((low, high), _power(box[v], m.count(v)))
    return high


def _power(pair: tuple[Fraction | None, Fraction | None], p: int) -> tuple[Fraction | None, Fraction | None]:
    """Return the interval of a power."""
    low, high = pair
    if p % 2:
        return None if low is None else low**p, None if high is None else high**p
    top = None if low is None or high is None else max(low**p, high**p)
    if low is not None and low > 0:
        return low**p, top
    if high is not None and high < 0:
        return high**p, top
    return Fraction(0), top


def _times(
    one: tuple[Fraction | None, Fraction | None], two: tuple[Fraction | None, Fraction | None]
) -> tuple[Fraction | None, Fraction | None]:
    """Return the product of two intervals; None is infinite."""
    (a, b), (c, d) = one, two
    if a == b == 0 or c == d == 0:
        return Fraction(0), Fraction(0)
    corners: list[Fraction] = []
    below = above = False  # whether a corner is infinite
    for s, s_sign in ((a, -1), (b, 1)):
        for t, t_sign in ((c, -1), (d, 1)):
            if s is not None and t is not None:
                corners.append(s * t)
                continue
            sign = (s_sign if s is None else (s > 0) - (s < 0)) * (t_sign if t is None else (t > 0) - (t < 0))
            if sign == 0:
                corners.append(Fraction(0))
            below, above = below or sign < 0, above or sign > 0
    return None if below else min(corners), None if above else max(corners)
