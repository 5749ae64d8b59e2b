"""Boxes that cover the feasible set: contracted and cut, until none reaches further than verified points.

One cover serves all ends. Only a box that reaches beyond the verified points can decide an end, so the one that
reaches furthest is next. It is contracted, and what is left is cut. Where its part beyond the verified points is small,
that part is cut off: it is often empty. Otherwise the box is halved along the unknown that narrows the enclosures most.
A box that reaches no further than the verified points, within the tolerance, is closed. So is one of which
smaller boxes would say no more, as what the rows leave open is no longer the box's but the integration's.

References
----------
Jaulin, Kieffer, Didrit and Walter, Applied Interval Analysis, Springer (2001), chapters 3 to 6.
Minoux, Accelerated greedy algorithms for maximizing submodular set functions, Optimization Techniques, Springer (1978).
"""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass, field
from functools import cached_property
from itertools import count

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.algebra.ball_arithmetic import TINY
from relaxations.deadline import check_time
from smid.identification.inversion.contraction import Contraction, Program, contracted
from smid.identification.inversion.frame import generic, middle_and_half
from smid.identification.inversion.outermost import near
from smid.identification.inversion.record import Group, Record
from smid.identification.inversion.rows import LINKS, STEPWISE

HEAVIEST = 5
"""Samples that are said to carry a proof."""

_PASSES = 8  # contractions of a box in a row
_WORTH = 0.1  # each takes at least this share of a width
_OUTER = 0.5  # a part beyond the verified points of at most this share of a box is cut off
_POINT = 1e-9  # share of its size that counts as width, where the verified points have none
_WIDE = 0.25  # a hidden state is shaved above this share of what is known of it beforehand
_SLICES = 8
_GAIN = 0.5  # an end that smaller boxes would move by less, as a share of the tolerance, is sharp
_ASPECT = 64.0  # no unknown that bends the runs is wider than another one, as a share of the first box, by more
_CLEARLY = 1.5  # times as much has to be said for an unknown to be halved that the runs are linear in
_MEASURED = 3  # halvings until every gain is measured again
_LINEAR = 0.1  # of what is known at a point: less is lost where an unknown is linear
_NARROW = 1e-13  # an unknown is not halved below this share of its size


@dataclass(eq=False)
class Box:
    """A part of the space of the unknowns, with what is proven of it.

    Parameters
    ----------
    share
        Of the first box, by the number of halvings.
    contractions
        One after the other; the last may prove that the box is empty.
    cut
        The unknown and the value where what is left is cut in two ``parts``.
    gains
        What halving an unknown would make the rows say more, as last measured of this box or a larger one.
    """

    lower: Array
    upper: Array
    share: float = 1.0
    contractions: list[Contraction] = field(default_factory=list)
    cut: tuple[int, float] | None = None
    parts: tuple[Box, ...] = ()
    gains: dict[int, float] = field(default_factory=dict)

    @property
    def left(self) -> tuple[Array, Array]:
        """The ends after the contractions."""
        last = self.contractions[-1] if self.contractions else self
        return last.lower, last.upper

    @property
    def empty(self) -> bool:
        """Whether nothing is left."""
        return bool(self.contractions) and self.contractions[-1].empty


class Cover:
    """Boxes that cover the feasible set of a record.

    Parameters
    ----------
    tolerance
        A box may reach so far beyond the verified points, as a share of the width between these.
    deepest_first
        Whether the smallest box is next, in place of the one that reaches furthest, while no point is verified: as
        fast where the set is empty, and `proven` then grows from the start. No unknown is left wide then.

    Attributes
    ----------
    root
        The first box, which leads to all others.
    points
        Verified points.
    contracted
        Number of contractions.
    """

    def __init__(self, record: Record, tolerance: float, *, deepest_first: bool = False) -> None:
        self.record, self.tolerance, self._deepest_first = record, tolerance, deepest_first
        self.root = Box(*record.box)
        self.points: list[Array] = []
        self.contracted = 0
        width = self.root.upper - self.root.lower
        free = (width > 0) & np.isfinite(width)
        self._groups, self._free = record.groups(free), np.flatnonzero(free[: record.count]).tolist()
        self._targets = np.flatnonzero(free[: len(record.tape.parameters)])
        self._number = count()
        self._open: list[tuple[float, int, Box]] = [(-np.inf, next(self._number), self.root)]
        self._closed: list[Box] = []

    @property
    def done(self) -> bool:
        """Whether no box is left to be cut."""
        return not self._open

    @property
    def proven(self) -> float:
        """The share of the first box that is proven empty when the next box is, by the number of halvings."""
        return 1.0 - sum(box.share for box in self._closed) - sum(box.share for _, _, box in self._open[1:])

    @property
    def boxes(self) -> list[Box]:
        """The boxes that cover the set; none where it is empty."""
        return [*self._closed, *(box for _, _, box in self._open)]

    @property
    def outer(self) -> tuple[Array, Array]:
        """The ends of all boxes."""
        lower, upper = zip(*(box.left for box in self.boxes), strict=True)
        return np.min(lower, axis=0), np.max(upper, axis=0)

    @property
    def inner(self) -> tuple[Array, Array]:
        """The ends of the verified points; empty where there is none."""
        points = np.array(self.points).reshape(-1, self.record.count)
        return points.min(axis=0, initial=np.inf), points.max(axis=0, initial=-np.inf)

    def clear(self) -> None:
        """Drop all boxes: the set is proven empty otherwise."""
        self._open, self._closed = [], []

    def step(self) -> None:
        """Contract the box that reaches furthest, then cut or close it; where it is stopped, the box stays."""
        box = self._open[0][2]
        self._contract(box)
        while not box.empty:
            before, box = box, self._shaved(box)
            if box is before:
                break
            self._contract(box)
        cut = None if box.empty else self._where(box)
        heapq.heappop(self._open)
        if cut is not None:
            box.cut, box.parts = cut, _parts(box, *cut, (0.5 * box.share,) * 2)
        elif not box.empty:
            self._closed.append(box)
        # Each half comes first in turn: a share that is proven says the more of the rest.
        for part in box.parts[:: -1 if self.contracted % 2 else 1]:
            self._put(part)

    def _put(self, box: Box) -> None:
        reach = float(self._beyond(box).max(initial=-np.inf))
        if reach > self.tolerance:
            rank = box.share if self._deepest_first and not self.points else -reach
            heapq.heappush(self._open, (rank, next(self._number), box))
        else:
            self._closed.append(box)

    def _beyond(self, box: Box) -> Array:
        """Return how far a box reaches beyond the verified points, in widths; its own size where there are none.

        Shape (2, targets).
        """
        k, (lower, upper) = self._targets, box.left
        if not self.points:
            whole = np.maximum(self.root.upper[k] - self.root.lower[k], TINY)
            return self.tolerance + np.array([upper[k] - lower[k]] * 2) / whole
        low, high = self.inner
        size = np.maximum(np.abs(low[k]), np.abs(high[k]))
        width = np.maximum(high[k] - low[k], np.maximum(_POINT * size, TINY))
        return np.array([low[k] - lower[k], upper[k] - high[k]]) / width

    def _contract(self, box: Box) -> None:
        for _ in range(_PASSES):
            lower, upper = box.left
            found = contracted(self.record.rows(lower, upper), lower, upper, self._groups)
            self.contracted += 1
            box.contractions.append(found)
            if found.empty:
                return
            before, now = (upper - lower)[self._free], (found.upper - found.lower)[self._free]
            if np.all(now >= (1 - _WORTH) * before) or self._beyond(box).max(initial=-np.inf) <= self.tolerance:
                break
        if found.inside is not None:
            self.points += filter(self.record.fits, [self._own(found.inside)])

    def _own(self, place: Array) -> Array:
        """Return the unknowns of a point that the experiments begin with, within what is known of them beforehand."""
        point = place if self.record.frame is None else self.record.frame.unknowns(place)
        own = slice(self.record.count)
        return np.clip(point[own], self.record.lower[own], self.record.upper[own])

    def _shaved(self, box: Box) -> Box:
        """Cut off what a piece proves empty at the ends of a hidden state that it begins with.

        Where such a state is hardly narrower than beforehand, the enclosures are too wide for the programs to say
        anything. Those of a slice need not be.
        """
        whole = self.root.upper - self.root.lower
        for place, k in () if self.record.whole else self.record.hidden:
            for side in (0, 1):
                while box.left[1][k] - box.left[0][k] > _WIDE * whole[k]:
                    check_time()
                    rest = self._without_slice(box, place, k, side)
                    if rest is None:
                        break
                    box = rest
        return box

    def _without_slice(self, box: Box, place: int, k: int, side: int) -> Box | None:
        """Return a box without a slice at an end of a hidden state; None where the piece does not prove it empty."""
        low, high = (float(end[k]) for end in box.left)
        value = high - (high - low) / _SLICES if side else low + (high - low) / _SLICES
        parts = _parts(box, k, value, (0.0, box.share) if side == 0 else (box.share, 0.0))
        slice_, rest = parts[side], parts[1 - side]
        found = contracted(self.record.rows(*slice_.left, only=place), *slice_.left, [Group((k,), None)])
        if not found.empty:
            return None
        slice_.contractions.append(found)
        box.cut, box.parts = (k, value), parts
        return rest

    def _where(self, box: Box) -> tuple[int, float] | None:
        """Return the unknown and the value where a box is cut; None where it reaches no further, or cutting is vain."""
        lower, upper = box.left
        if self.points:
            beyond = self._beyond(box)
            if beyond.max(initial=-np.inf) <= self.tolerance:
                return None
            side, place = (int(i) for i in np.unravel_index(int(np.argmax(beyond)), beyond.shape))
            if (end := self._sharp_end(box, side, place)) is not None:
                # The end itself is too close to the noise bounds to be verified, but not what is near it.
                self.points += near(self.record, end, np.mean(self.points, axis=0))
                return None
            k, sign = int(self._targets[place]), 1 if side == 0 else -1
            value = float(self.inner[side][k])
            if sign * (value - (lower, upper)[side][k]) <= _OUTER * (upper[k] - lower[k]):
                return k, value
        widest = self._best(box)
        return None if widest is None else (widest, _middle(float(lower[widest]), float(upper[widest])))

    def _sharp_end(self, box: Box, side: int, place: int) -> Array | None:
        """Return the point where a box ends towards a target; None if smaller boxes would move this end.

        Where the rows of a box with the radii of its middle end, they would end at best.
        """
        (lower, upper), (low, high), targets = box.left, self.inner, self._targets
        # Far from the verified points, the middle of a box says little of other points in it.
        if np.any(upper[targets] - lower[targets] > high[targets] - low[targets]):
            return None
        k, rows = int(targets[place]), self.record.rows(lower, upper, at_middle=True)
        found = Program(rows).end(k, -1 if side else 1) if len(rows.centre) else None
        if found is None:
            return None
        (bound, _, end), (middle, half) = found, middle_and_half(lower, upper)
        best = lower.copy(), upper.copy()
        best[side][k] = middle[k] + (-half[k] if side else half[k]) * bound
        gain = self._beyond(box) - self._beyond(Box(*best))
        return None if gain[side, place] > _GAIN * self.tolerance else self._own(middle + half * end[: len(middle)])

    def _best(self, box: Box) -> int | None:
        """Return the unknown whose halving makes the rows say most; None where all are too narrow to be halved.

        Gains of a larger box are measured again only while the largest is one of them (Minoux).
        """
        (lower, upper), known = box.left, self.record.knowledge
        wide = [k for k in self._free if _can_be_halved(lower[k], upper[k])]
        now, fresh = known(lower, upper), set[int]()
        bent = [k for k in wide if k in self._bent] if self._deepest_first else []

        def gain(k: int) -> float:
            # What the runs are linear in, the programs bound without cuts, once the others are known.
            return box.gains.get(k, math.inf) / (1.0 if k in bent or not bent else _CLEARLY)

        while (best := max(wide, key=gain, default=None)) is not None and best not in fresh:
            low, high, quarter = lower.copy(), upper.copy(), 0.25 * (upper[best] - lower[best])
            low[best], high[best] = lower[best] + quarter, upper[best] - quarter
            box.gains[best] = known(low, high) - now
            fresh.add(best)
        if best is None or not bent:
            return best

        # The deepest box first, one unknown after another would be halved for ever where each tells a little more.
        def share(k: int) -> float:
            return float((upper[k] - lower[k]) / (self.root.upper[k] - self.root.lower[k]))

        behind = max(bent, key=share)
        return behind if share(behind) > _ASPECT * share(best) else best

    @cached_property
    def _bent(self) -> list[int]:
        """The unknowns that the runs are no linear functions of, where all others are known."""
        lower, upper = self.root.left
        point = generic(lower, upper)
        exact = self.record.knowledge(point, point)
        found = []
        for k in self._free:
            low, high = point.copy(), point.copy()
            low[k], high[k] = lower[k], upper[k]
            if self.record.knowledge(low, high) < exact - _LINEAR:
                found.append(k)
        return found


def _can_be_halved(low: float, high: float) -> bool:
    return math.isfinite(high - low) and 0.25 * (high - low) > _NARROW * max(abs(low), abs(high))


def _middle(low: float, high: float) -> float:
    """Return where to halve: of numbers of one sign, by their order of magnitude."""
    if low > 0 or high < 0:
        return math.copysign(math.sqrt(abs(low)) * math.sqrt(abs(high)), low)
    # Near the middle at zero rather: there models divide, and signs change.
    middle = 0.5 * low + 0.5 * high
    return 0.0 if abs(middle) <= 0.25 * (high - low) else middle


def _parts(box: Box, k: int, value: float, shares: tuple[float, float]) -> tuple[Box, Box]:
    """Return the two parts of what is left of a box."""
    (lower, upper), parts = box.left, []
    for side, share in enumerate(shares):
        ends = lower.copy(), upper.copy()
        ends[1 - side][k] = value
        # A share is a power of two.
        gains = dict(box.gains) if math.frexp(share)[1] % _MEASURED else {}
        parts.append(Box(*ends, share, gains=gains))
    return parts[0], parts[1]


def heaviest(cover: Cover) -> tuple[tuple[int, int, float], ...]:
    """Return the experiment and sample of what carries the proofs that boxes are empty, each with its share of them."""
    shares: dict[tuple[int, int], float] = {}
    waiting = [cover.root]
    while waiting:
        box = waiting.pop()
        waiting += box.parts
        if box.empty:
            proof = box.contractions[-1].proof[-1]
            size = np.abs(proof.values) / np.abs(proof.values).sum()
            for (anchor, part, _, sample), share in zip(proof.sources.tolist(), size.tolist(), strict=True):
                if 0 <= anchor < LINKS or anchor == STEPWISE:
                    piece = cover.record.cut.parts[part]
                    place = piece.experiment, piece.first + sample
                    shares[place] = shares.get(place, 0.0) + share
    total = sum(shares.values())
    most = sorted(shares, key=shares.__getitem__, reverse=True)[:HEAVIEST]
    return tuple((e, sample, shares[e, sample] / total) for e, sample in most)
