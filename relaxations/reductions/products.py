"""Products of linear constraints, which tighten a relaxation of order 1: the reformulation-linearisation technique.

If two affine functions are nonnegative on the feasible set, so is their product. A moment relaxation of order 1 does
not contain this condition. The factors are the linear inequalities and the bounds of variables. Only factors within one
clique are multiplied, so that the sparsity is kept.

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

MOST = 4000  # products; with more, the cost exceeds the benefit


def with_products(problem: PolynomialProblem, objective: Polynomials | None = None) -> PolynomialProblem:
    """Return the problem with the products of its linear inequalities and bounds as further inequalities.

    The problem is returned unchanged if there is no product, or if there are more than 4000.

    Parameters
    ----------
    problem
        With finite bounds.
    objective
        Variables of one of its monomials lie in one clique.

    Examples
    --------
    >>> import sympy; from relaxations.problem.problem import from_sympy
    >>> x, y = sympy.symbols("x y")
    >>> problem, _ = from_sympy(None, [], [x * y - 1], [x, y], {x: (0, 2), y: (0, 2)})
    >>> with_products(problem).inequalities.n_rows  # (x or 2 - x) times (y or 2 - y)
    4
    """
    linear = problem.inequalities.take(np.flatnonzero(problem.inequalities.row_degrees() == 1))
    families = [problem.equalities, problem.inequalities, *([] if objective is None else [objective])]
    free = Polynomials.join(families).occurring()
    free = free[problem.lower[free] < problem.upper[free]]
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
