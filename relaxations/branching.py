"""Spatial branch and bound with a relaxation as its bound.

The box is cut in two, again and again, always the part with the lowest bound first, in the variable whose square the
relaxation misses most, ``L(x^2) - L(x)^2``. The relaxation's error falls with the square of the box's width. Every
leaf's bound is certified, so the least of them is a certified bound of the whole, whenever one stops. An equality that
is a product (:mod:`relaxations.reductions.vanishing`) is cut first, into its cases.

References
----------
R. Horst and H. Tuy, "Global Optimization: Deterministic Approaches", 3rd ed., Springer (1996), chapter IV.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable

import numpy as np

from relaxations.balls import Array, Index
from relaxations.bounding import Outcome, Relaxed
from relaxations.polynomial import Polynomials
from relaxations.problem import PolynomialProblem
from relaxations.reductions.vanishing import Product, cases, products, settle

INNER = 0.2  # a cut keeps this share of the width from both ends


def branch_and_bound(
    problem: PolynomialProblem,
    objective: Polynomials,
    variables: Index,
    relax: Callable[[PolynomialProblem], Relaxed],
    *,
    start: float,
    goal: Callable[[Outcome | None], float],
    nodes: int,
    report: Callable[[float, float], None],
) -> float:
    """Raise a certified lower bound of an objective.

    Parameters
    ----------
    problem : PolynomialProblem
        With a finite box.
    objective : Polynomials
        One row.
    variables : ndarray of int
        Where the box may be cut: without them the problem is linear.
    relax : callable
        Gives the relaxation on a smaller box.
    start : float
        A certified lower bound to begin with.
    goal : callable
        Called with each outcome (and once with None): stop once the bound reaches what it returns, a feasible value
        less the gap asked for.
    nodes : int
        At most so many relaxations.
    report : callable
        Called after each node with the certified bound so far and the goal; what it raises ends the search.

    Returns
    -------
    float
        Certified; infinite where the set is certified empty.

    Examples
    --------
    >>> from functools import partial
    >>> from relaxations.bounding import relax
    >>> from relaxations.formats.expressions import problem_of, variables
    >>> x, y, z = variables("x y z")
    >>> cube = [end for v in (x, y, z) for end in (v >= -1, v <= 1)]
    >>> problem, objective = problem_of(x * y + y * z + z * x, cube)  # the minimum is -1
    >>> relaxed = partial(relax, method="sparse", order=1, objective=objective)
    >>> start = relaxed(problem).bound(objective).bound
    >>> bound = branch_and_bound(problem, objective, np.arange(3), relaxed, start=start, goal=lambda outcome: -1.2,
    ...                          nodes=20, report=lambda bound, goal: None)
    >>> round(start, 3), -1.2 < bound < -1
    (-1.5, True)
    """
    enough = goal(None)
    whole = np.where(problem.upper > problem.lower, problem.upper - problem.lower, 1.0)
    vanishing = products(problem)
    closed, used = np.inf, 0
    heap = [(start, 0, _parts(problem, vanishing, _widest(problem, variables)))]
    while heap and heap[0][0] < enough and used + 2 <= nodes:
        bound, _, parts = heapq.heappop(heap)
        for part in parts:
            child = settle(part, vanishing)
            if child is None:
                continue
            used += 1
            relaxed = relax(child)
            outcome = relaxed.bound(objective)
            below = max(bound, outcome.bound)
            if below < enough:
                enough = goal(outcome)
            if below >= enough:
                closed = min(closed, below)
            else:
                cut = _cut(relaxed, outcome, child, variables, whole)
                heapq.heappush(heap, (below, used, _parts(child, vanishing, cut)))
        report(min(closed, heap[0][0] if heap else np.inf), enough)
    return float(min(closed, heap[0][0] if heap else np.inf))


def _parts(node: PolynomialProblem, vanishing: tuple[Product, ...], cut: tuple[int, float]) -> list[PolynomialProblem]:
    """Return parts that cover a node: the cases of the first product that is open, or its box cut in two."""
    for product in vanishing:
        found = cases(node, product)
        if found:
            return found
    k, where = cut
    below, above = node.upper.copy(), node.lower.copy()
    below[k] = above[k] = where
    return [node.with_box(node.lower, below), node.with_box(above, node.upper)]


def _widest(node: PolynomialProblem, variables: Index) -> tuple[int, float]:
    width = (node.upper - node.lower)[variables]
    cut = int(variables[np.argmax(width)])
    return cut, float(0.5 * node.lower[cut] + 0.5 * node.upper[cut])


def _cut(
    relaxed: Relaxed, outcome: Outcome, node: PolynomialProblem, variables: Index, whole: Array
) -> tuple[int, float]:
    """Return the variable to cut, its part of the whole box counted, and where: towards the relaxation's point."""
    missed = (relaxed.variances(outcome) * ((node.upper - node.lower) / whole) ** 2)[variables]
    if outcome.point is None or not np.nanmax(missed, initial=0.0) > 0:
        return _widest(node, variables)
    cut = int(variables[np.nanargmax(missed)])
    low, high = float(node.lower[cut]), float(node.upper[cut])
    share = INNER * (high - low)
    return cut, float(np.clip(outcome.point[cut], low + share, high - share))
