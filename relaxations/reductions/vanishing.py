"""Equalities that are a product: ``x y = 0`` says that x is zero or y is, which leaves a relaxation no interior.

Where the box keeps all factors but one away from zero, that one is zero, and is fixed there. Otherwise there is a case
for each factor.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relaxations.algebra.ball_arithmetic import Array, Index
from relaxations.algebra.polynomial import Polynomials
from relaxations.problem.problem import PolynomialProblem

Product = tuple[int, ...]  # the variables of which one vanishes


def products(problem: PolynomialProblem) -> tuple[Product, ...]:
    """Return the equalities that consist of one monomial.

    Returns
    -------
    tuple of tuple of int
        The variables of each, one of which vanishes.

    Examples
    --------
    >>> import sympy; from relaxations.problem.problem import from_sympy
    >>> x, y = sympy.symbols("x y")
    >>> products(from_sympy(None, [], [x * y, x + y - 1], [x, y])[0])
    ((0, 1),)
    """
    equalities = problem.equalities
    alone = np.bincount(equalities.rows, minlength=equalities.n_rows)[equalities.rows] == 1
    # A coefficient that its ball does not keep from zero says nothing.
    certain = np.abs(equalities.coefficients.mid) > equalities.coefficients.rad
    found = equalities.factors[alone & certain]
    return tuple(tuple(sorted({v for v in row if v >= 0})) for row in found.tolist())


def settle(problem: PolynomialProblem, found: tuple[Product, ...]) -> PolynomialProblem | None:
    """Fix at zero what must be zero on the problem's box; None where no factor of some product can vanish.

    Parameters
    ----------
    found
        Its :func:`products`.

    Returns
    -------
    PolynomialProblem or None
        On a box that may be smaller; None proves that the set is empty.

    Examples
    --------
    >>> import sympy; from relaxations.problem.problem import from_sympy
    >>> x, y = sympy.symbols("x y")
    >>> problem, _ = from_sympy(None, [], [x * y], [x, y], {x: (1, 2), y: (0, 3)})
    >>> settle(problem, products(problem)).upper  # x stays away from zero
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
    """A problem and an objective with some variables at zero, which are left out.

    Parameters
    ----------
    objective
        One row.
    kept
        Shape (n_kept,). Numbers of the variables in the whole problem.
    n_variables
        Of the whole problem.
    """

    problem: PolynomialProblem
    objective: Polynomials
    kept: Index
    n_variables: int

    def whole(self, point: Array) -> Array:
        """Return a point of the whole problem."""
        result = np.zeros(self.n_variables)
        result[self.kept] = point
        return result


def piece(problem: PolynomialProblem, objective: Polynomials, found: tuple[Product, ...], point: Array) -> Piece:
    """Return the piece of a problem around a point: of each product the factor nearest to zero is zero.

    Parameters
    ----------
    objective
        One row.
    found
        The problem's :func:`products`.
    point
        Shape (n_variables,).

    Examples
    --------
    >>> import sympy; from relaxations.problem.problem import from_sympy
    >>> x, y = sympy.symbols("x y")
    >>> problem, objective = from_sympy(x + y, [], [x * y], [x, y], {x: (0, 1), y: (0, 1)})
    >>> part = piece(problem, objective, products(problem), np.array([0.1, 0.8]))
    >>> part.problem.names, part.problem.equalities.n_rows
    (('y',), 0)
    >>> part.whole(np.array([0.8]))
    array([0. , 0.8])
    """
    n = problem.n_variables
    able = (problem.lower <= 0.0) & (problem.upper >= 0.0)
    distance = np.where(able, np.abs(point) / np.maximum(problem.upper - problem.lower, 1e-300), np.inf)
    zero: set[int] = set()
    for product in found:
        nearest = min(product, key=lambda v: distance[v])
        if not zero & set(product) and able[nearest]:
            zero.add(nearest)
    gone = np.array(sorted(zero), dtype=np.int64)
    kept = np.setdiff1d(np.arange(n), gone)
    equalities = problem.equalities.at_zero(gone, n)
    smaller = PolynomialProblem(
        tuple(problem.names[k] for k in kept),
        problem.lower[kept],
        problem.upper[kept],
        equalities.take(np.unique(equalities.rows)),  # a row without terms holds
        problem.inequalities.at_zero(gone, n),
    )
    return Piece(smaller, objective.at_zero(gone, n), kept, n)


def cases(problem: PolynomialProblem, product: Product) -> list[PolynomialProblem]:
    """Return the problem once for each factor that may vanish, fixed at zero; empty where one is fixed already.

    Parameters
    ----------
    product
        One of its :func:`products`.

    Returns
    -------
    list of PolynomialProblem
        Together they cover the set, unless a factor is fixed already.

    Examples
    --------
    >>> import sympy; from relaxations.problem.problem import from_sympy
    >>> x, y = sympy.symbols("x y")
    >>> problem, _ = from_sympy(None, [], [x * y], [x, y], {x: (0, 1), y: (0, 2)})
    >>> [case.upper.tolist() for case in cases(problem, (0, 1))]
    [[0.0, 2.0], [1.0, 0.0]]
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
