"""Symbols for products of two unknowns, so that forms of second order do not lose them to the radius.

Where a run is bent, its forms of first order leave over what two unknowns do together, at each sample anew and with the
worst sign. But their product is the same at all samples. A symbol of its own keeps that, as for ``e_j e_k`` in
[-1, 1], or for ``2 e_k e_k - 1``; what is left over then is of third order. Linear programs see such a symbol as one
more unknown, between the ends that its factors give it:

    e_j e_k >= e_j + e_k - 1,   e_j e_k <= e_j - e_k + 1,   and so on for either sign of each factor.

References
----------
F. Messine and A. Touhami, "A general reliable quadratic form: an extension of affine arithmetic", Reliable Computing 12
(2006) 171-192.
G. P. McCormick, "Computability of global solutions to factorable nonconvex programs: part I", Mathematical Programming
10 (1976) 147-175.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relaxations.algebra.affine_arithmetic import NO_PRODUCTS, SLOPES
from relaxations.algebra.arrays import Array, Index


@dataclass(frozen=True, eq=False)
class Products:
    """Which unknowns have a symbol for their product.

    Parameters
    ----------
    pairs
        Shape (n, 2), the smaller place first.
    columns
        Shape (unknowns, unknowns), of forms: where the slope of the product is, -1 if it has none; or `NO_PRODUCTS`.
        The symbols of products follow those of the unknowns.
    """

    pairs: Index
    columns: Index

    @staticmethod
    def none() -> Products:
        """Return that no product has a symbol."""
        return Products(np.zeros((0, 2), dtype=np.int64), NO_PRODUCTS)

    @staticmethod
    def of(count: int, pairs: Index) -> Products:
        """Return symbols for some pairs of so many unknowns."""
        columns = np.full((count, count), -1, dtype=np.int64)
        columns[pairs[:, 0], pairs[:, 1]] = SLOPES + count + np.arange(len(pairs))
        return Products(pairs, columns)

    @staticmethod
    def all(count: int) -> Products:
        """Return symbols for all products of so many unknowns."""
        return Products.of(count, np.column_stack(np.triu_indices(count)).astype(np.int64))

    @property
    def between_factors(self) -> tuple[Array, Index]:
        """Forms that are zero for the products within their enclosure, and what their slopes are of."""
        square = self.pairs[:, 0] == self.pairs[:, 1]
        squares, others = np.flatnonzero(square), np.flatnonzero(~square)
        found = [_rows(squares, sign * 4.0, 0.0, -1.0, 4.0) for sign in (-1, 1)]
        found += [_rows(others, a, b, -a * b, 2.0) for a in (-1.0, 1.0) for b in (-1.0, 1.0)]
        which = np.concatenate([squares, squares, *[others] * 4])
        return np.concatenate(found), np.column_stack([self.pairs[which], len(self.columns) + which])


def _rows(which: Index, first: float, second: float, centre: float, radius: float) -> Array:
    """Return forms ``first e_j + second e_k + product + centre``, within a radius of zero."""
    return np.tile([centre, radius, -np.inf, np.inf, first, second, 1.0], (len(which), 1))
