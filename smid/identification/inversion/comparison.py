r"""Bounds of the states along a record by comparison, over boxes of the parameters of any size.

Between two samples the inputs are held. Where the other states and the parameters lie in boxes, the rate of a state v
lies above a function of v, constant on each of some cells. By the theorem of comparison v then stays above the least
solution w of w' = that function which begins where v does, or below it, and \int v above \int w. So v cannot be above V
at a sample if the solution from V, forwards or backwards in time,

- is above what is known of v at a later or an earlier sample, or
- turns further than the state whose rate v is: x(j) - x(i) = \int v, and the difference is measured.

If V is impossible, so is any larger value, and the bound is found by bisection. No run over the box is needed: each
sample is a start. Everything is computed for the upper bounds; the lower ones are those of the mirrored record.

A rate that reads no other state has one sign during an interval, where the input is held. So such a state does not
leave the values at both ends (as in :mod:`.both_ends`).

Reference: W. Walter, "Differential and integral inequalities", Springer (1970), section 9.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from relaxations.algebra.arrays import Array, Index
from relaxations.algebra.ball_arithmetic import EPSILON
from relaxations.algebra.compiled import compiling
from relaxations.algebra.intervals import Intervals
from smid.identification.inversion.terms import Terms

__all__ = ["Comparison", "States"]

LONGEST = 64
"""Intervals of the longest window: over longer ones the bounds of the rates outweigh what is measured."""

_PASSES = 3
_PARTS = 6  # cells of a state's range of an interval, beside those that follow
_OCTAVES = 24  # powers of two, at which a wide range is cut
_KINK = 1e-9  # a cell in which the rate jumps is as narrow, as a share of its distance from zero
_FINE = 0.01  # share of its range to which a bound is found
_FARTHEST = 1e6  # times the scale of a state: bounds beyond are not looked for
_MOST_KINKS = 200  # cells that may hold a jump

compiled = compiling()


@dataclass(frozen=True, eq=False)
class States:
    """What is known of the states along an experiment.

    Parameters
    ----------
    at
        At the samples, shape (states, n).
    during
        In the intervals between them, shape (states, n - 1).
    """

    at: Intervals
    during: Intervals

    @property
    def empty(self) -> bool:
        """Whether no run has such states."""
        return self.at.empty or self.during.empty


@compiled
def _flow(edges: Array, rates: Array, begin: float, length: float) -> tuple[float, float]:
    """Return where the least solution in some cells is after a time, and its integral, rounded downwards.

    Parameters
    ----------
    edges, rates
        Of c cells, shape (c + 1,) and (c,). The state is never outside, so a solution stops at the last edges.
    """
    count = rates.shape[0]
    w, left, total, size = float(max(begin, edges[0])), length, 0.0, 0.0
    if w >= edges[count]:
        w, cell = float(edges[count]), count
    else:
        cell = int(np.searchsorted(edges, w, side="right")) - 1
    fastest = 0.0
    while left > 0.0:
        # At an edge: down where the rate below leads down, up where both lead up.
        if w == edges[cell] and cell > 0 and rates[cell - 1] < 0.0:
            cell -= 1
        elif cell == count or (w == edges[cell] and rates[cell] <= 0.0 and (cell == 0 or rates[cell - 1] >= 0.0)):
            total += w * left
            size += abs(w) * left
            break
        rate = float(rates[cell])
        if rate == -math.inf:
            w = float(edges[cell])
            if w == -math.inf:
                return -math.inf, -math.inf
            continue
        target = float(edges[cell] if rate < 0.0 else edges[cell + 1])
        # It arrives early where it falls, and late where it rises.
        taken = math.inf if rate == 0.0 else (target - w) / rate
        taken *= 1.0 - 4.0 * EPSILON if rate < 0.0 else 1.0 + 4.0 * EPSILON
        fastest = max(fastest, abs(rate))
        if taken >= left:
            after = w + rate * left
            after = max(after, target) if rate < 0.0 else min(after, target)
            total += 0.5 * (w + after) * left
            size += (abs(w) + abs(after)) * left
            w = after
            break
        total += 0.5 * (w + target) * taken
        size += (abs(w) + abs(target)) * taken
        w, left = target, left - taken
        if rate > 0.0:
            cell += 1
    slack = 16.0 * EPSILON * (count + 2) * (abs(w) + fastest * length)
    return w - slack, total - 16.0 * EPSILON * (count + 2) * size - slack * length


@compiled
def _is_impossible(
    k: int,
    value: float,
    cells: tuple[Index, Array, Array, Array],
    low: Array,
    high: Array,
    low_integral: Array,
    high_integral: Array,
    h: float,
) -> bool:
    """Return whether a state cannot be above a value at a sample."""
    starts, edges, least, most = cells
    n = low.shape[0]
    for direction in (1, -1):
        w, total = value, 0.0
        for m in range(1, LONGEST + 1):
            to = k + direction * m
            if not 0 <= to < n:
                break
            cell = to - 1 if direction > 0 else to
            own = slice(starts[cell], starts[cell + 1])
            # Backwards in time a state rises by no more than its largest rate, less.
            rates = least[own] if direction > 0 else -most[own]
            w, turned = _flow(edges[starts[cell] + cell : starts[cell + 1] + cell + 1], rates, w, h)
            total += turned
            if w > high[to]:
                return True
            late, early = (to, k) if direction > 0 else (k, to)
            farthest = high_integral[late] - low_integral[early]
            if total - 4.0 * EPSILON * m * abs(total) > farthest + 2.0 * EPSILON * abs(farthest):
                return True
            if not w > low[to]:
                break
    return False


@compiled
def _lowered(
    cells: tuple[Index, Array, Array, Array],
    low: Array,
    high: Array,
    low_integral: Array,
    high_integral: Array,
    h: float,
    scale: float,
    kinks: Array,
) -> None:
    """Lower the upper ends of a state at all samples, to where its rate jumps and then by bisection."""
    for k in range(low.shape[0]):
        width = high[k] - low[k] if high[k] - low[k] < math.inf else scale
        top, bottom = min(high[k], _FARTHEST * scale), max(low[k], -_FARTHEST * scale)
        # Most often there is nothing to gain.
        first = top - _FINE * width if top == high[k] else top
        if not (bottom < first and _is_impossible(k, first, cells, low, high, low_integral, high_integral, h)):
            continue
        top = first
        for kink in kinks[::-1]:
            beyond = kink + 1e-3 * _KINK * abs(kink)
            if bottom < beyond < top:
                if not _is_impossible(k, beyond, cells, low, high, low_integral, high_integral, h):
                    bottom = beyond
                    break
                top = beyond
        if _is_impossible(k, bottom, cells, low, high, low_integral, high_integral, h):
            high[k] = math.nextafter(bottom, -math.inf)
            continue
        while top - bottom > _FINE * width:
            middle = 0.5 * top + 0.5 * bottom
            if _is_impossible(k, middle, cells, low, high, low_integral, high_integral, h):
                top = middle
            else:
                bottom = middle
        high[k] = top


@compiled
def _raised(cells: tuple[Index, Array, Array, Array], low: Array, h: float) -> None:
    """Raise the lower ends from sample to sample, forwards and then backwards."""
    starts, edges, least, most = cells
    n = low.shape[0]
    for k in range(n - 1):
        own = edges[starts[k] + k : starts[k + 1] + k + 1]
        low[k + 1] = max(low[k + 1], _flow(own, least[starts[k] : starts[k + 1]], low[k], h)[0])
    for k in range(n - 2, -1, -1):
        own = edges[starts[k] + k : starts[k + 1] + k + 1]
        low[k] = max(low[k], _flow(own, -most[starts[k] : starts[k + 1]], low[k + 1], h)[0])


@compiled
def _stayed(cells: tuple[Index, Array, Array, Array], low: Array, h: float, found: Array) -> None:
    """Raise the lower ends of a state during intervals: a solution does not turn around."""
    starts, edges, least, most = cells
    for k in range(found.shape[0]):
        own = edges[starts[k] + k : starts[k + 1] + k + 1]
        after = _flow(own, least[starts[k] : starts[k + 1]], low[k], h)[0]
        before = _flow(own, -most[starts[k] : starts[k + 1]], low[k + 1], h)[0]
        found[k] = max(found[k], min(low[k], after), min(low[k + 1], before))


@compiled
def _cut(low: Array, high: Array, kinks: Array, scale: float, starts: Index, edges: Array) -> None:
    """Write the edges of the cells of each interval: in equal parts, at powers of two, and around jumps of the rate."""
    own, place = np.empty(edges.shape[0] // low.shape[0]), 0
    for k in range(low.shape[0]):
        a, b = low[k], high[k]
        own[0], own[1], count = a, b, 2
        for kink in kinks:
            if a < kink < b:
                own[count] = kink
                count += 1
        if b - a < math.inf:
            for part in range(1, _PARTS):
                own[count] = a + (b - a) * part / _PARTS
                count += 1
        size, finest = scale * 2.0 ** (_OCTAVES // 2), min(b - a, scale) / 64.0
        for _ in range(_OCTAVES):
            for value in (-size, size):
                if a < value < b and size > finest:
                    own[count] = value
                    count += 1
            size *= 0.5
        ordered = np.unique(own[:count])
        if ordered.shape[0] == 1:
            ordered = np.array([a, b])
        starts[k + 1] = starts[k] + ordered.shape[0] - 1
        edges[place : place + ordered.shape[0]] = ordered
        place += ordered.shape[0]


@compiled
def _mirrored(starts: Index, values: Array, further: int) -> Array:
    """Return the values of each interval in opposite order, with opposite signs."""
    found = np.empty_like(values)
    for k in range(starts.shape[0] - 1):
        own = slice(starts[k] + further * k, starts[k + 1] + further * (k + 1))
        found[own] = -values[own][::-1]
    return found


class Comparison:
    """Bounds of the states of one experiment, for boxes of the parameters.

    Parameters
    ----------
    data
        Of the channels that the rates read, shape (channels, n).
    h
        The sampling time.
    """

    def __init__(self, terms: Terms, data: Array, h: float) -> None:
        self._terms, self._data, self._h = terms, data, h
        self._jumps: dict[int, Array] = {}

    def __call__(self, box: Array, coefficients: Intervals, states: States, passes: int = _PASSES) -> States:
        """Return narrower bounds of the states; empty ones where no parameters in the box explain these.

        Parameters
        ----------
        box
            Of the parameters, shape (parameters, 2).
        coefficients
            Their values over the box.
        """
        at, during = (Intervals(own.lower.copy(), own.upper.copy()) for own in (states.at, states.during))
        for _ in range(passes):
            for i, own in enumerate(self._terms.rates):
                if own:
                    self._bounded(i, box, coefficients, at, during)
                if at.empty:
                    return States(at, during)
            for k, i in enumerate(self._terms.rate):
                if i >= 0:
                    _integrated(at, during, i, k, self._h)
        return States(at, during)

    def _bounded(self, i: int, box: Array, coefficients: Intervals, at: Intervals, during: Intervals) -> None:
        """Narrow the bounds of a state, in place."""
        low, high, n = at.lower[i], at.upper[i], at.lower.shape[1]
        scale = self._scale(i, at)
        if self._terms.alone[i]:
            during.lower[i] = np.maximum(during.lower[i], np.minimum(low[:-1], low[1:]))
            during.upper[i] = np.minimum(during.upper[i], np.maximum(high[:-1], high[1:]))
        kinks = self._kinks(i, box, scale)
        starts, edges = np.zeros(n, dtype=np.int64), np.empty((n - 1) * (2 * _OCTAVES + len(kinks) + _PARTS + 2))
        _cut(during.lower[i], during.upper[i], kinks, scale, starts, edges)
        edges = edges[: starts[-1] + n - 1]
        # The rates of the cells: the other states may be anywhere in the interval.
        interval = np.repeat(np.arange(n - 1), np.diff(starts))
        cells = np.stack([during.lower[:, interval].T, during.upper[:, interval].T], axis=2)
        place = np.arange(starts[-1]) + interval
        cells[:, i, 0], cells[:, i, 1] = edges[place], edges[place + 1]
        rates = self._rates(i, box, coefficients, cells, interval + 1)
        forwards = starts, edges, rates.lower, rates.upper
        backwards = (
            starts,
            _mirrored(starts, edges, 1),
            _mirrored(starts, rates.upper, 0),
            _mirrored(starts, rates.lower, 0),
        )
        integral = self._terms.integral[i]
        free = np.full(n, np.inf)
        least, most = (at.lower[integral], at.upper[integral]) if integral >= 0 else (-free, free)
        # Upper ends, and the lower ones of the mirrored record.
        _lowered(forwards, low, high, least, most, self._h, scale, kinks)
        mirrored_low, mirrored_high = -high, -low
        _lowered(backwards, mirrored_low, mirrored_high, -most, -least, self._h, scale, -kinks[::-1])
        _raised(backwards, mirrored_low, self._h)
        low[:], high[:] = -mirrored_high, -mirrored_low
        _raised(forwards, low, self._h)
        stays_above, stays_below = during.lower[i].copy(), -during.upper[i]
        _stayed(forwards, low, self._h, stays_above)
        _stayed(backwards, -high, self._h, stays_below)
        during.lower[i], during.upper[i] = stays_above, -stays_below

    def _rates(self, i: int, box: Array, coefficients: Intervals, cells: Array, now: Index) -> Intervals:
        functions, _ = self._terms.functions.over(box, cells, now, self._data, self._terms.count)
        total = Intervals.of(np.zeros(len(cells)))
        for term in self._terms.rates[i]:
            total = total + functions[:, term.function] * coefficients[term.coefficient]
        return total

    def _scale(self, i: int, at: Intervals) -> float:
        """Return the size of a state: the largest one that is known at a sample, or measured as a mean."""
        k = self._terms.integral[i]
        ends = (at[k, 1:] - at[k, :-1]) / self._h if k >= 0 else at[i]
        known = ends.magnitude[np.isfinite(ends.magnitude)]
        return float(known.max(initial=0.0)) or 1.0

    def edges(self, i: int, box: Array, at: Intervals) -> list[float]:
        """Return edges of cells that follow from the rate of a state and its size."""
        scale = self._scale(i, at)
        sizes = scale * 2.0 ** (_OCTAVES // 2 - np.arange(float(_OCTAVES)))
        return sorted({*self._kinks(i, box, scale).tolist(), *sizes.tolist(), *(-sizes).tolist()})

    def _kinks(self, i: int, box: Array, scale: float) -> Array:
        """Return the edges of narrow cells in which a rate jumps, wherever the other states are.

        They are found once: they only place the cells.
        """
        if i not in self._jumps:
            self._jumps[i] = self._found_kinks(i, box, scale)
        return self._jumps[i]

    def _found_kinks(self, i: int, box: Array, scale: float) -> Array:
        sizes = scale * 2.0 ** (_OCTAVES // 2 - np.arange(_OCTAVES + 1.0))
        edges = np.concatenate([[-np.inf], -sizes, sizes[::-1], [np.inf]])
        waiting = np.column_stack([edges[:-1], edges[1:]])
        found: list[Array] = []
        while 0 < len(waiting) <= _MOST_KINKS:
            cells = np.full((len(waiting), len(self._terms.states), 2), (-np.inf, np.inf))
            cells[:, i] = waiting
            now = np.ones(len(waiting), dtype=np.int64)
            _, jumps = self._terms.functions.over(box, cells, now, self._data, self._terms.count)
            waiting = waiting[jumps.any(axis=1) & np.isfinite(waiting).all(axis=1)]
            size = np.maximum(np.abs(waiting).max(axis=1, initial=0.0), 1e-3 * scale)
            narrow = waiting[:, 1] - waiting[:, 0] <= _KINK * size
            found.append(waiting[narrow].ravel())
            wide = waiting[~narrow]
            middle = wide.mean(axis=1)
            waiting = np.concatenate([np.column_stack([wide[:, 0], middle]), np.column_stack([middle, wide[:, 1]])])
        return np.unique(np.concatenate(found)) if found else np.zeros(0)


def _integrated(at: Intervals, during: Intervals, i: int, k: int, h: float) -> None:
    """Bound a state in the intervals by its rate, another state."""
    moved, first, last = during[i] * h, at[k, :-1], at[k, 1:]
    falls, rises = Intervals.of(np.minimum(moved.lower, 0.0)), Intervals.of(np.maximum(moved.upper, 0.0))
    lower, upper = (
        np.maximum((first + falls).lower, (last - rises).lower),
        np.minimum((first + rises).upper, (last - falls).upper),
    )
    during.lower[k], during.upper[k] = np.maximum(during.lower[k], lower), np.minimum(during.upper[k], upper)
