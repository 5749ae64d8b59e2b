"""The narrowing of a box without a free run as steps that the checker of certificates takes again.

The search proposes: its comparison values that bound the states, and the multipliers of its linear programs a
modulating function each. What the checker's own arithmetic proves of these (:mod:`relaxations.check.runs.narrowing`) is
what the next step begins with.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from itertools import product
from typing import Any

import numpy as np

from relaxations.algebra.affine_arithmetic import CENTRE
from relaxations.algebra.arrays import Array
from relaxations.algebra.intervals import Intervals
from relaxations.check.arithmetic import Unreadable
from relaxations.check.runs import narrowing as checked
from relaxations.check.runs.comparison import Cells, Tube
from relaxations.check.runs.fixed import ONE, below
from relaxations.check.runs.modulated import Modulation
from relaxations.check.runs.statement import Stated
from relaxations.check.runs.terms import Values
from relaxations.deadline import Progress
from smid.identification.inversion.comparison import States
from smid.identification.inversion.contraction import NOTHING, Multipliers
from smid.identification.inversion.integrals import CHANGE
from smid.identification.inversion.narrowing import SLICES, TRIES, Narrowed, Narrowing

__all__ = ["Steps", "outwards"]

_ROUNDS = 12
_PASSES = 3  # comparisons of a round
_WORTH = 0.02  # a round takes at least this share of a width
_GAIN = 0.02  # a value takes at least this share of what is known of a state
_BACK = (0.02, 0.2, 0.5)  # shares of a gain that are given up, as the checker's cells are others
_BITS = 26  # of the largest number of a modulating function
_POINTS = 3

Place = tuple[int, int, int]
"""Experiment, state, interval."""


class Steps:
    """Steps that narrow a box, as the file states them.

    Attributes
    ----------
    content
        The steps; none where nothing is gained.
    known
        What they prove.
    """

    def __init__(self, narrowing: Narrowing | None, stated: Stated, say: Progress) -> None:
        self.content: list[dict[str, Any]] = []
        self.known = checked.Narrowed.of(stated)
        if narrowing is None or any(stated.first[name] != 1 for name in stated.rates):
            return
        places = _matched(narrowing, stated)
        if places is None:
            return
        try:
            self._all(narrowing, places, say)
        except Unreadable:  # the record is too long for the checker
            self.content, self.known = [], checked.Narrowed.of(stated)

    def _all(self, narrowing: Narrowing, places: tuple[int, ...], say: Progress) -> None:
        rounds = _Rounds(narrowing, places, self.known, self.content)
        rounds.take(_ROUNDS, say)
        if rounds.shave(say):
            rounds.take(_ROUNDS, say)


class _Rounds:
    """Rounds of comparisons and bounds, written down."""

    def __init__(
        self, narrowing: Narrowing, places: tuple[int, ...], known: checked.Narrowed, content: list[dict[str, Any]]
    ) -> None:
        self._narrowing, self._places, self._known, self._content = narrowing, places, known, content
        self._work = known.stated.work
        self._enough = self._work.left // 2

    def take(self, most: int, say: Progress) -> None:
        """Take rounds until nothing is left, or no more is gained."""
        for _ in range(most):
            before = self._widths()
            self._compare()
            if not self._known.empty:
                self._bound()
            say(f"certificate: {len(self._content)} steps of narrowing")
            if self._known.empty or self._work.left < self._enough or np.all(self._widths() >= (1 - _WORTH) * before):
                return

    def shave(self, say: Progress) -> bool:
        """Cut off slices that are proven empty; return whether there are any."""
        count = len(self._content)
        for k, side in product(range(len(self._known.box)), (0, 1)):
            for share in SLICES:
                while self._shaved(k, side, share):
                    say(f"certificate: {len(self._content)} steps of narrowing")
        return len(self._content) > count

    def _shaved(self, k: int, side: int, share: float) -> bool:
        if self._known.empty or self._work.left < self._enough:
            return False
        cut = self._narrowing.empty_slice(self._found(), k, side, share)
        if cut is None:
            return False
        value, sign = below(Fraction(cut)), 1 if side else -1
        part, steps = self._known.cut(k, value, sign), list[dict[str, Any]]()
        _Rounds(self._narrowing, self._places, part, steps).take(TRIES, lambda _: None)
        if not part.empty:
            return False
        self._content.append({"cut": [k, _text(cut), sign], "steps": steps})
        self._known.take_over(self._known.cut(k, value, -sign))
        return True

    def _widths(self) -> Array:
        return np.array([float(high - low) for low, high in (*self._known.box, *self._known.products)])

    def _found(self) -> Narrowed:
        """Return what is known in floats, rounded outwards."""
        known = self._known
        box = np.array([[outwards(low, -1), outwards(high, 1)] for low, high in known.box])
        own = [known.products[k] for k in self._places]
        products = Intervals(
            np.array([outwards(low, -1) for low, _ in own]), np.array([outwards(high, 1) for _, high in own])
        )
        return Narrowed(box, products, tuple(map(_states, known.tubes)))

    def _compare(self) -> None:
        """Bound the states, until no more is gained."""
        for number in range(_PASSES):
            found, gained = self._found(), False
            for e, (compare, states) in enumerate(zip(self._narrowing.comparisons, found.states, strict=True)):
                better = compare(found.box, found.products, states, 1)
                for i, own in enumerate(self._known.stated.terms.products):
                    if not own or self._known.empty:
                        continue
                    edges = compare.edges(i, found.box, states.at)
                    upwards = self._known.cells(e, i, [below(Fraction(edge)) for edge in edges])
                    upper = _proven(upwards, better.at.upper[i], 1)
                    downwards = upwards.mirrored()
                    lower = _proven(downwards, -better.at.lower[i], -1)
                    if number and not upper and not lower:
                        continue
                    gained = True
                    self._known.compared(e, i, downwards)
                    texts = [_text(edge) for edge in edges]
                    self._content.append({"compare": [e, i], "edges": texts, "upper": upper, "lower": lower})
            if not gained:
                return

    def _bound(self) -> None:
        """Bound the coefficients."""
        count = len(self._known.box)
        result = self._narrowing.contraction(self._found(), range(count, count + len(self._places)))
        known, sides = self._known.intervals(), list[list[Any]]()
        for proof in result.proof if result else ():
            modulation = self._modulation(proof)
            # What proves that nothing is left may show at any coefficient.
            for target in self._places if proof.unknown == NOTHING else (self._places[proof.unknown - count],):
                before = self._known.products[target]
                self._known.bound(target, modulation, known)
                if _width(self._known.products[target]) < (1 - _GAIN) * _width(before):
                    sides.append([target, [number for own in modulation for number in own]])
                else:
                    self._known.products[target] = before
        if sides:
            self._known.relate()
            self._content.append({"bound": sides})

    def _modulation(self, proof: Multipliers) -> list[Modulation]:
        """Return the modulating function that the multipliers of single rows add up to."""
        h, mean, turn = float(self._known.stated.interval), dict[Place, float](), dict[Place, float]()
        for (e, i, begin, end), value in zip(proof.sources.tolist(), proof.values.tolist(), strict=True):
            if end == CHANGE:
                turn[e, i, begin] = turn.get((e, i, begin), 0.0) + 0.5 * h * value
            else:
                for k in range(begin, end):
                    mean[e, i, k] = mean.get((e, i, k), 0.0) + value
        ends = {
            key: (mean.get(key, 0.0) + turn.get(key, 0.0), mean.get(key, 0.0) - turn.get(key, 0.0))
            for key in sorted(mean.keys() | turn.keys())
        }
        largest = max((abs(x) for own in ends.values() for x in own), default=0.0)
        if not largest:
            return []
        shift = _BITS - math.frexp(largest)[1]
        whole = [(key, round(math.ldexp(a, shift)), round(math.ldexp(b, shift))) for key, (a, b) in ends.items()]
        return [(e, i, k + 1, a, b) for (e, i, k), a, b in whole if a or b]


def _matched(narrowing: Narrowing, stated: Stated) -> tuple[int, ...] | None:
    """Return which coefficient of the checker each one of the search is, by their values; None where one is none."""
    rng, count = np.random.default_rng(0), len(stated.parameters)
    lower, upper = np.array([(outwards(low, -1), outwards(high, 1)) for low, high in stated.box[:count]]).T
    points = lower + (upper - lower) * rng.uniform(0.2, 0.8, (_POINTS, count))
    theirs = np.array([_checked_at(stated, point) for point in points])
    ours = np.array([narrowing.terms.values.affine(np.column_stack([p, p]))[:, CENTRE] for p in points])
    found = []
    for own in ours.T:
        (equal,) = np.nonzero(np.all(np.isclose(theirs.T, own, rtol=1e-9), axis=1))
        if len(equal) != 1:
            return None
        found.append(int(equal[0]))
    return tuple(found)


def _checked_at(stated: Stated, point: Array) -> list[float]:
    box = [(units, units) for units in (below(Fraction(x)) for x in point.tolist())]
    values = Values(stated.terms, box, stated.work)
    return [values.coefficient(own)[0] / ONE for own in stated.terms.coefficients]


def _width(ends: tuple[float, float]) -> float:
    return ends[1] - ends[0]


def _proven(cells: Cells, values: Array, sign: int) -> list[Any]:
    """Take over what is proven of values that bound a state from above, and return it with the sign of the state."""
    found: list[Any] = []
    for k, value in enumerate(values.tolist()):
        high, low = outwards(cells.high[k], 1), outwards(cells.low[k], -1)
        gain = high - value
        if not (math.isfinite(value) and gain > _GAIN * (high - low if high - low < math.inf else 0.0)):
            continue
        for back in _BACK:
            step = back * (gain if gain < math.inf else abs(value))
            # In few digits.
            unit = 2.0 ** math.floor(math.log2(step)) if step > 0 else 0.0
            tried = math.ceil((value + step) / unit) * unit if unit else value
            units = below(Fraction(sign * tried)) * sign
            if tried < high and cells.is_impossible(k, units):
                cells.high[k] = units
                found += [k, _text(sign * tried)]
                break
    return found


def _states(tubes: Sequence[Tube]) -> States:
    """Return the states of an experiment in floats, rounded outwards."""

    def ends(low: str, high: str) -> Intervals:
        pairs = ((low, -1), (high, 1))
        return Intervals(
            *(np.array([[outwards(x, side) for x in getattr(t, name)] for t in tubes]) for name, side in pairs)
        )

    return States(ends("low", "high"), ends("least", "most"))


def _text(value: float) -> str:
    """Return a number in hexadecimal, without zeros at the end."""
    digits, exponent = value.hex().split("p")
    return f"{digits.rstrip('0').rstrip('.') if '.' in digits else digits}p{exponent}"


def outwards(end: int | float, side: int) -> float:
    """Return an end in units as a float, rounded outwards."""
    if not isinstance(end, int):
        return end
    nearest = end / ONE
    inside = Fraction(nearest) * ONE > end if side < 0 else Fraction(nearest) * ONE < end
    return math.nextafter(nearest, side * math.inf) if inside else nearest
