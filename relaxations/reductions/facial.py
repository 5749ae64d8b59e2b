"""Facial reduction: an equality leaves the moment matrix no interior, so ask for less than the whole matrix.

Every equality h = 0 puts the coefficient vector of every ``h m`` (degree at most that of the basis) into the null space
of each feasible moment matrix. With V an orthonormal basis of the complement of these vectors, ``V' M V >= 0`` says the
same as ``M >= 0``, and an interior-point method finds an interior again. Without it the solver breaks down, and its
"bounds" can be false.

References
----------
J. M. Borwein and H. Wolkowicz, "Facial reduction for a cone-convex programming problem", Journal of the Australian
Mathematical Society 30 (1981) 369-380.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import qr

from relaxations.balls import Array, Index
from relaxations.moment import monomials_up_to
from relaxations.polynomial import Factors, Polynomials, pad, unique

_RANK = 1e-9  # relative: rows are normalised to coefficients near one


def complement(equalities: Polynomials, variables: tuple[int, ...], degree: int) -> Array | None:
    """Return V, shape (len(basis), r), for the basis of all monomials up to ``degree``; None if V is the identity.

    Parameters
    ----------
    equalities : Polynomials
        Equalities in ``variables`` only.
    """
    vectors = multiples(equalities, variables, degree)
    if not len(vectors):
        return None
    q, r, _ = qr(vectors.T, mode="full", pivoting=True)
    diagonal = np.abs(np.diag(r))
    rank = int((diagonal > _RANK * diagonal[0]).sum())
    return np.asarray(q[:, rank:], dtype=np.float64)


def independent(vectors: Array) -> Index:
    """Return the numbers of a largest independent set of rows, sorted."""
    _, r, pivots = qr(vectors.T, mode="economic", pivoting=True)
    diagonal = np.abs(np.diag(r))
    rank = int((diagonal > _RANK * diagonal[0]).sum())
    return np.sort(np.asarray(pivots[:rank], dtype=np.int64))


def multiples(equalities: Polynomials, variables: tuple[int, ...], degree: int) -> Array:
    """Return the coefficient vectors of all ``h m`` up to ``degree``, one row each, in order of (h, m)."""
    basis = monomials_up_to(variables, degree)
    products = multiplied(equalities, variables, degree)
    return coordinates(products, basis)


def multiplied(equalities: Polynomials, variables: tuple[int, ...], degree: int) -> Polynomials:
    """Return all ``h m`` up to ``degree`` as polynomials."""
    parts = []
    for row, own in enumerate(equalities.row_degrees().tolist()):
        if own <= degree:
            parts.append(equalities.take(np.array([row])).times_monomials(monomials_up_to(variables, degree - own)))
    return Polynomials.join(parts)


def coordinates(polynomials: Polynomials, basis: Factors) -> Array:
    """Return dense coefficient vectors over ``basis``, shape (n_rows, len(basis))."""
    width = max(basis.shape[1], polynomials.factors.shape[1])
    _, which = unique(np.concatenate([pad(basis, width), pad(polynomials.factors, width)]))
    place = np.zeros(int(which.max(initial=0)) + 1, dtype=np.int64)
    place[which[: len(basis)]] = np.arange(len(basis))
    dense = np.zeros((polynomials.n_rows, len(basis)))
    np.add.at(dense, (polynomials.rows, place[which[len(basis) :]]), polynomials.coefficients.mid)
    return dense
