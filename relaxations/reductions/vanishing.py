"""Equalities with one monomial: ``x y = 0`` holds if x or y is zero.

A relaxation of such an equality has no interior point. If the box allows only one factor to be zero, this factor is
fixed at zero. Otherwise the problem is split into one case for each factor.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relaxations.algebra.arrays import Array, Index
from relaxations.algebra.polynomial import Polynomials
from relaxations.problem.problem import PolynomialProblem

Product = tuple[int, ...]  # variables, of which one is zero


def products(problem: PolynomialProblem) -> tuple[Product, ...]:
    """Return the variables of each equality that consists of one monomial."""
    equalities = problem.equalities
    alone = np.bincount(equalities.rows, minlength=equalities.n_rows)[equalities.rows] == 1
    # The coefficient must not be zero: its ball must exclude zero.
    certain = np.abs(equalities.coefficients.mid) > equalities.coefficients.rad
    found = equalities.factors[alone & certain]
    return tuple(tuple(sorted({v for v in row if v >= 0})) for row in found.tolist())


def settle(problem: PolynomialProblem, found: tuple[Product, ...]) -> PolynomialProblem | None:
    """Return the problem with each variable fixed at zero that must be zero; None if some product cannot be zero.

    >>> import sympy; from relaxations.problem.problem import from_sympy
    >>> x, y = sympy.symbols("x y")
    >>> problem, _ = from_sympy(None, [], [x * y], [x, y], {x: (1, 2), y: (0, 3)})
    >>> settle(problem, products(problem)).upper  # x cannot be zero
    array([2., 0.])
    """
    lower, upper = problem.lower.copy(), problem.upper.copy()
    for _ in range(len(found) + 1):
        fixed = 0
        for product in found:
            able = [v for v in product if lower[v] <= 0.0 <= upper[v]]
            if not able:
                return None
            if len(able) == 1 and lower[able[0]] < upper[able[0]]:
                lower[able[0]] = upper[able[0]] = 0.0
                fixed += 1
        if not fixed:
            break
    return problem.with_box(lower, upper)


@dataclass(frozen=True)
class Piece:
    """A problem and an objective with some variables fixed at zero and removed.

    Parameters
    ----------
    kept
        Shape (n_kept,). Numbers of the other variables in the whole problem.
    n_variables
        Number of variables of the whole problem.
    """

    problem: PolynomialProblem
    objective: Polynomials
    kept: Index
    n_variables: int

    def whole(self, point: Array) -> Array:
        """Return the point of the whole problem."""
        result = np.zeros(self.n_variables)
        result[self.kept] = point
        return result


def piece(problem: PolynomialProblem, objective: Polynomials, found: tuple[Product, ...], point: Array) -> Piece:
    """Return the piece around a point: of each product, the factor nearest to zero is fixed at zero."""
    n = problem.n_variables
    able = (problem.lower <= 0.0) & (problem.upper >= 0.0)
    distance = np.where(able, np.abs(point) / np.maximum(problem.upper - problem.lower, 1e-300), np.inf)
    # Choose one factor of each product, unless one of its factors is chosen already.
    zero: set[int] = set()
    for product in found:
        nearest = min(product, key=lambda v: distance[v])
        if not zero & set(product) and able[nearest]:
            zero.add(nearest)
    # Remove the chosen variables from the constraints and the objective.
    gone = np.array(sorted(zero), dtype=np.int64)
    kept = np.setdiff1d(np.arange(n), gone)
    equalities = problem.equalities.at_zero(gone, n)
    smaller = PolynomialProblem(
        tuple(problem.names[k] for k in kept),
        problem.lower[kept],
        problem.upper[kept],
        equalities.take(np.unique(equalities.rows)),  # rows without terms are satisfied
        problem.inequalities.at_zero(gone, n),
    )
    return Piece(smaller, objective.at_zero(gone, n), kept, n)


def cases(problem: PolynomialProblem, product: Product) -> list[PolynomialProblem]:
    """Return the problem once for each factor that can be zero, with this factor fixed at zero.

    The cases cover the set. The list is empty if a factor is fixed at zero already.
    """
    if any(problem.lower[v] == problem.upper[v] == 0.0 for v in product):
        return []
    parts = []
    for v in product:
        if problem.lower[v] <= 0.0 <= problem.upper[v]:
            lower, upper = problem.lower.copy(), problem.upper.copy()
            lower[v] = upper[v] = 0.0
            parts.append(problem.with_box(lower, upper))
    return parts
