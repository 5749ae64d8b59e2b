"""Small problems on [-1, 1]^n, and what a relaxation says of the moments of one point."""

import numpy as np

from relaxations.algebra.polynomial import Polynomials
from relaxations.problem.problem import PolynomialProblem


def unit_problem(n, equalities=(), inequalities=()):
    """Return a problem on [-1, 1]^n from mappings {variables: coefficient}."""
    return PolynomialProblem(
        tuple(f"x{k}" for k in range(n)),
        -np.ones(n),
        np.ones(n),
        Polynomials.from_terms(list(equalities)),
        Polynomials.from_terms(list(inequalities)),
    )


def monomial_values(relaxation, t):
    return np.prod(np.where(relaxation.monomials >= 0, t[relaxation.monomials], 1.0), axis=1)


def block_matrices(blocks, y):
    m = np.zeros((blocks.count, blocks.size, blocks.size))
    np.add.at(m, (blocks.block, blocks.i, blocks.j), blocks.coefficient.mid * y[blocks.moment])
    upper = np.triu(m, 1)
    return m + np.swapaxes(upper, 1, 2)


def worst(relaxation, t):
    """Return the largest equality residual and the least eigenvalue of any block at a point's moments."""
    y = monomial_values(relaxation, t)
    residual = np.bincount(
        relaxation.equality_row,
        relaxation.equality_coefficient.mid * y[relaxation.equality_moment],
        relaxation.n_equalities,
    )
    eigenvalues = [0.0]
    for blocks in relaxation.blocks:
        matrices = block_matrices(blocks, y)
        if blocks.congruence is not None:
            matrices = np.swapaxes(blocks.congruence, 1, 2) @ matrices @ blocks.congruence
        if matrices.shape[1]:
            eigenvalues.append(np.linalg.eigvalsh(matrices).min())
    return float(np.abs(residual).max(initial=0.0)), float(min(eigenvalues))
