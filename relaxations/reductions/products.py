"""Products of linear constraints, which tighten a relaxation of order 1: the reformulation-linearisation technique.

Two affine functions that are nonnegative on the feasible set, box ends included, have a nonnegative product. A moment
relaxation of order 1 has moments for it but does not ask it. Only pairs within one clique are multiplied, so that the
sparsity stays as it is.

References
----------
H. D. Sherali and W. P. Adams, "A Reformulation-Linearization Technique for Solving Discrete and Continuous Nonconvex
Problems", Kluwer (1999), chapter 7.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from relaxations.algebra.polynomial import Polynomials
from relaxations.problem.problem import PolynomialProblem
from relaxations.reductions.sparsity import cliques, row_variables

MOST = 4000  # further products would cost more than they tighten


def with_products(problem: PolynomialProblem, objective: Polynomials | None = None) -> PolynomialProblem:
    """Return the same set, described by the products of its linear inequalities and box ends too.

    Parameters
    ----------
    problem
        With a finite box.
    objective
        Its monomials join cliques.

    Returns
    -------
    PolynomialProblem
        The one given where there is no product, or there are more than 4000.

    Examples
    --------
    >>> import sympy; from relaxations.problem.problem import from_sympy
    >>> x, y = sympy.symbols("x y")
    >>> problem, _ = from_sympy(None, [], [x * y - 1], [x, y], {x: (0, 2), y: (0, 2)})
    >>> with_products(problem).inequalities.n_rows  # (x or 2 - x) times (y or 2 - y)
    4
    """
    linear = problem.inequalities.take(np.flatnonzero(problem.inequalities.row_degrees() == 1))
    free = np.flatnonzero(problem.lower < problem.upper)
    factors = Polynomials.join(
        [
            linear,
            Polynomials.variables(free, 1.0, -problem.lower[free]),
            Polynomials.variables(free, -1.0, problem.upper[free]),
        ]
    )
    owners = row_variables(factors)
    groups = [set(c) for c in cliques(problem, objective)]
    pairs = [
        (i, j)
        for i, j in combinations(range(factors.n_rows), 2)
        if owners[i] != owners[j] and any(owners[i] | owners[j] <= group for group in groups)
    ]
    if not pairs or len(pairs) > MOST:
        return problem
    left, right = np.array(pairs, dtype=np.int64).T
    return problem.with_inequalities(factors.take(left).times(factors.take(right)))
