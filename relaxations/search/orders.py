"""The orders that a search for a minimum tries: the lowest first, and unasked only those whose blocks are narrow.

With cliques of variables each clique may have an order of its own. Where the moment matrix of a clique is flat, its
moments are those of points, and a higher order there would improve nothing. So an order beyond 2 is first tried in the
cliques whose moments are not flat: at most one relaxation more for each order, and often the last. (Order 1 is
tightened by products of constraints, and raised everywhere.)
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import comb
from typing import NamedTuple

import numpy as np

from relaxations.algebra.polynomial import Polynomials
from relaxations.errors import ProblemError
from relaxations.moments.lasserre_hierarchy import BY_TERMS, groups
from relaxations.moments.lasserre_hierarchy import plan as blocks
from relaxations.points.extraction import is_flat
from relaxations.problem.problem import PolynomialProblem
from relaxations.proof.bounding import CertifiedBound, Relaxed
from relaxations.proof.method import LASSERRE, Order
from relaxations.reductions.scaling import Scaling
from relaxations.search.plan import Plan

WIDEST = 70  # an order whose widest block is beyond this is not tried unasked: a bound would cost minutes
HIGHEST = 6  # nor an order beyond this
STEPS = 3  # of term sparsity at each order
NODE_WIDEST = 20


class Way(NamedTuple):
    """A relaxation to try: its order (one for each clique where they differ), steps, and the width that it costs as."""

    order: Order
    steps: int
    width: float


def check_orders(plan: Plan, problem: PolynomialProblem, objective: Polynomials) -> None:
    """Refuse blocks that are too wide at the highest order, or at the least one where none is asked for."""
    if isinstance(plan.method, LASSERRE):
        _widths(plan, problem, objective, plan.asked or plan.least, 1)
    else:
        plan.method.check(problem, plan.order)


def ways(
    plan: Plan, problem: PolynomialProblem, objective: Polynomials, suspects: Callable[[], set[int]]
) -> Iterator[Way]:
    """Yield the relaxations to try, one by one.

    Parameters
    ----------
    suspects
        Called when the order is about to be raised: the cliques of the last relaxation where that may help.

    Examples
    --------
    >>> from relaxations.formats.expressions import problem_of, variables
    >>> x, y, z = v = variables("x y z")
    >>> problem, objective = problem_of(x * y + y * z, [end for w in v for end in (w >= -1, w <= 1)])
    >>> plan = Plan.of(problem, "sparse", 3, objective)
    >>> [way.order for way in ways(plan, problem, objective, lambda: {1})]  # of the cliques (x, y) and (y, z)
    [1, 2, (2, 3), 3]
    """
    least, highest, method = plan.least, plan.asked, plan.method.name
    if not isinstance(plan.method, LASSERRE):
        yield from (Way(order, 1, 0.0) for order in range(least, plan.order + 1))
        return
    scaled, goal = _scaled(problem, objective)
    cliques = range(len(groups(scaled, least, method, goal)))
    for order in range(least, (highest or max(least, HIGHEST)) + 1):
        before: list[int] = []
        for steps in range(1, STEPS + 1 if method in BY_TERMS else 2):
            try:
                widths = _widths(plan, problem, objective, order, steps)
            except ProblemError:  # beyond the memory
                return
            # Blocks by terms are narrow but many: what counts is the one block that would cost as much.
            cost = float(np.sum(np.array(widths) ** 4.0) ** 0.25)
            width = cost if method in BY_TERMS else max(widths)
            if width > WIDEST and steps == 1 and order > (highest or least):
                return
            if widths == before or (width > WIDEST and steps > 1):
                break
            # Raise the order in the cliques alone whose moments are not flat, before raising it everywhere.
            if method == "sparse" and order > max(least, 2):
                raised = suspects()
                if 0 < len(raised) < len(cliques):
                    yield Way(tuple(order if k in raised else order - 1 for k in cliques), 1, cost)
            yield Way(order, steps, cost)
            before = widths


def not_flat(relaxed: Relaxed, objective: Polynomials, certified: CertifiedBound, order: Order) -> set[int]:
    """Return the cliques of a sparse relaxation whose moments are not flat, by their numbers."""
    if certified.moments is None:
        return set()
    step = max(1, -(-relaxed.problem.degree // 2))
    goal = relaxed.scaling.polynomials(objective)
    found = groups(relaxed.scaled, relaxed.relaxation.order, "sparse", goal)
    orders = (order,) * len(found) if isinstance(order, int) else order
    # Of a variable that is fixed the scaled problem says nothing, and its moments are anything.
    said = {int(v) for p in (relaxed.scaled.equalities, relaxed.scaled.inequalities, goal) for v in p.occurring()}
    return {
        k
        for k, (own, d) in enumerate(zip(found, orders, strict=True))
        if said & set(own) and not is_flat(relaxed.relaxation, certified.moments, own, d, step)
    }


def node_order(plan: Plan, problem: PolynomialProblem, objective: Polynomials) -> int:
    """Return the order of branch and bound: small blocks allow a higher one, on boxes that have no symmetry."""
    if not isinstance(plan.method, LASSERRE):
        return plan.least
    largest = max(map(len, groups(problem, plan.least, plan.method.name, objective)))
    orders = range(plan.least, (plan.asked or max(plan.least, HIGHEST)) + 1)
    return max((order for order in orders if comb(largest + order, order) <= NODE_WIDEST), default=plan.least)


def _widths(plan: Plan, problem: PolynomialProblem, objective: Polynomials, order: int, steps: int) -> list[int]:
    """Return the widths of the semidefinite blocks."""
    scaled, goal = _scaled(problem, objective)
    return [width for _, split in blocks(scaled, order, plan.method.name, goal, steps) for width in split.widths]


def _scaled(problem: PolynomialProblem, objective: Polynomials) -> tuple[PolynomialProblem, Polynomials]:
    scaling = Scaling.of_box(problem)
    return scaling.apply(problem), scaling.polynomials(objective)
