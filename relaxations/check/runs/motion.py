"""Rates integrated from one sample to the next, the remainder of every step enclosed.

*A box.* While x stays in a box X, its rates lie in f(X), so x lies in ``x0 + [0, s] f(X)`` after a time s. Where that
lies inside of X for all s up to h, x does not leave X. The box is found by trial. A rate that reads its own state alone
has one sign in the whole interval: where it is zero, the state rests. So such a state is never outside its values at
both ends of the interval, where these are known.

*The step.* With the Taylor coefficients ``c_k(x)`` of the solution that begins at x, for any q

    x(h)  in  c_0(x0) + h c_1(x0) + ... + h^(q-1) c_(q-1)(x0) + h^q c_q(X),

as the remainder is the last coefficient at some time of the step. The narrowest of these is taken. The coefficients
follow from each other: those of a function y = g(a) from ``y' = g'(a) a'``, where g' is an operation of the tape, too.

*Kinks and jumps.* Where Abs, Max or Min bend within X, the rate is Lipschitz, and its derivative lies between both
slopes: q is at most 2. Where a sign, a floor or a condition jumps within X, the rate takes any value between those of
both sides (Filippov), and q is 1. The sign of a number that may be zero is any number from -1 to 1.

Reference: Nedialkov, Jackson and Corliss, Validated solutions of initial value problems for ordinary differential
equations, Applied Mathematics and Computation 105 (1999).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from fractions import Fraction
from functools import reduce

from relaxations.check.arithmetic import Work
from relaxations.check.runs.affine import (
    UNKNOWN,
    Form,
    add,
    between,
    floor,
    gathered,
    hull,
    multiply,
    narrowed,
    scaled,
    scattered,
)
from relaxations.check.runs.fixed import ONE
from relaxations.check.runs.operations import cost_of, operate
from relaxations.check.runs.tape import Entry, Tape

ORDER = 6
"""The largest q."""

HALVINGS = 6
"""A step without a box is halved at most so many times."""

_TRIALS = 8  # of a box
_ZERO = between(0, 0)

States = list[Form]


class Motion:
    """The states during one interval between two samples.

    Parameters
    ----------
    forms
        Of all operations that do not move.
    symbols
        So many symbols are those of unknowns; further ones may be gathered.
    """

    def __init__(self, tape: Tape, forms: Sequence[Form], symbols: int, work: Work) -> None:
        self._tape, self._forms, self.symbols, self._work = tape, forms, symbols, work
        self._plain = [between(form.low, form.high) for form in forms]
        self._moving = [k for k, read in enumerate(tape.moved) if read]
        self._cost = sum(cost_of(tape.entries[k]) for k in self._moving)

    def after(self, begin: States, interval: Fraction, steps: int) -> States | None:
        """Return the states at the end of the interval; None where nothing is known of them."""
        states: States | None = begin
        for _ in range(steps):
            states = self._step(states, interval / steps, HALVINGS) if states else None
        return states

    def mean_rates(self, begin: States, end: States, interval: Fraction) -> States | None:
        """Return the averages of the rates over the interval; None where nothing is known of them."""
        alone = [self._tape.moved[rate] <= {k} for k, rate in enumerate(self._tape.rates)]
        box = begin if all(alone) else self._box(begin, interval)
        return box and self._rates(
            [
                between(min(x.low, y.low), max(x.high, y.high)) if own else within
                for x, y, within, own in zip(begin, end, box, alone, strict=True)
            ]
        )

    def _step(self, states: States, h: Fraction, halvings: int) -> States | None:
        start = [gathered(state, self.symbols, -1 - k) for k, state in enumerate(states)]
        box = self._box(start, h)
        if box is None:
            half = self._step(states, h / 2, halvings - 1) if halvings else None
            return half and self._step(half, h / 2, halvings - 1)
        # What remains is small, so beyond the rates it need not be known how it depends on the unknowns.
        plain = [between(within.low, within.high) for within in box]
        left, rates = self._coefficients(plain, ORDER, self._plain), self._rates(box)
        after = []
        for known, further, rate, within in zip(
            self._coefficients(start, ORDER - 1, self._forms), left, rates, box, strict=True
        ):
            found, total = UNKNOWN, _ZERO
            for q in range(1, ORDER + 1):
                total = add(total, scaled(known[q - 1], h ** (q - 1)))
                one = add(total, scaled(further[q] if q > 1 else rate, h**q))
                found = one if one.radius < found.radius else found
            after.append(narrowed(found, within.low, within.high))
        for k, state in enumerate(states):
            after = [scattered(own, self.symbols, -1 - k, state) for own in after]
        return after

    def _box(self, start: States, h: Fraction) -> States | None:
        """Return a box that the states do not leave during a step; None where none is found."""
        reached = self._reached(start, h)
        for _ in range(_TRIALS):
            if reached is None:
                return None
            wider = [(high - low) // 4 + 1 for low, high in reached]
            tried = [(low - more, high + more) for (low, high), more in zip(reached, wider, strict=True)]
            found = self._reached([add(x, between(*ends)) for x, ends in zip(start, tried, strict=True)], h)
            if found is None:
                return None
            both = list(zip(tried, found, strict=True))
            if all(low < fall and rise < high for (low, high), (fall, rise) in both):
                return [add(x, between(*ends)) for x, ends in zip(start, found, strict=True)]
            reached = found
        return None

    def _reached(self, states: States, h: Fraction) -> list[tuple[int, int]] | None:
        """Return how far the states fall and rise in a time, if their rates are as here; None if that is unknown."""
        found = list[tuple[int, int]]()
        for rate in self._rates(states):
            low, high = min(rate.low, 0), max(rate.high, 0)
            if not (isinstance(low, int) and isinstance(high, int)):
                return None
            found.append((h.numerator * low // h.denominator, -(-h.numerator * high // h.denominator)))
        return found

    def _rates(self, states: States) -> States:
        return [own[1] for own in self._coefficients(states, 1, self._forms)]

    def _coefficients(self, states: States, order: int, forms: Sequence[Form]) -> list[list[Form]]:
        """Return the Taylor coefficients of each state."""
        tape, values = self._tape, list(forms)
        found, table = [[state] for state in states], dict[int, list[Form]]()

        def at(place: int, i: int) -> Form:
            return table[place][i] if place in table else _ZERO if i else values[place]

        for k in self._moving:
            entry = tape.entries[k]
            values[k] = states[entry[1]] if entry[0] == "stage" else at_once(entry, values, tape)
            table[k] = [values[k]]
        for i in range(order):
            if i:
                for k in self._moving:
                    entry = tape.entries[k]
                    own = found[entry[1]][i] if entry[0] == "stage" else _coefficient(tape, k, i, at)
                    table[k].append(own)
            for own_found, rate in zip(found, tape.rates, strict=True):
                own_found.append(scaled(at(rate, i), Fraction(1, i + 1)))
            slopes = sum(len(table[k][i].slopes) for k in self._moving)
            self._work.spend((i + 1) * (self._cost + slopes))
        return found


def at_once(entry: Entry, values: list[Form], tape: Tape) -> Form:
    """Return the result of an operation; where it jumps, any number between both sides."""
    match entry:
        case ("sign", a):
            low, high = values[a].low, values[a].high
            return between(ONE if low > 0 else -ONE, -ONE if high < 0 else ONE)
        case ("floor", a):
            low, high = values[a].low, values[a].high
            return floor(between(low - 1, high))
        case ("choose", over, a, b, _) if tape.moved[over]:
            low, high = values[over].low, values[over].high
            return values[a] if low > 0 else values[b] if high < 0 else hull(values[a], values[b])
    return operate(entry, values, [])


def _coefficient(tape: Tape, place: int, i: int, at: Callable[[int, int], Form]) -> Form:
    """Return a further Taylor coefficient of an operation; unknown where there may be none."""
    match tape.entries[place]:
        case ("+", a, b):
            return add(at(a, i), at(b, i))
        case ("*", a, b):
            return _sum(_product(at(a, j), at(b, i - j)) for j in range(i + 1))
        case ("larger", a, b):
            one, other = at(a, 0), at(b, 0)
            if one.low >= other.high or other.low >= one.high:
                return at(a if one.low >= other.high else b, i)
            return hull(at(a, 1), at(b, 1)) if i == 1 else UNKNOWN
        case ("choose", over, a, b, strict):
            low, high, moved = at(over, 0).low, at(over, 0).high, tape.moved[over]
            if low > 0 or (low == 0 and not strict and not moved):
                return at(a, i)
            if high < 0 or (high == 0 and strict and not moved):
                return at(b, i)
            return UNKNOWN if moved else hull(at(a, i), at(b, i))
        case ("sign", a):
            return _ZERO if at(a, 0).low > 0 or at(a, 0).high < 0 else UNKNOWN
        case ("floor", a):
            return _ZERO if at(place, 0).low == at(place, 0).high else UNKNOWN
        case (_, a, *_) if place in tape.slopes:
            slope = tape.slopes[place]
            total = _sum(_times(_product(at(a, j), at(slope, i - j)), j) for j in range(1, i + 1))
            return scaled(total, Fraction(1, i)) if i > 1 else total
    return UNKNOWN


def _product(a: Form, b: Form) -> Form:
    return _ZERO if a is _ZERO or b is _ZERO else multiply(a, b)


def _times(a: Form, n: int) -> Form:
    return a if n == 1 or a is _ZERO else scaled(a, Fraction(n))


def _sum(terms: Iterable[Form]) -> Form:
    return reduce(add, (term for term in terms if term is not _ZERO), _ZERO)
