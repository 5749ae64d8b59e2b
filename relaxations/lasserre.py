"""Lasserre's moment relaxations: dense, sparse over cliques, and the textbook's, which breaks down on equalities.

For each clique I of variables (one clique of all of them: the dense hierarchy), with ``b_d`` all monomials in x_I up
to degree d:

    L(b_d b_d') >= 0,   L(g b b') >= 0 with deg(g b b') <= 2 d,   L(h m) = 0 with deg(h m) <= 2 d,

and the box products ``(1 - x_i^2) >= 0`` among the g. ``method="textbook"`` leaves it there; ``"sparse"`` and
``"dense"`` reduce every semidefinite block to its face (:mod:`relaxations.reductions.facial`) and drop dependent
equalities.

References
----------
J. B. Lasserre, "Global optimization with polynomials and the problem of moments", SIAM Journal on Optimization 11
(2001) 796-817. Waki, Kim, Kojima, Muramatsu (2006), see :mod:`relaxations.reductions.sparsity`.
"""

from __future__ import annotations

from math import comb

import numpy as np

from relaxations.balls import Array, Balls
from relaxations.conic import check_memory
from relaxations.errors import ProblemError
from relaxations.moment import Localiser, Relaxation, assemble, localise, monomials_up_to
from relaxations.polynomial import Polynomials
from relaxations.problem import PolynomialProblem
from relaxations.reductions import facial
from relaxations.reductions.sparsity import cliques, row_variables

METHODS = ("sparse", "dense", "textbook")


def lasserre(
    problem: PolynomialProblem, order: int, method: str = "sparse", objective: Polynomials | None = None
) -> Relaxation:
    """Build a Lasserre relaxation of a scaled problem (all variables in [-1, 1]), as in section 4 of Lasserre (2001).

    Parameters
    ----------
    problem : PolynomialProblem
        Scaled to [-1, 1] (:class:`relaxations.reductions.scaling.Scaling`).
    order : int
        At least half of every degree.
    method : {"sparse", "dense", "textbook"}
    objective : Polynomials, optional
        Objectives with products of variables that share no constraint must be known here.

    Returns
    -------
    Relaxation

    Raises
    ------
    ProblemError
        Where the order is too low (the least one is named) or the machine's memory too small.

    Examples
    --------
    >>> import sympy; from relaxations.problem import from_sympy
    >>> x = sympy.symbols("x0:6")
    >>> chain = [v * w - sympy.Rational(1, 4) for v, w in zip(x, x[1:])]
    >>> problem, _ = from_sympy(None, chain, [], x, {v: (-1, 1) for v in x})
    >>> dense, sparse = (lasserre(problem, 2, method) for method in ("dense", "sparse"))
    >>> dense.largest_block, sparse.largest_block  # monomials up to degree 2 in six variables, and in two
    (28, 6)
    """
    own_groups = groups(problem, order, method, objective)
    one = Polynomials(1, np.zeros(1, dtype=np.int64), np.empty((1, 0), dtype=np.int64), Balls.exact([1.0]))
    equalities, localisers = [], []
    own_equalities = _assign(problem.equalities, own_groups)
    own_inequalities = _assign(problem.inequalities, own_groups)
    boxed: set[int] = set()
    for k, clique in enumerate(own_groups):
        equal = problem.equalities.take(np.array(own_equalities[k], dtype=np.int64))
        products = facial.multiplied(equal, clique, 2 * order)
        if method != "textbook" and products.n_rows > 1:
            vectors = facial.coordinates(products, monomials_up_to(clique, 2 * order))
            products = products.take(facial.independent(vectors))
        equalities.append(products)
        faces = {
            degree: None if method == "textbook" else facial.complement(equal, clique, degree)
            for degree in range(order + 1)
        }
        new = [v for v in clique if v not in boxed]
        boxed.update(new)
        unequal = Polynomials.join(
            [
                one,
                problem.inequalities.take(np.array(own_inequalities[k], dtype=np.int64)),
                *(Polynomials.from_terms([{(): 1.0, (v, v): -1.0}]) for v in new),
            ]
        )
        for degree in np.unique(unequal.row_degrees()).tolist():
            members = unequal.take(np.flatnonzero(unequal.row_degrees() == degree))
            half = order - -(-degree // 2)
            localisers.append(_localise(members, clique, half, faces[half]))
    return assemble(method, order, problem.n_variables, np.zeros(0, dtype=np.int64), equalities, localisers)


def groups(
    problem: PolynomialProblem, order: int, method: str, objective: Polynomials | None = None
) -> tuple[tuple[int, ...], ...]:
    """Return the cliques a relaxation is built on, and refuse one that cannot be built.

    Parameters
    ----------
    problem : PolynomialProblem
    order : int
    method : {"sparse", "dense", "textbook"}
    objective : Polynomials, optional
        The variables of each of its monomials lie in one clique.

    Returns
    -------
    tuple of tuple of int
        Variables of each clique, sorted.

    Raises
    ------
    ProblemError
        Where the order is too low (the least one is named) or the machine's memory too small.

    Examples
    --------
    >>> import sympy; from relaxations.problem import from_sympy
    >>> x = sympy.symbols("x0:4")
    >>> problem, _ = from_sympy(None, [v * w for v, w in zip(x, x[1:])], [], x)
    >>> groups(problem, 1, "sparse")
    ((0, 1), (1, 2), (2, 3))
    >>> groups(problem, 1, "dense")
    ((0, 1, 2, 3),)
    """
    least = max(1, -(-max(problem.degree, objective.degree if objective else 0) // 2))
    if order < least:
        raise ProblemError(f"order {order} is too low for the degrees in this problem: the least order is {least}")
    found = (tuple(range(problem.n_variables)),) if method == "dense" else cliques(problem, objective)
    widths = []
    for clique, own in zip(found, _assign(problem.inequalities, found), strict=True):
        n = len(clique)
        widths += [comb(n + order, n), *[comb(n + order - 1, n)] * (n + len(own))]
    check_memory(widths, f"order {order} with {max(map(len, found))} variables in a clique")
    return found


def _assign(polynomials: Polynomials, groups: tuple[tuple[int, ...], ...]) -> list[list[int]]:
    """Return for each clique the members that it is the first to hold."""
    sets = [set(g) for g in groups]
    holding: dict[int, list[int]] = {}
    for number, group in enumerate(groups):
        for v in group:
            holding.setdefault(v, []).append(number)
    assigned: list[list[int]] = [[] for _ in groups]
    for row, variables in enumerate(row_variables(polynomials)):
        candidates = min((holding[v] for v in variables), key=len) if variables else [0]
        assigned[next(c for c in candidates if variables <= sets[c])].append(row)
    return assigned


def _localise(members: Polynomials, clique: tuple[int, ...], degree: int, face: Array | None) -> Localiser:
    basis = monomials_up_to(clique, degree)
    congruence = None if face is None else np.broadcast_to(face, (members.n_rows, *face.shape))
    return localise(members, basis, congruence)
