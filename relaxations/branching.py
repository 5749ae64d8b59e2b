"""Spatial branch and bound on the complicating variables, with a relaxation of the least order as its bound.

Where contraction stalls, the box of the complicating variables is cut in two, again and again, always the half with the
lowest bound first. The relaxation's error falls with the square of the box's width. Every leaf's bound is certified, so
the least of them is a certified bound of the whole, whenever one stops.

References
----------
R. Horst and H. Tuy, "Global Optimization: Deterministic Approaches", 3rd ed., Springer (1996), chapter IV.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable

import numpy as np

from relaxations.balls import Index
from relaxations.bounding import relax
from relaxations.polynomial import Polynomials
from relaxations.problem import PolynomialProblem


def branch_and_bound(
    problem: PolynomialProblem,
    objective: Polynomials,
    complicating: Index,
    *,
    start: float,
    goal: float,
    order: int,
    nodes: int,
    solver: str = "clarabel",
    progress: Callable[[str], None] | None = None,
) -> float:
    """Raise a certified lower bound of an objective.

    Parameters
    ----------
    problem : PolynomialProblem
        With a finite box, which is cut in the ``complicating`` variables.
    objective : Polynomials
        One row.
    complicating : ndarray of int
    start : float
        A certified lower bound to begin with.
    goal : float
        Stop once the bound reaches it: a witness's value less the gap asked for.
    order : int
        Of the lift in every node.
    nodes : int
        At most so many relaxations.
    solver : str
    progress : callable, optional

    Returns
    -------
    float
        Certified; infinite where the set is certified empty.
    """
    width = problem.upper - problem.lower
    heap = [(start, 0, problem)]
    closed, used = np.inf, 0
    while heap and heap[0][0] < goal and used + 2 <= nodes:
        bound, _, node = heapq.heappop(heap)
        share = (node.upper - node.lower)[complicating] / np.where(width > 0, width, 1.0)[complicating]
        cut = int(complicating[np.argmax(share)])
        middle = 0.5 * node.lower[cut] + 0.5 * node.upper[cut]
        for low, high in ((node.lower[cut], middle), (middle, node.upper[cut])):
            lower, upper = node.lower.copy(), node.upper.copy()
            lower[cut], upper[cut] = low, high
            child = node.with_box(lower, upper)
            used += 1
            below = max(bound, relax(child, "lift", order, solver).bound(objective).bound)
            if below >= goal:
                closed = min(closed, below)
            else:
                heapq.heappush(heap, (below, used, child))
        if progress:
            progress(f"branching: bound {min(closed, heap[0][0] if heap else np.inf):.6g}, goal {goal:.6g}")
    return float(min(closed, heap[0][0] if heap else np.inf))
