"""The parametric lift: moments of degree up to 2d in few complicating variables, and linear in all other variables.

Let ``p`` be a smallest set of variables such that every constraint is affine in the other variables ``z``. The lift of
order d has the moments ``p^a`` and ``p^a z_i`` with ``|a| <= 2d``:

- an equality ``h(p, z) = 0`` of degree k in p gives ``L(h p^a) = 0`` for ``|a| <= 2d - k``;
- an inequality ``g(p, z) >= 0`` with ``2d - k = 2m`` gives ``L(g b_m b_m') >= 0`` and, for every i,
  ``L(g (1 - p_i^2) b_{m-1} b_{m-1}') >= 0``;
- with ``2d - k = 2m + 1`` it gives ``L(g (1 +- p_i) b_m b_m') >= 0``, which imply ``L(g b_m b_m') >= 0``;
- ``1 +- z_i >= 0`` and ``1 >= 0`` are inequalities of degree 0;
- an inequality of degree ``k > 2d`` is left out: the set only becomes larger.

On an interval, the multipliers are all nonnegative polynomials of their degree (Lukacs). At fixed ``p`` the problem is
linear in ``z``. By duality, with multipliers that are polynomials in ``p``, the bounds converge as d grows.

``method="rlt"``, reformulation-linearisation, has the same moments and equalities. Its inequalities are products with
bound factors instead of matrices, so it is a linear program:

    L(g prod_i (1 - p_i)^{k_i} (1 + p_i)^{l_i}) >= 0,    sum_i k_i + l_i = 2d - k.

Products with fewer factors are sums of these, because ``(1 - p_i) + (1 + p_i) = 2``. With one complicating variable,
the lift of the same order is at least as tight. With several variables, neither implies the other.

References
----------
C. W. Scherer and C. W. J. Hol, "Matrix sum-of-squares relaxations for robust semi-definite programs",
Mathematical Programming 107 (2006) 189-211. H. D. Sherali and W. P. Adams, "A hierarchy of relaxations between the
continuous and convex hull representations for zero-one programming problems", SIAM J. Discrete Math. 3 (1990) 411-430.
D. Handelman, "Representing polynomials by positive linear functions on compact convex polyhedra", Pacific J. Math. 132
(1988) 35-62.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from functools import reduce
from itertools import combinations_with_replacement
from math import comb

import numpy as np

from relaxations.algebra.arrays import Index
from relaxations.algebra.polynomial import Polynomials, unique
from relaxations.deadline import check_time
from relaxations.errors import ProblemError
from relaxations.moments.conic import FEWER, check_memory
from relaxations.moments.moment import Localiser, Relaxation, assemble, localise, monomials_up_to
from relaxations.problem.problem import PolynomialProblem

METHODS = ("lift", "rlt")
MOST_COMPLICATING = 6


def complicating_variables(problem: PolynomialProblem, most: int = MOST_COMPLICATING) -> Index | None:
    """Return a smallest set of variables such that every monomial is affine in the others; None if it exceeds ``most``.

    The set must contain a variable of every pair of factors. So it is a minimum vertex cover of the graph of pairs,
    found by branching on the vertex of highest degree.

    Examples
    --------
    >>> import sympy; from relaxations.problem.problem import from_sympy
    >>> a, x, y = sympy.symbols("a x y")
    >>> problem, _ = from_sympy(None, [], [x + a * y - 1], [a, x, y])
    >>> complicating_variables(problem)
    array([0])
    """
    needed, rest = _pairs(problem)
    # A vertex with more than ``most`` neighbours must be in the cover, because its neighbours cannot all be.
    needed |= {v for v, n in rest.items() if len(n) > most}
    rest = {v: left for v, n in rest.items() if v not in needed and (left := n - needed)}
    for size in range(most - len(needed) + 1):
        cover = _vertex_cover(rest, size)
        if cover is not None:
            return np.array(sorted(needed | cover), dtype=np.int64)
    return None


def _pairs(problem: PolynomialProblem) -> tuple[set[int], dict[int, set[int]]]:
    """Return the variables that occur squared, and for each other variable those in the same monomial."""
    squared: set[int] = set()
    neighbours: dict[int, set[int]] = {}
    for family in (problem.equalities, problem.inequalities):
        high = unique(family.factors[family.term_degrees >= 2])[0]
        for left in range(high.shape[1]):
            for right in range(left + 1, high.shape[1]):
                pair = high[high[:, left] >= 0][:, [left, right]]
                for u, v in np.unique(pair, axis=0).tolist():
                    if u == v:
                        squared.add(u)
                    else:
                        neighbours.setdefault(u, set()).add(v)
                        neighbours.setdefault(v, set()).add(u)
    return squared, {v: n - squared for v, n in neighbours.items() if v not in squared}


def _vertex_cover(neighbours: dict[int, set[int]], size: int) -> set[int] | None:
    """Return a vertex cover with at most ``size`` vertices, or None."""
    if not neighbours:
        return set()
    if size == 0:
        return None
    vertex = max(neighbours, key=lambda v: (len(neighbours[v]), -v))
    for chosen in ({vertex}, neighbours[vertex]):
        if len(chosen) <= size:
            remaining = {v: n - chosen for v, n in neighbours.items() if v not in chosen}
            cover = _vertex_cover({v: n for v, n in remaining.items() if n}, size - len(chosen))
            if cover is not None:
                return cover | chosen
    return None


def nonlinear_variables(problem: PolynomialProblem) -> Index:
    """Return a set of variables, found greedily, such that every monomial is affine in the others."""
    squared, rest = _pairs(problem)
    chosen = set(squared)
    while any(rest.values()):
        most = max(rest, key=lambda v: len(rest[v]))
        chosen.add(most)
        rest = {v: n - {most} for v, n in rest.items() if v != most}
    return np.array(sorted(chosen), dtype=np.int64)


def least_order(families: Sequence[Polynomials], complicating: Index) -> int:
    """Return the least order of a lift that has all rows: half of the largest degree that complicates, at least 1."""
    degree = max(int(degrees_in(f, complicating).max(initial=0)) for f in families)
    return max(1, -(-degree // 2))


def lift(
    problem: PolynomialProblem, order: int, method: str = "lift", objective: Polynomials | None = None
) -> Relaxation:
    """Return the parametric lift of a scaled problem (all variables in [-1, 1]), or its linear variant.

    Parameters
    ----------
    problem
        Scaled to [-1, 1] (:class:`relaxations.reductions.scaling.Scaling`).
    order
        d >= 1.
    method
        One of {"lift", "rlt"}.
    objective
        In the scaled variables. The variables of its products complicate as well.

    Raises
    ------
    ProblemError
        When there are more than six complicating variables, the order is too low, or the memory is too small.

    Examples
    --------
    >>> import sympy; from relaxations.problem.problem import from_sympy
    >>> a, *y = sympy.symbols("a y0:10")
    >>> recursion = [after - a * before for before, after in zip(y, y[1:])]
    >>> problem, _ = from_sympy(None, [], recursion, [a, *y], {v: (-1, 1) for v in (a, *y)})
    >>> lift(problem, 2).largest_block  # for any number of y; the dense relaxation has 78
    3
    >>> lift(problem, 2, "rlt").largest_block
    1
    """
    complicating = lifted_variables(problem, order, method, objective)
    equalities = []
    for degree, members in _by_degree(problem.equalities, complicating):
        equalities.append(members.times_monomials(monomials_up_to(complicating, 2 * order - degree)))

    localisers: list[Localiser] = []
    for degree, members in _inequalities(problem, order, complicating):
        for factor, half in _multiples(complicating, 2 * order - degree, method):
            check_time()
            localisers.append(localise(_times(members, factor), monomials_up_to(complicating, half)))
    singles = np.arange(problem.n_variables, dtype=np.int64).reshape(-1, 1)
    return assemble(method, order, problem.n_variables, complicating, equalities, localisers, [singles])


def lifted_variables(
    problem: PolynomialProblem, order: int, method: str = "lift", objective: Polynomials | None = None
) -> Index:
    """Return the complicating variables of a lift; ProblemError if the lift cannot be built, as in :func:`lift`."""
    whole = problem if objective is None else problem.with_inequalities(objective)
    complicating = complicating_variables(whole)
    if complicating is None:
        raise ProblemError(
            f"more than {MOST_COMPLICATING} variables would have to be complicating: the parametric lift does not "
            "apply; choose method='sparse'"
        )
    least = least_order([problem.equalities, *([] if objective is None else [objective])], complicating)
    if order < least:
        raise ProblemError(f"order {order} is too low for the degrees in this problem: the least order is {least}")
    # Count terms, block widths and moments, and compare their memory with the machine's.
    n = len(complicating)
    terms = 0
    for degree, members in _by_degree(problem.equalities, complicating):
        terms += len(members.rows) * comb(n + 2 * order - degree, n)
    widths: Counter[int] = Counter()
    for degree, members in _inequalities(problem, order, complicating):
        for factor, half in _multiples(complicating, 2 * order - degree, method):
            width = comb(n + half, n)
            widths[width] += members.n_rows
            terms += len(members.rows) * len(factor.rows) * (width * (width + 1) // 2)
    moments = (1 + problem.n_variables - n) * comb(n + 2 * order, n)
    names = ", ".join(problem.names[k] for k in complicating)
    check_memory(
        widths,
        terms,
        f"the {method} of order {order} in {names or 'no variable'} has {moments} moments and {terms} terms; it",
        f"lower the order, or {FEWER}",
    )
    return complicating


def _inequalities(problem: PolynomialProblem, order: int, complicating: Index) -> list[tuple[int, Polynomials]]:
    """Return the polynomials g >= 0 by degree, up to that of the lift.

    They are the constant 1, the inequalities, and the bounds of the other variables z.
    """
    own = np.setdiff1d(np.arange(problem.n_variables), complicating)
    box = [Polynomials.variables(own, sign, 1.0) for sign in (-1.0, 1.0)]
    bounded = Polynomials.join([Polynomials.from_terms([{(): 1.0}]), problem.inequalities, *box])
    return [(degree, members) for degree, members in _by_degree(bounded, complicating) if degree <= 2 * order]


def _multiples(complicating: Index, degree: int, method: str) -> list[tuple[Polynomials, int]]:
    """Return the box factors that raise an inequality by a degree, each with the degree of its basis."""
    if method == "rlt":
        return [(factor, 0) for factor in _bound_factors(complicating, degree)]
    half, odd = divmod(degree, 2)
    if odd and len(complicating):
        return [
            (Polynomials.from_terms([{(): 1.0, (p,): s}]), half) for p in complicating.tolist() for s in (1.0, -1.0)
        ]
    found = [(Polynomials.from_terms([{(): 1.0}]), half)]
    if half:
        found += [(Polynomials.from_terms([{(): 1.0, (p, p): -1.0}]), half - 1) for p in complicating.tolist()]
    return found


def _bound_factors(complicating: Index, degree: int) -> list[Polynomials]:
    """Return all products of ``degree`` factors ``1 - p_i`` or ``1 + p_i``; their coefficients are integers."""
    found = [Polynomials.from_terms([{(): 1.0}])]
    single = [Polynomials.from_terms([{(): 1.0, (p,): sign}]) for p in complicating.tolist() for sign in (-1.0, 1.0)]
    if single:
        found = [
            reduce(Polynomials.times, chosen, found[0]) for chosen in combinations_with_replacement(single, degree)
        ]
    return found


def degrees_in(polynomials: Polynomials, complicating: Index) -> Index:
    """Return the degree of each polynomial in the complicating variables, shape (n_rows,)."""
    degrees = np.zeros(polynomials.n_rows, dtype=np.int64)
    np.maximum.at(degrees, polynomials.rows, np.isin(polynomials.factors, complicating).sum(axis=1))
    return degrees


def _by_degree(polynomials: Polynomials, complicating: Index) -> list[tuple[int, Polynomials]]:
    """Return the polynomials grouped by their degree in the complicating variables."""
    degrees = degrees_in(polynomials, complicating)
    return [(int(k), polynomials.take(np.flatnonzero(degrees == k))) for k in np.unique(degrees)]


def _times(members: Polynomials, factor: Polynomials) -> Polynomials:
    """Return all polynomials times one polynomial."""
    parts, count = members.times_monomials(factor.factors), len(factor.factors)
    coefficients = parts.coefficients * factor.coefficients[parts.rows % count]
    return Polynomials(members.n_rows, parts.rows // count, parts.factors, coefficients)
