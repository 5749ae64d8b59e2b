"""Minimisers from a flat moment matrix.

If the moment matrix of order d has the same rank as its submatrix of order d - s, its moments are those of finitely
many points, one for each rank. All of them are minimisers. They are the joint eigenvalues of the matrices of
multiplication by each variable, in a basis of the column space.

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

from relaxations.algebra.arrays import Array
from relaxations.algebra.polynomial import Factors, multiply, pad
from relaxations.moments.moment import Relaxation, monomials_up_to

RANK = 1e-3  # eigenvalues below this share of the largest count as zero: solvers leave about 1e-5
SMALLEST = 1e-8  # smallest moment that counts as nonzero
MOST = 30  # minimisers, at most


def minimisers(relaxation: Relaxation, moments: Array, step: int = 1) -> Array | None:
    """Return the points of a flat moment matrix in scaled variables, shape (rank, n_variables); None if not flat.

    Parameters
    ----------
    relaxation
        With one clique of all variables.
    moments
        Shape (n_moments,). Moments of a solver, the constant first.
    step
        Half of the highest degree of the constraints, at least 1: the s of flatness.
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
    # M = C C'. Choose independent rows of low degree, whose products with variables are in the matrix too.
    values, vectors = np.linalg.eigh(matrix)
    columns = vectors[:, -rank:] * np.sqrt(np.maximum(values[-rank:], 0.0))
    _, _, pivots = qr(columns[:smaller].T, mode="economic", pivoting=True)
    chosen = np.sort(pivots[:rank])
    # Express every monomial in the chosen ones, then multiply the chosen ones by each variable.
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
    """Return whether the moments of a clique are those of finitely many points, by their numerical ranks.

    The arguments are those of :func:`minimisers`; ``order`` is that of the clique.
    """
    n = len(variables)
    scaled = _matrix(relaxation, moments, monomials_up_to(variables, order))
    return scaled is not None and _flat_rank(scaled[0], _size_below(n, order, step)) is not None


def _size_below(n: int, order: int, step: int) -> int:
    """Return the number of monomials up to degree ``order - step``."""
    return comb(n + order - step, n) if order >= step else 0


def _flat_rank(matrix: Array, smaller: int) -> int | None:
    """Return the rank of a moment matrix if its submatrix of lower order has the same rank, else None."""
    rank = _rank(matrix)
    return rank if smaller and rank == _rank(matrix[:smaller, :smaller]) else None


def _matrix(relaxation: Relaxation, moments: Array, basis: Factors) -> tuple[Array, Array] | None:
    """Return a moment matrix with ones on its diagonal, and its scale; None if some of its moments do not exist."""
    # The diagonal is checked first: with several cliques it is incomplete, and the full matrix may be very large.
    if (relaxation.find(multiply(basis, basis)) < 0).any():
        return None
    i, j = np.triu_indices(len(basis))
    found = relaxation.find(multiply(basis[i], basis[j]))
    matrix = np.empty((len(basis), len(basis)))
    # Entries outside the blocks of a split are zero.
    matrix[i, j] = matrix[j, i] = np.where(found >= 0, moments[found], 0.0)
    # Moments of small monomials are small, so the diagonal is scaled to one.
    size = np.sqrt(np.maximum(np.diag(matrix), SMALLEST))
    return matrix / np.outer(size, size), size


def _rank(matrix: Array) -> int:
    """Return the number of eigenvalues above a share of the largest."""
    values = np.linalg.eigvalsh(matrix)
    return int((values > RANK * max(float(values[-1]), 0.0)).sum())
