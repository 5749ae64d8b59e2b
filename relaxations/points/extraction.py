"""Minimisers read from a moment matrix that is flat: as many as its rank.

Where the moment matrix of order d has the rank of its part of order d - s, the moments are those of finitely many
points, all of them minimisers, and linear algebra finds them: the matrices of multiplication by the variables, in a
basis of the column space, share their eigenvectors.

References
----------
D. Henrion and J. B. Lasserre, "Detecting global optimality and extracting solutions in GloptiPoly", in Positive
Polynomials in Control, LNCIS 312, Springer (2005) 293-310.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import comb

import numpy as np
from scipy.linalg import qr, schur

from relaxations.algebra.ball_arithmetic import Array
from relaxations.algebra.polynomial import Factors, multiply, pad
from relaxations.moments.moment import Relaxation, monomials_up_to

RANK = 1e-3  # eigenvalues below this share of the largest count as zero: solvers leave about 1e-5
SMALLEST = 1e-8  # moment that is told from zero
MOST = 30  # minimisers


def minimisers(relaxation: Relaxation, moments: Array, step: int = 1) -> Array | None:
    """Return the points that a flat moment matrix stands for; None where it is not flat.

    Parameters
    ----------
    relaxation
        Of one clique: ``dense``, or others where every variable meets every other.
    moments
        Shape (n_moments,). A solver's, the constant first.
    step
        Half the highest degree of the constraints, at least 1: how far the rank must not grow.

    Returns
    -------
    ndarray, shape (rank, n_variables), or None
        In the relaxation's scaled variables, in no order.

    Examples
    --------
    >>> from relaxations.moments.lasserre import lasserre
    >>> from relaxations.problem.problem import from_sympy
    >>> import sympy
    >>> x = sympy.Symbol("x")
    >>> relaxation = lasserre(from_sympy(None, [], [], [x], {x: (-1, 1)})[0], 2)
    >>> moments = np.mean([point**relaxation.degrees for point in (-0.5, 0.5)], axis=0)  # of (x^2 - 1/4)^2, say
    >>> np.sort(minimisers(relaxation, moments), axis=0).round(6)
    array([[-0.5],
           [ 0.5]])
    """
    n, order = relaxation.n_variables, relaxation.order
    basis = monomials_up_to(range(n), order)
    scaled = _matrix(relaxation, moments, basis)
    if scaled is None:
        return None
    matrix, size = scaled
    smaller = _size_below(n, order, step)
    rank = _flat_rank(matrix, smaller)
    if rank is None or rank > MOST:
        return None
    # A basis of monomials of low degree, so that its products with variables are still in the matrix.
    values, vectors = np.linalg.eigh(matrix)
    columns = vectors[:, -rank:] * np.sqrt(np.maximum(values[-rank:], 0.0))
    _, _, pivots = qr(columns[:smaller].T, mode="economic", pivoting=True)
    chosen = np.sort(pivots[:rank])
    within = np.linalg.lstsq(columns[chosen].T, columns.T, rcond=None)[0].T
    within *= size[:, None] / size[chosen]  # each monomial in the chosen ones
    place = {tuple(row): k for k, row in enumerate(basis.tolist())}
    multiplications = []
    for v in range(n):
        moved = multiply(pad(basis[chosen], order), np.array([[v]]))[:, -order:]
        multiplications.append(within[[place[tuple(row)] for row in pad(moved, order).tolist()]])
    # A random combination has distinct eigenvalues; the generator is seeded so that a run can be repeated.
    weights = np.random.default_rng(0).dirichlet(np.ones(n))
    combined = sum(w * m for w, m in zip(weights, multiplications, strict=True))
    _, q = schur(combined)
    points = np.array([[q[:, k] @ m @ q[:, k] for m in multiplications] for k in range(rank)])
    return points if np.isfinite(points).all() and np.abs(points).max() < 1 + RANK else None


def is_flat(relaxation: Relaxation, moments: Array, variables: Sequence[int], order: int, step: int = 1) -> bool:
    """Return whether the moments of some variables are those of finitely many points, as far as the ranks tell.

    Parameters
    ----------
    moments
        Shape (n_moments,). A solver's, the constant first.
    variables
        A clique of the relaxation.
    order
        Of the clique.
    step
        As for :func:`minimisers`.

    Examples
    --------
    >>> from relaxations.moments.lasserre import lasserre
    >>> from relaxations.problem.problem import from_sympy
    >>> import sympy
    >>> x = sympy.Symbol("x")
    >>> relaxation = lasserre(from_sympy(None, [], [], [x], {x: (-1, 1)})[0], 1)
    >>> [is_flat(relaxation, np.array([1.0, 0.5, square]), [0], 1) for square in (0.25, 0.5)]  # one point, and two
    [True, False]
    """
    n = len(variables)
    scaled = _matrix(relaxation, moments, monomials_up_to(variables, order))
    return scaled is not None and _flat_rank(scaled[0], _size_below(n, order, step)) is not None


def _size_below(n: int, order: int, step: int) -> int:
    """Return how many monomials there are up to the degree that flatness compares with."""
    return comb(n + order - step, n) if order >= step else 0


def _flat_rank(matrix: Array, smaller: int) -> int | None:
    """Return the rank of a moment matrix where the one of lower order has it too, else None."""
    rank = _rank(matrix)
    return rank if smaller and rank == _rank(matrix[:smaller, :smaller]) else None


def _matrix(relaxation: Relaxation, moments: Array, basis: Factors) -> tuple[Array, Array] | None:
    """Return a moment matrix scaled to ones on its diagonal, and the scale; None where the relaxation keeps no such."""
    # The diagonal tells that several cliques together have no such matrix, before millions of products are made.
    if (relaxation.find(multiply(basis, basis)) < 0).any():
        return None
    i, j = np.triu_indices(len(basis))
    found = relaxation.find(multiply(basis[i], basis[j]))
    matrix = np.empty((len(basis), len(basis)))
    # Where symmetry or terms split it, the rest is zero.
    matrix[i, j] = matrix[j, i] = np.where(found >= 0, moments[found], 0.0)
    # Monomials far inside the box are small: what counts is their size beside themselves.
    size = np.sqrt(np.maximum(np.diag(matrix), SMALLEST))
    return matrix / np.outer(size, size), size


def _rank(matrix: Array) -> int:
    values = np.linalg.eigvalsh(matrix)
    return int((values > RANK * max(float(values[-1]), 0.0)).sum())
