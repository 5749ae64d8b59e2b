"""Correlative sparsity: cliques of a chordal extension of the graph that joins variables of the same constraint.

References
----------
H. Waki, S. Kim, M. Kojima and M. Muramatsu, "Sums of squares and semidefinite program relaxations for polynomial
optimization problems with structured sparsity", SIAM Journal on Optimization 17 (2006) 218-242.
"""

from __future__ import annotations

from collections.abc import Sequence

from relaxations.algebra.polynomial import Polynomials
from relaxations.problem.problem import PolynomialProblem


def cliques(problem: PolynomialProblem, objective: Polynomials | None = None) -> tuple[tuple[int, ...], ...]:
    """Return the variables of each maximal clique, sorted.

    The variables of one constraint, and of one monomial of the objective, lie in one clique.

    Examples
    --------
    >>> import sympy; from relaxations.problem.problem import from_sympy
    >>> x = sympy.symbols("x0:3")
    >>> problem, _ = from_sympy(None, [], [x[0] * x[1], x[1] * x[2]], x)
    >>> cliques(problem)
    ((0, 1), (1, 2))
    """
    neighbours: list[set[int]] = [set() for _ in range(problem.n_variables)]
    groups = [*row_variables(problem.equalities), *row_variables(problem.inequalities)]
    if objective is not None:
        groups += [{v for v in factor if v >= 0} for factor in objective.factors.tolist()]
    for group in groups:
        for v in group:
            neighbours[v] |= group
    return chordal_cliques(neighbours)


def chordal_cliques(neighbours: Sequence[set[int]]) -> tuple[tuple[int, ...], ...]:
    """Return the maximal cliques of a chordal extension: the vertex of least degree is eliminated first.

    >>> chordal_cliques([{1, 3}, {0, 2}, {1, 3}, {0, 2}])  # neighbours in a square: one diagonal is added
    ((0, 1, 3), (1, 2, 3))
    """
    near = [mine - {v} for v, mine in enumerate(neighbours)]
    found: list[set[int]] = []
    alive = set(range(len(near)))
    while alive:
        vertex = min(alive, key=lambda v: (len(near[v]), v))
        clique = near[vertex] | {vertex}
        if not any(clique <= other for other in found):
            found.append(clique)
        for v in near[vertex]:
            near[v] |= near[vertex]
            near[v] -= {v, vertex}
        alive.remove(vertex)
    return tuple(sorted(tuple(sorted(c)) for c in found))


def row_variables(polynomials: Polynomials) -> list[set[int]]:
    """Return the set of variables of each polynomial."""
    return [{v for _, _, factor in row for v in factor} for row in polynomials.terms()]
