"""Cuts: inequalities in the outer variables alone that follow from fixed multipliers, and their chords on a box."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from relaxations.algebra.arrays import Array
from relaxations.algebra.ball_arithmetic import EPSILON, TINY
from relaxations.search.benders.split import Rows, Split, frame

# Numbers at a time: arrays of many cuts over a long record would go through the memory again and again.
CACHED = 1 << 15


@dataclass(frozen=True)
class Cuts:
    """Inequalities ``sum_a m_a(p) C_0a + sum_t |sum_a m_a(p) C_ta| >= 0`` of feasible p, with monomials m_a.

    Parameters
    ----------
    multipliers
        Shape (n_cuts, n_equalities + n_inequalities).
    coefficients
        Shape (n_monomials, n_cuts, 1 + n_inner). C, a plane for each monomial.
    sizes, errors
        Shape (n_cuts, n_monomials). Sums over t of the magnitudes of the terms, and of their rounding errors.
    """

    split: Split
    multipliers: Array
    coefficients: Array
    sizes: Array
    errors: Array

    @staticmethod
    def of(split: Split, multipliers: Array) -> Cuts:
        """Return the cuts of any finite multipliers, nonnegative for inequalities."""
        shape = (len(multipliers), 1 + len(split.inner), len(split.monomials))
        parts = np.split(multipliers, [split.equalities.count], axis=1)
        coefficients, sizes, errors = np.zeros(shape), np.zeros(shape), np.zeros(shape)
        for weights, rows in zip(parts, (split.equalities, split.inequalities), strict=True):
            coefficients += _combined(weights, rows.mid).reshape(shape)
            sizes += _combined(np.abs(weights), abs(rows.mid)).reshape(shape)
            errors += _combined(np.abs(weights), rows.rad).reshape(shape)
        terms = 4 + max(_longest_column(split.equalities), _longest_column(split.inequalities))
        errors += 2 * terms * (EPSILON * (sizes + errors) + TINY)
        planes = np.ascontiguousarray(np.moveaxis(coefficients, 2, 0))
        return Cuts(split, multipliers, planes, sizes.sum(axis=1), errors.sum(axis=1) * (1 + EPSILON * shape[1]))

    def __len__(self) -> int:
        return len(self.multipliers)

    def join(self, other: Cuts) -> Cuts:
        """Return the cuts of both; they are of one split."""
        return Cuts(
            self.split,
            np.concatenate([self.multipliers, other.multipliers]),
            np.concatenate([self.coefficients, other.coefficients], axis=1),
            np.concatenate([self.sizes, other.sizes]),
            np.concatenate([self.errors, other.errors]),
        )

    def tangents(self, p: Array) -> tuple[Array, Array]:
        """Return the left sides at a point and their gradients, shapes (n_cuts,) and (n_cuts, n_outer).

        Plain floating point; negative where the point is cut off.
        """
        affine, _ = self.split.affine(p, np.ones(len(p)))
        at = np.tensordot(affine.T, self.coefficients, 1)
        sums = at[:, :, 0] + np.einsum("it,jit->ji", np.sign(at[0, :, 1:]), at[:, :, 1:])
        return sums[0], sums[1:].T

    def on_box(self, lower: Array, upper: Array) -> tuple[Array, Array]:
        """Return ``b`` and ``A`` such that ``b + A s >= 0`` for every feasible ``p = centre + radius s`` of the box.

        Centre and radius are those of :func:`frame`. Rounding is accounted for in ``b``.
        """
        affine, missed = self.split.affine(*frame(lower, upper))
        few = max(1, CACHED // self.coefficients.shape[2])
        parts = [self._chords(slice(k, k + few), affine, missed) for k in range(0, max(len(self), 1), few)]
        constant, slopes = (np.concatenate(part) for part in zip(*parts, strict=True))
        return constant + self.rounding(np.abs(affine).sum(axis=1) + missed), slopes

    def rounding(self, reaching: Array) -> Array:
        """Return a bound of each cut's rounding error, shape (n_cuts,), for monomials of at most the given size."""
        # Each of the sums is of products that the sizes bound, and no longer than this; some go into the next.
        n_terms = self.coefficients.shape[2] + (1 + len(self.split.outer)) * len(self.split.monomials) + 16
        return np.asarray((self.errors + 8 * n_terms * EPSILON * self.sizes) @ reaching, dtype=np.float64)

    def _chords(self, some: slice, affine: Array, missed: Array) -> tuple[Array, Array]:
        """Return constant and slopes of some cuts on a box without rounding, shapes (n_cuts,) and (n_cuts, n_outer)."""
        at = np.tensordot(affine.T, self.coefficients[:, some], 1)
        middle, reach = at[0, :, 1:], np.zeros(at[0, :, 1:].shape)
        for plane in at[1:]:
            reach += np.abs(plane[:, 1:])
        constant, beyond = at[0, :, 0], np.zeros(())
        if missed.any():
            every = np.tensordot(missed, np.abs(self.coefficients[:, some]), 1)
            constant, beyond = constant + every[:, 0], every[:, 1:]
            reach += beyond
        # |c| <= share c + rest wherever |c - middle| <= reach: the chord where c changes its sign, c or -c elsewhere.
        share = np.sign(middle)
        cut, _ = changing = np.nonzero(np.abs(middle) < reach)
        m, r = middle[changing], reach[changing]
        s = share[changing] = m / r
        rest = (np.abs(share) * beyond).sum(axis=1)
        rest = rest + np.bincount(cut, np.maximum((1 - s) * (r + m), (1 + s) * (r - m)), len(constant))
        sums = np.einsum("it,jit->ji", share, at[:, :, 1:])
        return constant + sums[0] + rest, (at[1:, :, 0] + sums[1:]).T

    def losses(self, which: int, lower: Array, upper: Array) -> Array:
        """Return the share of each outer variable in what one cut loses on a box, shape (n_outer,)."""
        affine, missed = self.split.affine(*frame(lower, upper))
        at = np.tensordot(affine.T, self.coefficients[:, which], 1)
        slopes = np.abs(at[1:, 1:])
        open_ones = np.abs(at[0, 1:]) < slopes.sum(axis=0)
        bent = np.zeros(len(lower))
        for variable in self.split.monomials.T:
            real = variable >= 0
            np.add.at(bent, variable[real], (self.sizes[which] * missed)[real])
        return np.asarray(slopes[:, open_ones].sum(axis=1) + bent, dtype=np.float64)


def _combined(weights: Array, matrix: sparse.csr_matrix) -> Array:
    return np.asarray((matrix.T @ weights.T).T, dtype=np.float64)


def _longest_column(rows: Rows) -> int:
    return int(np.diff(rows.mid.tocsc().indptr).max(initial=0))
