"""Rows: the linear inequalities that runs state of the unknowns, and where each comes from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from relaxations.algebra.arrays import Array, Index, Mask

ANCHORS = (np.inf, 1.0)
"""A run that keeps all dependence, and one that is bounded by the measurements; a row may come from either."""

CONSTRAINT, PRIOR = -1, -2
"""In place of an anchor: the row is a constraint of the model, or the box of an unknown."""

LINKS = len(ANCHORS)
"""Added to an anchor: the row says that a piece ends where the next one begins."""

BALANCES = 2 * LINKS
"""In place of an anchor: the row compares a rate with what is known at both ends of an interval."""

STEPWISE = BALANCES + 1
"""In place of an anchor: the run begins anew from the measurements at each sample, and each error has a symbol."""


@dataclass(frozen=True, eq=False)
class Rows:
    """``|centre + slopes @ e| <= radius`` for unknowns ``middle + half * e`` with e in [-1, 1].

    Further symbols follow those of the unknowns: what operations on the parameters alone leave over, and the errors of
    the measurements, as shares of their noise bounds.

    Parameters
    ----------
    centre, radius
        Shape (n,).
    slopes
        Shape (n, symbols).
    sources
        Shape (n, 4). Place of the anchor, piece, measured output, sample of the piece; `LINKS` more than the anchor,
        piece, signal, sample; `BALANCES`, piece, integrated state, sample; `STEPWISE`, piece, measured output, sample;
        or `CONSTRAINT` or `PRIOR`, 0, which, 0.
    impossible
        A row that no unknowns of the box keep; -1: none.
    """

    centre: Array
    radius: Array
    slopes: sparse.csr_array
    sources: Index
    impossible: int

    @staticmethod
    def of(slopes: sparse.csr_array, centre: Array, radius: Array, sources: Index | None = None) -> Rows:
        """Return rows that are possible, by default without a place in a certificate."""
        nowhere = np.zeros((len(centre), 4), dtype=np.int64)
        return Rows(centre, radius, slopes, nowhere if sources is None else sources, -1)

    @staticmethod
    def joined(parts: Sequence[Rows]) -> Rows:
        """Return the rows of all parts."""
        slopes = sparse.csr_array(sparse.vstack([part.slopes for part in parts]))
        centre, radius, sources = (
            np.concatenate([getattr(part, name) for part in parts]) for name in ("centre", "radius", "sources")
        )
        return Rows(centre, radius, slopes, sources, -1)

    def where(self, kept: Mask | Index) -> Rows:
        """Return some of the rows."""
        return Rows(self.centre[kept], self.radius[kept], self.slopes[kept], self.sources[kept], -1)


@dataclass(frozen=True, eq=False)
class Block:
    """Forms that are zero somewhere in their enclosure, the unknowns that their slopes are of, and their sources."""

    forms: Array
    unknowns: Index
    sources: Index

    @staticmethod
    def of(forms: Array, unknowns: Index, anchor: int, piece: int, places: Index) -> Block:
        """Return forms whose slopes are all of the same unknowns."""
        count = len(forms)
        sources = np.column_stack([np.full(count, anchor), np.full(count, piece), places])
        return Block(forms, np.broadcast_to(unknowns, (count, len(unknowns))), sources)
