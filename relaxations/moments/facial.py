"""Facial reduction: a smaller moment matrix with an interior point, for problems with equalities.

For every equality h = 0, the coefficient vector of every ``h m`` lies in the null space of each feasible moment matrix
M. (The degree of ``h m`` is at most that of the basis.) Let the columns of V be an orthonormal basis of the orthogonal
complement of these vectors. Then ``V' M V >= 0`` is equivalent to ``M >= 0`` and can have an interior point. An
interior-point solver fails without an interior point, and its bounds can be wrong.

References
----------
J. M. Borwein and H. Wolkowicz, "Facial reduction for a cone-convex programming problem", Journal of the Australian
Mathematical Society 30 (1981) 369-380.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr

from relaxations.algebra.arrays import Array, Index
from relaxations.algebra.polynomial import Factors, Polynomials, pad, unique
from relaxations.moments.moment import monomials_up_to

_RANK = 1e-9  # relative tolerance of ranks; coefficients are near one


def face_basis(vectors: Array) -> Array | None:
    """Return V, an orthonormal basis of the complement of null vectors, shape (size, r); None without null vectors."""
    if not len(vectors):
        return None
    q, r, _ = qr(vectors.T, mode="full", pivoting=True)
    return np.asarray(q[:, _rank(r) :], dtype=np.float64)


def vectors_within(vectors: Array, part: Index) -> Array:
    """Return the null vectors whose nonzero entries lie in ``part`` of the basis, restricted to this part.

    >>> vectors_within(np.array([[1.0, 0.0, 2.0], [0.0, 1.0, 3.0]]), np.array([0, 2]))
    array([[1., 2.]])
    """
    inside = np.count_nonzero(vectors[:, part], axis=1) == np.count_nonzero(vectors, axis=1)
    return np.asarray(vectors[inside][:, part], dtype=np.float64)


def independent_rows(vectors: Array) -> Index:
    """Return the sorted numbers of a largest set of linearly independent rows."""
    if not vectors.size:  # all multiples are zero: the box fixes their variables
        return np.zeros(0, dtype=np.int64)
    _, r, pivots = qr(vectors.T, mode="economic", pivoting=True)
    return np.sort(np.asarray(pivots[: _rank(r)], dtype=np.int64))


def _rank(triangle: NDArray[np.floating[Any]]) -> int:
    """Return the numerical rank of the triangular factor of a pivoted QR decomposition."""
    diagonal = np.abs(np.diag(triangle))
    return int((diagonal > _RANK * diagonal[0]).sum())


def multiple_vectors(equalities: Polynomials, variables: tuple[int, ...], degree: int) -> Array:
    """Return the coefficient vectors of all ``h m`` up to a degree, over all monomials up to this degree."""
    return coordinates(multiples(equalities, variables, degree), monomials_up_to(variables, degree))


def multiples(equalities: Polynomials, variables: tuple[int, ...], degree: int) -> Polynomials:
    """Return all ``h m`` up to a degree as polynomials, in order of (h, m)."""
    parts = []
    for row, own in enumerate(equalities.row_degrees().tolist()):
        if own <= degree:
            parts.append(equalities.take(np.array([row])).times_monomials(monomials_up_to(variables, degree - own)))
    return Polynomials.join(parts)


def coordinates(polynomials: Polynomials, basis: Factors) -> Array:
    """Return the coefficient vectors of polynomials over a basis, shape (n_rows, n_monomials)."""
    width = max(basis.shape[1], polynomials.factors.shape[1])
    _, which = unique(np.concatenate([pad(basis, width), pad(polynomials.factors, width)]))
    place = np.zeros(int(which.max(initial=0)) + 1, dtype=np.int64)
    place[which[: len(basis)]] = np.arange(len(basis))
    dense = np.zeros((polynomials.n_rows, len(basis)))
    np.add.at(dense, (polynomials.rows, place[which[len(basis) :]]), polynomials.coefficients.mid)
    return dense
