"""Tighter ends of a recursive set: the set is cut into pieces, and every piece is bounded by all stored equations.

The noise bound of a weighted sum grows with the set that its weights are made for (`smid.recursive.weighted_sums`), so
a wide set cannot cut itself further, although the samples would allow it. A part of the set has sums with less noise.
The ends of the set are those of the piece that reaches furthest: this piece is cut in two, and each half is bounded
by the rows of its own sums, or proven empty. Few samples carry the ends. Each piece is a small linear program, which
takes in the rows that its vertices violate most, until none is violated.

Reference: Jaulin, Kieffer, Didrit and Walter, Applied Interval Analysis, Springer (2001), chapter 5, for the pieces.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from relaxations.algebra.arrays import Array, Index
from smid.recursive.polytope import Polytope
from smid.recursive.weighted_sums import Drift, Noise, WeightedSums, principal_axes

__all__ = ["Equations", "Windows", "refined"]

PASSES = 3
"""Largest number of times that the sums of a piece are made anew after it has shrunk."""
WORTH = 0.1
"""Share of a width that a further pass has to gain."""
ROUNDS = 12
"""Largest number of linear programs of a pass."""
VIOLATED = 1e-6
"""Smallest violation of a row by a vertex that counts, relative to the row's range over the box."""
SHORTER = 1.5
"""Factor from one length of the sums over the first equations to the next."""
SHORTEST = 3


@dataclass(frozen=True, eq=False)
class Windows:
    """Consecutive equations, newest first.

    Parameters
    ----------
    equations
        Shape (w, K, 1 + n). ``y[t]`` and ``phi[t]``.
    ages
        Shape (w,). Samples since the newest equation of each window.
    """

    equations: Array
    ages: Array

    def before(self, stored: int, passed: int) -> Windows:
        """Return, so many samples later, the windows that reach back beyond the equations that are stored."""
        ages = self.ages + passed
        kept = ages + self.equations.shape[1] > stored
        return Windows(self.equations[kept], ages[kept])

    def first(self, length: int) -> Windows:
        """Return the newest equations of each window."""
        return Windows(self.equations[:, :length], self.ages)


@dataclass(frozen=True, eq=False)
class Equations:
    """What a set is refined with.

    Parameters
    ----------
    stored
        Shape (N, 1 + n). Consecutive equations, newest first.
    held
        Windows of older equations that carried an end before.
    noises, slip, drift
        As `WeightedSums` takes them.
    combine
        Whether sums of several equations have less noise than a single one.
    """

    stored: Array
    held: tuple[Windows, ...]
    noises: tuple[Noise, ...]
    slip: float
    drift: Drift | None
    combine: bool

    def windows(self, longest: int) -> list[Windows]:
        """Return windows of all equations; those of the first equations are shorter, because none are before them."""
        count, length, found = len(self.stored), min(longest, len(self.stored)), list[Windows]()
        newest = 0
        while count - newest >= length > 0:
            views = np.lib.stride_tricks.sliding_window_view(self.stored[newest:], length, axis=0)
            found.append(Windows(views.transpose(0, 2, 1), newest + np.arange(len(views), dtype=np.float64)))
            newest = count - length + 1
            if length <= SHORTEST:
                break
            length = max(SHORTEST, int(length / SHORTER))
        return found + [own.first(min(longest, own.equations.shape[1])) for own in self.held]


@dataclass(frozen=True, eq=False)
class Piece:
    """A part of a set, with the principal axes along which it is bounded too, and the windows that bound it."""

    part: Polytope
    axes: Array
    carried: tuple[Windows, ...] = ()

    def bounded(self, equations: Equations) -> Piece | None:
        """Return what all equations leave of the piece; None where it is proven empty."""
        part, na, carried = self.part, len(self.axes), self.carried
        axes = self.axes
        for _ in range(PASSES):
            before = part.widths[: part.n]
            if na:
                axes, _ = principal_axes(part, na)
                part = part.along(np.pad(axes, ((0, 0), (0, part.n - na))))
            most = max(len(equations.stored) // 2, SHORTEST) if equations.combine else 1
            sums = WeightedSums.around(equations.noises, part, axes, most)
            cut, carried = _cut(part, axes, sums, equations)
            if cut.empty:
                return None
            part = cut
            if (part.widths[: part.n] > (1 - WORTH) * before).all():
                break
        return Piece(part, axes, carried)

    def halves(self) -> list[Piece]:
        """Return the two halves along the axis on which the piece is longest."""
        na, part = len(self.axes), self.part
        others = part.ends[2 * part.n :]
        longest = int(np.argmax(others[:na] + others[na:]))
        middle = 0.5 * (others[longest] - others[na + longest])
        across = np.pad(self.axes[longest : longest + 1], ((0, 0), (0, part.n - na)))
        halves = [part.cut(sign * across, np.array([sign * middle])) for sign in (1.0, -1.0)]
        return [Piece(half, self.axes) for half in halves if not half.empty]


def refined(
    polytope: Polytope, axes: Array, equations: Equations, pieces: int
) -> tuple[Array, tuple[Windows, ...]] | None:
    """Return tighter ends along the axes and their negatives, shape (2n,), and the windows that carry them.

    None means that the set is proven empty. The set is cut into at most `pieces` pieces.
    """
    n = polytope.n
    whole = Piece(polytope, axes).bounded(equations)
    kept = [] if whole is None else [whole]
    # Pieces gain nothing where single equations are used: their noise hardly depends on the set.
    for _ in range(pieces - 1 if equations.combine else 0):
        if not kept:
            break
        ends = np.array([piece.part.ends[: 2 * n] for piece in kept])
        reaches = np.bincount(ends.argmax(axis=0), minlength=len(kept))
        sizes = [piece.part.widths[n:].max() for piece in kept]
        furthest = kept.pop(int(np.lexsort((sizes, reaches))[-1]))
        kept += [own for half in furthest.halves() if (own := half.bounded(equations)) is not None]
    if not kept:
        return None
    ends = np.array([piece.part.ends[: 2 * n] for piece in kept])
    return ends.max(axis=0), _joined([kept[k] for k in np.unique(ends.argmax(axis=0))])


def _cut(
    part: Polytope, axes: Array, longest: WeightedSums, equations: Equations
) -> tuple[Polytope, tuple[Windows, ...]]:
    """Return a piece cut by the rows that its vertices violate, and the windows of these rows."""
    windows = equations.windows(longest.weights.shape[1])
    size, rows, right, source = np.maximum(np.abs(part.lower), np.abs(part.upper)), [], [], []
    by_length = {longest.weights.shape[1]: longest}
    for which, own in enumerate(windows):
        length = own.equations.shape[1]
        sums = by_length.get(length) or WeightedSums.around(equations.noises, part, axes, length)
        by_length[length] = sums
        normals, offsets = sums.rows(own.equations, size, equations.slip, own.ages, equations.drift)
        rows.append(normals)
        right.append(offsets)
        number = np.tile(np.repeat(np.arange(len(own.ages)), len(sums.weights)), 2)
        source.append(np.stack([np.full(len(number), which), number], axis=1))
    normals, offsets, origin = np.concatenate(rows), np.concatenate(right), np.concatenate(source)
    used: list[Index] = []
    for _ in range(ROUNDS):
        depth = (part.vertices @ normals.T - offsets) / part.ranges(normals)
        worst = np.unique(depth.argmax(axis=1)[depth.max(axis=1) > VIOLATED])
        if not len(worst):
            break
        used.append(worst)
        part = part.cut(normals[worst], offsets[worst])
        if part.empty:
            break
    places = np.unique(origin[np.concatenate(used)], axis=0) if used else np.zeros((0, 2), dtype=np.int64)
    carried = (
        Windows(windows[which].equations[own], windows[which].ages[own])
        for which in np.unique(places[:, 0])
        for own in [places[places[:, 0] == which, 1]]
    )
    return part, tuple(carried)


def _joined(pieces: Sequence[Piece]) -> tuple[Windows, ...]:
    """Return the windows of some pieces, each once, one group for each length."""
    by_length: dict[int, dict[float, Array]] = {}
    for own in (own for piece in pieces for own in piece.carried):
        for equations, age in zip(own.equations, own.ages.tolist(), strict=True):
            by_length.setdefault(len(equations), {})[age] = equations
    return tuple(Windows(np.array(list(group.values())), np.array(list(group))) for group in by_length.values())
