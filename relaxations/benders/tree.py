"""Branch and bound in the outer variables with cuts: certified bounds of one of them."""

from __future__ import annotations

import heapq
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from relaxations.balls import EPSILON, Array
from relaxations.benders.cuts import frame
from relaxations.benders.master import contradiction, least, lower_bound, shrink
from relaxations.benders.search import Asker, Point

PASSES = 20  # at a node, each with fewer candidates or one cut more
FEASIBLE = 1e-9  # of the inner variables' radius: a smaller excess may be the solver's error
WORTH = 0.8  # a box that shrank to this share in some direction is worth another pass


@dataclass(frozen=True)
class Bounded:
    """What branch and bound proves of an end.

    Parameters
    ----------
    bound : float
        Of ``sign * p[target]``, certified; infinite where the box holds no feasible point.
    nodes : int
        That were looked at.
    weights : ndarray, shape (n_equalities + n_inequalities,)
        The multipliers' share in the parts that are proven empty.
    margin : float
        The least by which one of these parts misses the cuts.
    """

    bound: float
    nodes: int
    weights: Array
    margin: float


@dataclass
class _Node:
    lower: Array
    upper: Array
    bound: float


def bound_end(
    asker: Asker,
    target: int,
    sign: int,
    lower: Array,
    upper: Array,
    goal: float,
    most: int,
    feasible: Callable[[Point], float],
    report: Callable[[float], None],
) -> Bounded:
    """Bound ``sign * p[target]`` from below over the feasible points of a box.

    Parameters
    ----------
    asker : Asker
        With the cuts known so far; learns more on the way.
    target : int
        Of the outer variables.
    sign : {1, -1}
    lower, upper : ndarray, shape (n_outer,)
    goal : float
        Stop once the bound reaches this.
    most : int
        Nodes at most.
    feasible : callable
        Called with a point that seems feasible; returns the goal from then on.
    report : callable
        Called after each node with the certified bound so far; what it raises ends the search.

    Returns
    -------
    Bounded

    Examples
    --------
    >>> from relaxations.benders.cuts import Cuts
    >>> from relaxations.benders.split import Split
    >>> from relaxations.formats.expressions import problem_of, variables
    >>> a, x = variables("a x")
    >>> problem, _ = problem_of(x, [a * x == 1, a >= 0.1, a <= 2, x >= 0, x <= 2])
    >>> split = Split.of(problem, np.array([0]))
    >>> asker = Asker(Cuts.of(split, np.zeros((0, 1))))
    >>> box = problem.lower[:1], problem.upper[:1]
    >>> found = bound_end(asker, 0, 1, *box, 0.4999, 50, lambda point: 0.4999, lambda bound: None)
    >>> 0.4999 <= found.bound <= 0.5
    True
    """
    first = float(lower[target] if sign > 0 else -upper[target])
    heap: list[tuple[float, int, _Node]] = [(first, 0, _Node(lower, upper, first))]
    closed, looked, made, margin = np.inf, 0, 0, np.inf
    weights = np.zeros(asker.cuts.multipliers.shape[1])
    while heap and heap[0][0] < goal and looked < most:
        looked += 1
        node = heapq.heappop(heap)[2]
        proof, worst, met = _tighten(asker, node, target, sign, goal)
        if proof is not None:
            weights += proof[0] @ np.abs(asker.cuts.multipliers[: len(proof[0])])
            margin = min(margin, proof[1])
        if met is not None:
            goal = feasible(met)
        if node.bound >= goal:
            closed = min(closed, node.bound)
        else:
            for part in _halves(asker, node, worst):
                made += 1
                heapq.heappush(heap, (part.bound, made, part))
        report(min(closed, heap[0][0] if heap else np.inf))
    return Bounded(float(min(closed, heap[0][0] if heap else np.inf)), looked, weights, margin)


def _tighten(
    asker: Asker, node: _Node, target: int, sign: int, goal: float
) -> tuple[tuple[Array, float] | None, int, Point | None]:
    """Raise a node's bound as far as cuts go.

    Return the proof where it is empty and no point is known elsewhere, the cut to branch for, and a point that seems
    feasible.
    """
    cost = np.zeros(len(node.lower))
    worst = -1
    for _ in range(PASSES):
        centre, radius = frame(node.lower, node.upper)
        b, a = asker.cuts.on_box(node.lower, node.upper)
        left = shrink(b, a)
        if left is None:
            node.bound = np.inf
            return contradiction(b, a) if goal == np.inf else None, worst, None
        below, above = left
        if (above - below < 2 * WORTH)[radius > 0].any():
            outward = 4 * EPSILON * (np.abs(centre) + radius)
            node.lower = np.maximum(node.lower, centre + radius * below - outward)
            node.upper = np.minimum(node.upper, centre + radius * above + outward)
            node.bound = max(node.bound, float(node.lower[target] if sign > 0 else -node.upper[target]))
            if node.bound >= goal:
                break
            continue
        cost[target] = sign * radius[target]
        found = least(cost, b, a, -np.ones(len(cost)), np.ones(len(cost)))
        if found is None:
            proof = contradiction(b, a)
            node.bound = node.bound if proof is None else np.inf
            return proof, worst, None
        proven = sign * centre[target] + lower_bound(cost, b, a, found.weights)
        node.bound = max(node.bound, float(np.nextafter(proven, -np.inf)))
        if node.bound >= goal:
            break
        p = np.clip(centre + radius * found.point, node.lower, node.upper)
        # Were the cuts exact around this point, would they reach the goal? Then it is the box that is too wide.
        values, slopes = asker.cuts.tangents(p)
        hoped = least(sign * np.eye(len(p))[target], values, slopes, node.lower - p, node.upper - p)
        if worst >= 0 or hoped is None or sign * (p + hoped.point)[target] >= goal:
            return None, int(np.argmin(values)) if len(values) else -1, None
        answer = asker(p)
        worst = len(asker.cuts) - 1
        if answer is None:
            break
        if answer.excess <= FEASIBLE:
            return None, worst, answer
    return None, worst, None


def _halves(asker: Asker, node: _Node, worst: int) -> list[_Node]:
    """Cut a node's box in two, where the cut that is to be tightened loses most."""
    width = node.upper - node.lower
    losses = asker.cuts.losses(worst, node.lower, node.upper) if worst >= 0 else np.zeros(len(width))
    k = int(np.argmax(losses if losses.max() > 0 else width))
    middle = 0.5 * node.lower[k] + 0.5 * node.upper[k]
    left, right = _Node(node.lower, node.upper.copy(), node.bound), _Node(node.lower.copy(), node.upper, node.bound)
    left.upper[k] = right.lower[k] = middle
    return [left, right]
