"""Spatial branch and bound with a relaxation as its bound.

The part of the box with the lowest bound is cut in two (:mod:`relaxations.search.best_first`), in the variable with the
largest ``L(x^2) - L(x)^2``. The relaxation's error falls with the square of the box's width. The bound of every part is
certified. So the least of them is a certified bound of the whole, whenever the search stops. An equality that is a
product (:mod:`relaxations.reductions.vanishing`) is cut first, into its cases.

References
----------
R. Horst and H. Tuy, "Global Optimization: Deterministic Approaches", 3rd ed., Springer (1996), chapter IV.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from relaxations.algebra.arrays import Array, Index
from relaxations.algebra.polynomial import Polynomials
from relaxations.problem.problem import PolynomialProblem
from relaxations.proof.bounding import CertifiedBound, Relaxed
from relaxations.proof.proof_steps import Bound, Branches, Part, Recorder, Step
from relaxations.reductions.vanishing import Product, cases, products, settle
from relaxations.search.best_first import best_first

INNER = 0.2  # a cut keeps this share of the width from both ends
_Cases = list[tuple[int, Product, PolynomialProblem]]  # the variable that was cut, the product, and the part


def branch_and_bound(
    problem: PolynomialProblem,
    objective: Polynomials,
    variables: Index,
    relax: Callable[[PolynomialProblem], Relaxed],
    *,
    start: float,
    goal: Callable[[CertifiedBound | None], float],
    nodes: int,
    report: Callable[[float, float], None],
    record: Recorder | None = None,
) -> float:
    """Return a certified lower bound of an objective; infinite where the set is certified empty.

    Parameters
    ----------
    problem
        With a finite box.
    objective
        One row.
    variables
        Where the box may be cut: without them the problem is linear.
    relax
        Gives the relaxation on a smaller box.
    start
        A certified lower bound to begin with.
    goal
        Called with each certified bound (and once with None): stop once the bound of the whole reaches what it returns,
        a feasible value less the gap asked for.
    nodes
        At most so many relaxations.
    report
        Called after each node with the certified bound so far and the goal; what it raises ends the search.
    record
        Called with the tree that proves the bound, where it exceeds the one to begin with.

    Examples
    --------
    >>> from functools import partial
    >>> from relaxations.proof.bounding import relax
    >>> from relaxations.formats.expressions import problem_of, variables
    >>> x, y, z = variables("x y z")
    >>> cube = [end for v in (x, y, z) for end in (v >= -1, v <= 1)]
    >>> problem, objective = problem_of(x * y + y * z + z * x, cube)  # the minimum is -1
    >>> relaxed = partial(relax, method="sparse", order=1, objective=objective)
    >>> start = relaxed(problem).bound(objective).bound
    >>> bound = branch_and_bound(problem, objective, np.arange(3), relaxed, start=start, goal=lambda certified: -1.2,
    ...                          nodes=20, report=lambda bound, goal: None)
    >>> round(start, 3), -1.2 < bound < -1
    (-1.5, True)
    """
    if not len(variables):  # a linear problem: its relaxation is exact, and no part of the box would prove more
        return start
    enough, used = goal(None), 0
    whole = np.where(problem.upper > problem.lower, problem.upper - problem.lower, 1.0)
    vanishing = products(problem)
    root = _Node(problem, None, None)
    first = _cases(problem, vanishing, _widest(problem, variables))

    def expand(bound: float, item: tuple[_Node, _Cases]) -> Iterator[tuple[float, tuple[_Node, _Cases]]]:
        """Bound every part of a node, and say how the part is cut in its turn."""
        nonlocal enough, used
        node, parts = item
        node.children = [_Child(*part, None) for part in parts]
        for child in node.children:
            settled = settle(child.part, vanishing)
            if settled is None:  # empty
                continue
            used += 1
            relaxed = relax(settled)
            certified = relaxed.bound(objective)
            child.node = _Node(settled, relaxed if record else None, certified)
            below = max(bound, certified.bound)
            if below < enough:
                enough = goal(certified)
            parts = []
            if below < enough:
                parts = _cases(settled, vanishing, _cut(relaxed, certified, settled, variables, whole))
            yield below, (child.node, parts)

    found = best_first(
        (root, first),
        start,
        expand,
        enough=lambda: enough,
        more=lambda: used + 2 <= nodes,
        report=lambda bound: report(bound, enough),
    )
    if record and found > start:
        record(_step(root, objective, found))
    return found


@dataclass
class _Node:
    """A part of the box with its own bound, and the parts that it was cut into."""

    problem: PolynomialProblem
    relaxed: Relaxed | None
    certified: CertifiedBound | None
    children: list[_Child] = field(default_factory=list)


@dataclass
class _Child:
    """A part before vanishing products are settled on it; without a node where that showed it to be empty."""

    variable: int
    product: Product
    part: PolynomialProblem
    node: _Node | None


def _step(node: _Node, objective: Polynomials, bound: float) -> Step:
    """Return the proof of a bound: the parts whose own certificate reaches it, and how they cover the box."""
    if node.relaxed and node.certified and node.certified.certificate and node.certified.bound >= bound:
        return Bound.of(node.relaxed, objective, node.certified)
    parts = tuple(
        Part(
            child.variable,
            float(child.part.lower[child.variable]),
            float(child.part.upper[child.variable]),
            () if child.node is None else (_step(child.node, objective, bound),),
        )
        for child in node.children
    )
    # Where all parts are empty, anything is proven.
    proven = (objective, bound) if np.isfinite(bound) else (Polynomials.from_terms([{}]), 1.0)
    return Branches(node.problem, *proven, parts, node.children[0].product)


def _cases(node: PolynomialProblem, vanishing: tuple[Product, ...], cut: tuple[int, float]) -> _Cases:
    """Return parts that cover a node: the cases of the first product that is open, or its box cut in two."""
    for product in vanishing:
        found = cases(node, product)
        if found:
            able = [v for v in product if node.lower[v] <= 0.0 <= node.upper[v]]
            return [(v, product, part) for v, part in zip(able, found, strict=True)]
    k, where = cut
    below, above = node.upper.copy(), node.lower.copy()
    below[k] = above[k] = where
    return [(k, (), node.with_box(node.lower, below)), (k, (), node.with_box(above, node.upper))]


def _widest(node: PolynomialProblem, variables: Index) -> tuple[int, float]:
    """Return the variable with the widest range, and its middle."""
    width = (node.upper - node.lower)[variables]
    cut = int(variables[np.argmax(width)])
    return cut, float(0.5 * node.lower[cut] + 0.5 * node.upper[cut])


def _cut(
    relaxed: Relaxed, certified: CertifiedBound, node: PolynomialProblem, variables: Index, whole: Array
) -> tuple[int, float]:
    """Return the variable to cut, its part of the whole box counted, and where: towards the relaxation's point."""
    missed = (relaxed.variances(certified) * ((node.upper - node.lower) / whole) ** 2)[variables]
    if certified.point is None or not np.nanmax(missed, initial=0.0) > 0:
        return _widest(node, variables)
    cut = int(variables[np.nanargmax(missed)])
    low, high = float(node.lower[cut]), float(node.upper[cut])
    share = INNER * (high - low)
    return cut, float(np.clip(certified.point[cut], low + share, high - share))
