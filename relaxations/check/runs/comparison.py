r"""Bounds of a state along a record by comparison, for a box of the parameters of any size.

Over the box, the rate of a state v is at least a number on each of some cells of v, which the other states may not
leave either. So v stays above the least solution w of w' = these numbers that begins where v does, and \int v above
\int w. Therefore v cannot be V or more at a sample if the solution from V, forwards or backwards in time,

- is above what is known of v at a later or an earlier sample, or
- turns further than the state whose rate v is: x(j) - x(i) = \int v, and the difference is measured.

The file states V, and here one solution decides whether it is true. The lower ends are upper ends of the mirrored
record. Times and values are whole numbers of units. A solution is rounded to fall early, rise late, and be less.

Reference: W. Walter, "Differential and integral inequalities", Springer (1970), section 9.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

from relaxations.check.arithmetic import Work
from relaxations.check.runs.fixed import BITS, End

LONGEST = 64
"""Intervals of the longest window."""

_COST = 10  # of a cell that a solution is in


@dataclass
class Tube:
    """What is known of a state: at the samples, and in the intervals between them."""

    low: list[End]
    high: list[End]
    least: list[End]
    most: list[End]

    @property
    def empty(self) -> bool:
        """Return whether no state is so."""
        pairs = (*zip(self.low, self.high, strict=True), *zip(self.least, self.most, strict=True))
        return any(low > high for low, high in pairs)

    def copy(self) -> Tube:
        """Return what is known in lists of its own."""
        return Tube(list(self.low), list(self.high), list(self.least), list(self.most))

    def joined(self) -> None:
        """Bound the state in the intervals by its values at both ends: its rate does not change its sign there."""
        for k in range(len(self.least)):
            self.least[k] = max(self.least[k], min(self.low[k], self.low[k + 1]))
            self.most[k] = min(self.most[k], max(self.high[k], self.high[k + 1]))

    def integrated(self, rate: Tube, h: int) -> None:
        """Bound the state in the intervals by its rate, another state; h is the interval in units, rounded up."""
        for k in range(len(self.least)):
            fall, rise = _moved(min(rate.least[k], 0), h, up=False), _moved(max(rate.most[k], 0), h, up=True)
            self.least[k] = max(self.least[k], self.low[k] + fall, self.low[k + 1] - rise)
            self.most[k] = min(self.most[k], self.high[k] + rise, self.high[k + 1] - fall)


def _moved(rate: End, h: int, up: bool) -> End:
    if not isinstance(rate, int):
        return rate
    return -(-rate * h >> BITS) if up else rate * h >> BITS


@dataclass
class Cells:
    """A state seen from below: the edges of its cells in each interval, and the ends of its rate in these.

    Parameters
    ----------
    low, high
        What is known of the state at the samples.
    turned_low, turned_high
        The same of the state whose rate it is; infinite if there is none.
    """

    edges: list[list[End]]
    least: list[list[End]]
    most: list[list[End]]
    low: list[End]
    high: list[End]
    turned_low: list[End]
    turned_high: list[End]
    h: int
    work: Work

    def mirrored(self) -> Cells:
        """Return the state with the opposite sign."""
        return Cells(
            [[-x for x in reversed(own)] for own in self.edges],
            [[-x for x in reversed(own)] for own in self.most],
            [[-x for x in reversed(own)] for own in self.least],
            [-x for x in self.high],
            [-x for x in self.low],
            [-x for x in self.turned_high],
            [-x for x in self.turned_low],
            self.h,
            self.work,
        )

    def _after(self, cell: int, begin: End, forwards: bool) -> tuple[End, End]:
        """Return how low the state may be at the other end of an interval, and its integral."""
        # Backwards in time a state rises by no more than its largest rate, less.
        rates: Sequence[End] = self.least[cell] if forwards else [-rate for rate in self.most[cell]]
        self.work.spend(_COST * len(rates))
        return flow(self.edges[cell], rates, begin, self.h)

    def is_impossible(self, k: int, value: int) -> bool:
        """Return whether the state cannot be a value or above at a sample."""
        if value > self.high[k]:
            return True
        for forwards in (True, False):
            w: End = value
            total: End = 0
            for m in range(1, LONGEST + 1):
                to = k + m if forwards else k - m
                if not 0 <= to < len(self.low):
                    break
                w, turned = self._after(to - 1 if forwards else to, w, forwards)
                total += turned
                late, early = (to, k) if forwards else (k, to)
                if w > self.high[to] or total > self.turned_high[late] - self.turned_low[early]:
                    return True
                if not w > self.low[to]:
                    break
        return False

    def raised(self) -> None:
        """Raise the lower ends from sample to sample, forwards and then backwards."""
        n = len(self.low)
        for k in range(n - 1):
            self.low[k + 1] = max(self.low[k + 1], self._after(k, self.low[k], True)[0])
        for k in range(n - 2, -1, -1):
            self.low[k] = max(self.low[k], self._after(k, self.low[k + 1], False)[0])

    def stays_above(self) -> list[End]:
        """Return what the state stays above in each interval: a least solution does not turn around."""
        found: list[End] = []
        for k in range(len(self.edges)):
            after, before = self._after(k, self.low[k], True)[0], self._after(k, self.low[k + 1], False)[0]
            found.append(max(min(self.low[k], after), min(self.low[k + 1], before)))
        return found


def flow(edges: Sequence[End], rates: Sequence[End], begin: End, time: int) -> tuple[End, End]:
    """Return where the least solution in some cells is after a time, and its integral, both rounded downwards.

    Parameters
    ----------
    edges, rates
        Of c cells: c + 1, and c. The state is never outside, so a solution stops at the last edges.
    """
    last = len(rates)
    w, left, total = max(begin, edges[0]), time, 0
    cell = last if w >= edges[last] else bisect_right(edges, w) - 1
    w = min(w, edges[last])
    if not isinstance(w, int):
        return w, w
    while left > 0:
        # At an edge: down where the rate below leads down, up where the one above leads up.
        if w == edges[cell] and cell > 0 and rates[cell - 1] < 0:
            cell -= 1
        elif cell == last or (w == edges[cell] and rates[cell] <= 0):
            total += w * left >> BITS
            break
        rate, falls = rates[cell], rates[cell] < 0
        target = edges[cell] if falls else edges[cell + 1]
        if not isinstance(rate, int):
            if not isinstance(target, int):
                return -inf, -inf
            w = target
            continue
        # It arrives early where it falls, and late where it rises.
        if isinstance(target, int) and rate:
            way = (target - w) << BITS
            taken = min(way // rate if falls else -(-way // rate), left)
        else:
            taken = left
        if taken < left:
            assert isinstance(target, int)
            after = target
            cell += not falls
        else:
            after = w + (rate * left >> BITS)
            if isinstance(target, int):
                after = max(after, target) if falls else min(after, target)
        total += (w + after) * taken >> (BITS + 1)
        w, left = after, left - taken
    return w, total
