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

from relaxations.algebra.ball_arithmetic import Array, Index
from relaxations.algebra.polynomial import Factors, Polynomials, pad, unique
from relaxations.moments.moment import monomials_up_to

_RANK = 1e-9  # relative: rows are normalised to coefficients near one


def complement(vectors: Array) -> Array | None:
    """Return V, an orthonormal basis of what is orthogonal to every null vector; None if it is the identity.

    Parameters
    ----------
    vectors
        Shape (n_vectors, size). Coefficients of the ``h m`` over a basis: see :func:`multiples`.

    Returns
    -------
    ndarray, shape (size, r), or None

    Examples
    --------
    >>> line = Polynomials.from_terms([{(0,): 1.0, (1,): -1.0}])  # x0 = x1
    >>> face = complement(multiples(line, (0, 1), 1))
    >>> face.shape  # of three monomials 1, x0, x1
    (3, 2)
    >>> np.abs(np.array([0.0, 1.0, -1.0]) @ face).round(9)
    array([0., 0.])
    """
    if not len(vectors):
        return None
    q, r, _ = qr(vectors.T, mode="full", pivoting=True)
    diagonal = np.abs(np.diag(r))
    rank = int((diagonal > _RANK * diagonal[0]).sum())
    return np.asarray(q[:, rank:], dtype=np.float64)


def supported(vectors: Array, part: Index) -> Array:
    """Return the null vectors that live on a part of the basis: those of that part of the matrix.

    Parameters
    ----------
    vectors
        Shape (n_vectors, size).
    part
        Numbers of some members of the basis.

    Returns
    -------
    ndarray, shape (n_supported, len(part))

    Examples
    --------
    >>> supported(np.array([[1.0, 0.0, 2.0], [0.0, 1.0, 3.0]]), np.array([0, 2]))
    array([[1., 2.]])
    """
    inside = np.count_nonzero(vectors[:, part], axis=1) == np.count_nonzero(vectors, axis=1)
    return np.asarray(vectors[inside][:, part], dtype=np.float64)


def independent(vectors: Array) -> Index:
    """Return the numbers of a largest independent set of rows, sorted.

    Parameters
    ----------
    vectors
        Shape (n, k).

    Returns
    -------
    ndarray of int, shape (rank,)

    Examples
    --------
    >>> rows = independent(np.array([[1.0, 0.0], [2.0, 0.0], [0.0, 1.0]]))
    >>> rows  # the longer of two parallel rows
    array([1, 2])
    """
    if not vectors.size:  # multiples of equalities that vanish, on a box that fixes their variables
        return np.zeros(0, dtype=np.int64)
    _, r, pivots = qr(vectors.T, mode="economic", pivoting=True)
    diagonal = np.abs(np.diag(r))
    rank = int((diagonal > _RANK * diagonal[0]).sum())
    return np.sort(np.asarray(pivots[:rank], dtype=np.int64))


def multiples(equalities: Polynomials, variables: tuple[int, ...], degree: int) -> Array:
    """Return the coefficient vectors of all ``h m`` up to a degree, in order of (h, m).

    Parameters
    ----------
    equalities
        In ``variables`` only.

    Returns
    -------
    ndarray, shape (n_multiples, n_monomials)
        Over all monomials in ``variables`` up to the degree.

    Examples
    --------
    >>> line = Polynomials.from_terms([{(0,): 1.0, (): -2.0}])  # x0 = 2
    >>> multiples(line, (0,), 2)  # x0 - 2 and x0^2 - 2 x0, over 1, x0, x0^2
    array([[-2.,  1.,  0.],
           [ 0., -2.,  1.]])
    """
    basis = monomials_up_to(variables, degree)
    products = multiplied(equalities, variables, degree)
    return coordinates(products, basis)


def multiplied(equalities: Polynomials, variables: tuple[int, ...], degree: int) -> Polynomials:
    """Return all ``h m`` up to a degree as polynomials.

    Parameters
    ----------
    equalities
        In ``variables`` only.

    Returns
    -------
    Polynomials
        One row for each multiple, in order of (h, m); none for an equality of higher degree.

    Examples
    --------
    >>> line = Polynomials.from_terms([{(0,): 1.0, (): -2.0}])  # x0 = 2
    >>> multiplied(line, (0,), 2).evaluate(np.array([5.0]))  # x0 - 2 and x0^2 - 2 x0
    array([ 3., 15.])
    """
    parts = []
    for row, own in enumerate(equalities.row_degrees().tolist()):
        if own <= degree:
            parts.append(equalities.take(np.array([row])).times_monomials(monomials_up_to(variables, degree - own)))
    return Polynomials.join(parts)


def coordinates(polynomials: Polynomials, basis: Factors) -> Array:
    """Return dense coefficient vectors over a basis.

    Parameters
    ----------
    basis
        Shape (n_monomials, degree). With every monomial that occurs.

    Returns
    -------
    ndarray, shape (n_rows, n_monomials)

    Examples
    --------
    >>> line = Polynomials.from_terms([{(1,): 3.0, (): -2.0}])
    >>> coordinates(line, monomials_up_to((0, 1), 1))  # over 1, x0, x1
    array([[-2.,  0.,  3.]])
    """
    width = max(basis.shape[1], polynomials.factors.shape[1])
    _, which = unique(np.concatenate([pad(basis, width), pad(polynomials.factors, width)]))
    place = np.zeros(int(which.max(initial=0)) + 1, dtype=np.int64)
    place[which[: len(basis)]] = np.arange(len(basis))
    dense = np.zeros((polynomials.n_rows, len(basis)))
    np.add.at(dense, (polynomials.rows, place[which[len(basis) :]]), polynomials.coefficients.mid)
    return dense
