r"""Rates integrated with a modulating function: what a record says of the coefficients, for boxes of any size.

The function W is linear between two samples, from a to b, of which the file states both as whole numbers. Over an
interval of length h in which a state x has the rate \sum_j q_j g_j, by parts

    b x(k+1) - a x(k) - (b - a) mean(x)  =  h \sum_j q_j ((a + b)/2 mean(g_j) + (b - a) l(g_j)),

with the mean over the interval, and the moment ``l(g) = \int (s/h - 1/2) g ds / h``. This is exact. Where x is the rate
of a state y, ``mean(x) = (y(k+1) - y(k)) / h``; else ``mean(x) = (x(k) + x(k+1))/2 - h l(x')``.

At all times the states z lie in their boxes, over which ``g = c + \sum_i r_i (z_i - mid_i)`` within a radius (affine
arithmetic). So ``mean(g)`` is linear in the means of the states within the radius, and these are linear in what the
states are at the samples. A moment is at most an eighth of the width of its function, and that of a state lies in
h / 12 times the range of its rate.

The sum of all intervals is a sum over samples, in which noise cancels, times the middles of the coefficients q. What q
differs from its middle multiplies the range of the linear part. Of a coefficient that is known badly, all of it does.

Everything is summed in whole numbers: the sum is multiplied by ``4 h_n h_d`` for ``h = h_n / h_d``.

Reference: V. Maletinsky, On-line parameter estimation of continuous processes, IFAC Proceedings 8 (1975).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from math import inf

from relaxations.check.runs.affine import Form, Range, between, scaled, symbol
from relaxations.check.runs.comparison import Tube
from relaxations.check.runs.fixed import BITS, End, Ends, up
from relaxations.check.runs.statement import Piece
from relaxations.check.runs.terms import Terms, Values, rate_of

__all__ = ["Interval", "Modulation", "intervals_of", "solved"]

_DOUBT = 50  # a coefficient known within less than one part of it counts as known well

Modulation = tuple[int, int, int, int, int]
"""Experiment, state, sample at the end of an interval, a and b."""


@dataclass(frozen=True)
class Function:
    """A function during an interval: ``mid + sum of slopes times (states - their middles)``, and its moment.

    Parameters
    ----------
    slopes
        For each state, in units.
    """

    mid: int
    slopes: dict[int, int]
    radius: int
    moment: Range


@dataclass(frozen=True)
class Interval:
    """What is known of an interval: the states, the moments of their rates times h, and the functions of these.

    A function is None where nothing is known of it.
    """

    middles: tuple[int, ...]
    ranges: tuple[Range, ...]
    turns: tuple[Range, ...]
    functions: tuple[tuple[Function | None, ...], ...]


def intervals_of(
    terms: Terms, values: Values, products: Sequence[Range], tubes: Sequence[Tube], piece: Piece, h: Fraction
) -> list[Interval]:
    """Return what is known of each interval of an experiment."""
    found = []
    for now in range(1, piece.count):
        ranges = tuple((tube.least[now - 1], tube.most[now - 1]) for tube in tubes)
        states = [symbol(*own, i) for i, own in enumerate(ranges)]
        forms = values.over(values.held(piece.exact, now), states)
        rates = [rate_of(own, forms, products) for own in terms.products]
        moments = []
        for i, rate in enumerate(terms.rate):
            own = scaled(rates[i] if rate is None else between(*ranges[rate]), h / 12)
            low, high = _wide(ranges[i], 8)
            moments.append((max(low, own.low), min(high, own.high)))
        turns = []
        for i, rate in enumerate(terms.rate):
            moment = _wide((rates[i].low, rates[i].high), 8) if rate is None else moments[rate]
            own = scaled(between(*moment), h)
            turns.append((own.low, own.high))
        functions = tuple(tuple(_function(forms[place], states, moments) for _, place in own) for own in terms.products)
        found.append(Interval(tuple(form.mid for form in states), ranges, tuple(turns), functions))
    return found


def _wide(ends: Range, parts: int) -> Range:
    """Return a part of the width of an interval, on both sides of zero."""
    low, high = ends
    if not (isinstance(low, int) and isinstance(high, int)):
        return low - high, high - low
    part = -(-(high - low) // parts)
    return -part, part


def _function(form: Form, states: Sequence[Form], moments: Sequence[Range]) -> Function | None:
    if not isinstance(form.radius, int):
        return None
    slopes, radius = {}, form.radius
    low, high = _wide((-radius, radius), 8)
    for i, slope in form.slopes.items():
        half = states[i].slopes.get(i, 0)
        own = (slope << BITS) // half
        slopes[i] = own
        # What the division leaves over is less than a unit, times the deviation of the state.
        rest = (half >> BITS) + 1
        radius += rest
        ends = [own * end for end in moments[i] if isinstance(end, int)]
        if len(ends) < 2:
            return None
        low, high = low + (min(ends) >> BITS) - rest, high - (-max(ends) >> BITS) + rest
    width = _wide((form.low, form.high), 8)
    return Function(form.mid, slopes, radius, (max(low, width[0]), min(high, width[1])))


@dataclass
class _Sum:
    """A sum of values of states at samples times whole numbers, and of a number between two ends."""

    at: dict[tuple[int, int, int], int] = field(default_factory=dict)
    low: End = 0
    high: End = 0

    def add(self, place: tuple[int, int, int], factor: int) -> None:
        self.at[place] = self.at.get(place, 0) + factor

    def within(self, ends: Range, factor: int) -> None:
        """Add a number between two ends, times a factor."""
        if not factor:
            return
        low, high = ends
        if not (isinstance(low, int) and isinstance(high, int)):
            self.low, self.high = -inf, inf
        elif isinstance(self.low, int) and isinstance(self.high, int):
            a, b = low * factor, high * factor
            self.low, self.high = self.low + min(a, b), self.high + max(a, b)

    def plus(self, other: _Sum, factor: int) -> None:
        for place, own in other.at.items():
            self.add(place, own * factor)
        self.within((other.low, other.high), factor)

    def range(self, tubes: Sequence[Sequence[Tube]]) -> Range:
        """Return the ends of the sum."""
        total = _Sum(low=self.low, high=self.high)
        for (e, i, k), factor in self.at.items():
            total.within((tubes[e][i].low[k], tubes[e][i].high[k]), factor)
        return total.low, total.high


def solved(
    target: int,
    modulation: Iterable[Modulation],
    terms: Terms,
    products: Sequence[Range],
    tubes: Sequence[Sequence[Tube]],
    known: Sequence[Sequence[Interval]],
    h: Fraction,
) -> Range | None:
    """Return what the sum of all intervals says of a coefficient; None where it says nothing.

    Raises nothing, whatever the modulating function is.
    """
    n, d, shift = h.numerator, h.denominator, 2 * BITS
    rest = _Sum()  # the left-hand side, less the linear parts; in units of 2**-(3 BITS)
    constant = [_Sum() for _ in products]  # of each coefficient; in units of 2**-BITS
    linear = [_Sum() for _ in products]  # in units of 2**-(2 BITS)
    around = [_Sum() for _ in products]  # its range, each interval by itself
    for e, i, now, a, b in modulation:
        own = known[e][now - 1]
        rest.add((e, i, now), 4 * n * d * b << shift)
        rest.add((e, i, now - 1), -4 * n * d * a << shift)
        _mean(rest, terms, own, e, i, now, h, -2 * d * (b - a) << shift)
        for (j, _), function in zip(terms.products[i], own.functions[i], strict=True):
            if function is None:
                return None
            constant[j].within((function.mid - function.radius, function.mid + function.radius), 2 * n * n * (a + b))
            constant[j].within(function.moment, 4 * n * n * (b - a))
            for z, slope in function.slopes.items():
                factor, middle = n * (a + b) * slope, own.middles[z]
                _mean(linear[j], terms, own, e, z, now, h, factor)
                linear[j].within((middle, middle), -2 * n * factor)
                low, high = own.ranges[z]
                around[j].within((low - middle, high - middle), 2 * n * factor)
    # Of each coefficient, the range of what multiplies it, and what remains of the linear part.
    ranges = list[Ends]()
    for j, product in enumerate(products):
        both, own_around = linear[j].range(tubes), around[j]
        part = _finite((max(both[0], own_around.low), min(both[1], own_around.high)))
        whole, ends = _finite((constant[j].low, constant[j].high)), _finite(product)
        if whole is None or part is None or ends is None:
            if linear[j].at or whole != (0, 0):
                return None
            ranges.append(whole)
        elif _DOUBT * (ends[1] - ends[0]) > 2 * max(map(abs, ends)):
            ranges.append((whole[0] + (part[0] >> BITS), whole[1] + up(part[1], BITS)))
        else:
            middle = sum(ends) >> 1
            rest.plus(linear[j], -middle)
            size = max(map(abs, part)) * max(ends[1] - middle, middle - ends[0])
            rest.within((-size, size), 1)
            ranges.append(whole)
    return _divided(target, rest.range(tubes), ranges, products)


def _finite(ends: Range) -> Ends | None:
    low, high = ends
    return (low, high) if isinstance(low, int) and isinstance(high, int) else None


def _mean(total: _Sum, terms: Terms, own: Interval, e: int, i: int, now: int, h: Fraction, factor: int) -> None:
    """Add the mean of a state over an interval, times ``2 h_n`` and a factor."""
    k, n, d = terms.integral[i], h.numerator, h.denominator
    if k is not None:
        total.add((e, k, now), 2 * d * factor)
        total.add((e, k, now - 1), -2 * d * factor)
    else:
        total.add((e, i, now), n * factor)
        total.add((e, i, now - 1), n * factor)
        total.within(own.turns[i], -2 * n * factor)


def _divided(target: int, rest: Range, ranges: Sequence[Ends], products: Sequence[Range]) -> Range | None:
    """Return the ends of a coefficient from ``sum of coefficients times ranges = rest``."""
    total = _Sum()
    total.within(rest, 1)
    for j, (factor, product) in enumerate(zip(ranges, products, strict=True)):
        if j != target and factor != (0, 0):
            ends = _finite(product)
            corners = [x * y << BITS for x in factor for y in ends] if ends else [-inf, inf]
            total.within((min(corners), max(corners)), -1)
    (low, high), found = ranges[target], _finite((total.low, total.high))
    if high < 0 and found:
        low, high, found = -high, -low, (-found[1], -found[0])
    if low <= 0 or not found:
        return None
    divisors = low << BITS, high << BITS
    return min(found[0] // by for by in divisors), max(-(-found[1] // by) for by in divisors)
