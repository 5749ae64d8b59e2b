"""Lasserre's moment relaxations: dense, or sparse by cliques of variables, by terms and by sign symmetry.

For each clique I of variables, with ``b_k`` all monomials in x_I up to degree k, the relaxation of order d is:

    L(b_d b_d') >= 0,   L(g b b') >= 0 with deg(g b b') <= 2 d,   L(h m) = 0 with deg(h m) <= 2 d.

The polynomials g contain ``1 - x_i^2``. The dense relaxation has one clique with all variables.

- ``"textbook"`` is this relaxation without changes; solvers fail on it if there are equalities.
- All other methods reduce every block to its face (:mod:`relaxations.moments.facial`) and drop dependent equalities.
- ``"sparse"`` and ``"dense"`` use sign symmetry if the objective is known (:mod:`relaxations.moments.symmetry`). The
  bound does not change.
- ``"terms"`` and ``"chordal"`` use term sparsity in each clique (:mod:`relaxations.moments.terms`).

References
----------
J. B. Lasserre, "Global optimization with polynomials and the problem of moments", SIAM Journal on Optimization 11
(2001) 796-817. Waki, Kim, Kojima, Muramatsu (2006), see :mod:`relaxations.reductions.sparsity`.
"""

from __future__ import annotations

from collections import Counter
from math import comb

import numpy as np

from relaxations.algebra.arrays import Index
from relaxations.algebra.polynomial import Polynomials, unique
from relaxations.deadline import check_time
from relaxations.errors import ProblemError
from relaxations.moments import facial, symmetry, terms
from relaxations.moments.blocks import Clique, Split, unsplit
from relaxations.moments.conic import check_memory
from relaxations.moments.moment import Localiser, Relaxation, assemble, localise
from relaxations.problem.problem import PolynomialProblem
from relaxations.reductions.sparsity import cliques, row_variables

METHODS = ("sparse", "dense", "terms", "chordal", "textbook")
BY_TERMS = ("terms", "chordal")
CURE = "lower the order, or choose method='lift' or 'sparse'"
MOST = 5000  # monomials of a basis; a longer basis is not split


def lasserre(
    problem: PolynomialProblem,
    order: int | tuple[int, ...],
    method: str = "sparse",
    objective: Polynomials | None = None,
    steps: int = 1,
) -> Relaxation:
    """Return a Lasserre relaxation of a scaled problem (section 4 of Lasserre 2001).

    Parameters
    ----------
    problem
        Scaled to [-1, 1] (:class:`relaxations.reductions.scaling.Scaling`).
    order
        At least half of every degree; or one order for each clique.
    method
        One of {"sparse", "dense", "terms", "chordal", "textbook"}.
    objective
        In the scaled variables; one row for each objective of the relaxation. A split by symmetry or by terms has no
        moments for other objectives. Without it there is no split by symmetry, and a split by terms serves single
        variables.
    steps
        Number of extensions of the support, for ``"terms"`` and ``"chordal"``. More steps give equal or tighter bounds.

    Raises
    ------
    ProblemError
        When the order is too low (the message names the least order) or the machine's memory is too small.

    Examples
    --------
    >>> import sympy; from relaxations.problem.problem import from_sympy
    >>> x = sympy.symbols("x0:6")
    >>> chain = [v * w - sympy.Rational(1, 4) for v, w in zip(x, x[1:])]
    >>> problem, objective = from_sympy(x[0]**2, chain, [], x, {v: (-1, 1) for v in x})
    >>> dense, sparse = (lasserre(problem, 2, method) for method in ("dense", "sparse"))
    >>> dense.largest_block, sparse.largest_block  # monomials up to degree 2 in six variables, and in two
    (28, 6)
    >>> lasserre(problem, 2, "sparse", objective).largest_block  # split into even and odd degrees
    4
    """
    # Of each clique: linearly independent equalities, and blocks reduced to their faces.
    equalities, localisers = [], []
    for clique, kept in plan(problem, order, method, objective, steps):
        check_time()
        products = clique.multiples.take(kept.multiples)
        if method != "textbook" and products.n_rows > 1:
            occurring, _ = unique(products.factors)
            products = products.take(facial.independent_rows(facial.coordinates(products, occurring)))
        equalities.append(products)
        localisers += _localisers(clique, kept, reduced=method != "textbook")
    highest = order if isinstance(order, int) else max(order)
    return assemble(method, highest, problem.n_variables, np.zeros(0, dtype=np.int64), equalities, localisers)


def plan(
    problem: PolynomialProblem,
    order: int | tuple[int, ...],
    method: str,
    objective: Polynomials | None = None,
    steps: int = 1,
) -> tuple[tuple[Clique, Split], ...]:
    """Return the constraints that a relaxation keeps of each clique; see :func:`lasserre` for the arguments."""
    if steps < 1:
        raise ProblemError(f"steps is {steps}: at least one is needed")
    found = groups(problem, order if isinstance(order, int) else min(order), method, objective)
    orders = (order,) * len(found) if isinstance(order, int) else order
    if len(orders) != len(found):
        raise ProblemError(f"{len(orders)} orders were given for {len(found)} cliques: give one, or one for each")
    # Sign symmetry keeps the bound of an objective only if the objective has the symmetry.
    own_inequalities = _assign(problem.inequalities, found)
    signs = np.zeros((0, problem.n_variables), dtype=np.bool_)
    if method in ("sparse", "dense") and objective is not None:
        signs = symmetry.sign_symmetries(problem, objective)
    sizes = [comb(len(clique) + own, own) for clique, own in zip(found, orders, strict=True)]
    what = f"order {max(orders)} with {max(map(len, found))} variables in a clique"
    # Check the memory before splitting, where no split can make the blocks smaller.
    if max(sizes) > MOST or not (len(signs) or method in BY_TERMS):
        widths = []
        for clique, own, rows, size in zip(found, orders, own_inequalities, sizes, strict=True):
            widths += [size, *[comb(len(clique) + own - 1, own - 1)] * (len(clique) + len(rows))]
        check_memory(Counter(widths), 0, what, CURE)
    parts = _cliques(problem, orders, found, own_inequalities)
    if method in BY_TERMS:
        support = Polynomials.variables(np.arange(problem.n_variables)) if objective is None else objective
        splits = terms.split(parts, support, steps, chordal=method == "chordal")
    else:
        splits = tuple(symmetry.split(clique, signs) if len(signs) else unsplit(clique) for clique in parts)
    check_memory(Counter(width for kept in splits for width in kept.widths), 0, what, CURE)
    return tuple(zip(parts, splits, strict=True))


def groups(
    problem: PolynomialProblem, order: int, method: str, objective: Polynomials | None = None
) -> tuple[tuple[int, ...], ...]:
    """Return the sorted variables of each clique of a relaxation; ProblemError if the order is too low."""
    least = max(1, -(-max(problem.degree, objective.degree if objective else 0) // 2))
    if order < least:
        raise ProblemError(f"order {order} is too low for the degrees in this problem: the least order is {least}")
    return (tuple(range(problem.n_variables)),) if method == "dense" else cliques(problem, objective)


def _cliques(
    problem: PolynomialProblem,
    orders: tuple[int, ...],
    groups: tuple[tuple[int, ...], ...],
    own_inequalities: list[list[int]],
) -> tuple[Clique, ...]:
    """Return each clique with its constraints; a constraint belongs to the first clique that contains it."""
    own_equalities = _assign(problem.equalities, groups)
    boxed: set[int] = set()
    found = []
    for k, (variables, order) in enumerate(zip(groups, orders, strict=True)):
        check_time()
        equal = problem.equalities.take(np.array(own_equalities[k], dtype=np.int64))
        new = [v for v in variables if v not in boxed]
        boxed.update(new)
        unequal = [
            Polynomials.from_terms([{(): 1.0}]),
            problem.inequalities.take(np.array(own_inequalities[k], dtype=np.int64)),
            *(Polynomials.from_terms([{(): 1.0, (v, v): -1.0}]) for v in new),
        ]
        multiples = facial.multiples(equal, variables, 2 * order)
        found.append(Clique(variables, order, equal, multiples, Polynomials.join(unequal)))
    return tuple(found)


def _assign(polynomials: Polynomials, groups: tuple[tuple[int, ...], ...]) -> list[list[int]]:
    """Return the row numbers of the polynomials of each clique: each belongs to the first clique that contains it."""
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


def _localisers(clique: Clique, kept: Split, reduced: bool) -> list[Localiser]:
    """Return the kept blocks, reduced to their faces; inequalities with equal degree and block share one localiser."""
    found = []
    degrees = clique.inequalities.row_degrees()
    bases = clique.bases()
    vectors = {
        half: facial.multiple_vectors(clique.equalities, clique.variables, half) if reduced else None for half in bases
    }
    for degree in np.unique(degrees).tolist():
        half = clique.order - -(-degree // 2)
        sharing: dict[bytes, tuple[Index, list[int]]] = {}
        for row in np.flatnonzero(degrees == degree).tolist():
            for block in kept.blocks[row]:
                sharing.setdefault(block.tobytes(), (block, []))[1].append(row)
        for block, rows in sharing.values():
            null = vectors.get(half)
            face = None if null is None else facial.face_basis(facial.vectors_within(null, block))
            if face is not None and not face.shape[1]:
                continue  # the equalities make the block zero
            members = clique.inequalities.take(np.array(rows, dtype=np.int64))
            congruence = None if face is None else np.broadcast_to(face, (len(rows), *face.shape))
            found.append(localise(members, bases[half][block], congruence))
    return found
