"""Branch and bound in the outer variables with cuts: certified bounds of one of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.algebra.ball_arithmetic import EPSILON
from relaxations.deadline import STOPS
from relaxations.search.benders.master import Shrunk, contradiction, least, lower_bound, shrink
from relaxations.search.benders.search import Asker, Point
from relaxations.search.benders.split import frame
from relaxations.search.best_first import best_first

PASSES = 20  # at a node, each with fewer candidates or one cut more
FEASIBLE = 1e-9  # of the inner variables' radius: a smaller excess may be the solver's error
NARROW = 1e-12  # of the values: a narrower box is not cut, for what keeps its bound is rounding
WORTH = 0.8  # a box that shrank to this share in some direction is worth another pass


@dataclass(frozen=True)
class Claim:
    """A step of the proof: nonnegative weights of cuts, on the box that the steps before it allow.

    It bounds ``sign * p[variable]``; without a variable it bounds zero, which proves the box empty.
    """

    variable: int | None
    sign: int
    bound: float
    weights: Array


@dataclass
class Node:
    """A box of the outer variables, its bound and the claims that prove it, and the parts that it was cut into."""

    lower: Array
    upper: Array
    bound: float
    claims: list[Claim] = field(default_factory=list)
    parts: list[Node] = field(default_factory=list)
    cut: int | None = None
    range: tuple[float, float] = (-np.inf, np.inf)


@dataclass(frozen=True)
class Bounded:
    """What branch and bound proves of an end: a certified bound, infinite where the box holds no feasible point.

    Parameters
    ----------
    weights
        Shape (n_equalities + n_inequalities,). The multipliers' share in the parts that are proven empty.
    margin
        The least by which one of these parts misses the cuts.
    stop
        What ended the search early.
    """

    bound: float
    nodes: int
    root: Node
    weights: Array
    margin: float
    stop: BaseException | None = None


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
    """Bound ``sign * p[target]`` from below over the feasible points of a box, with at most so many nodes.

    It stops once the bound reaches the goal. ``feasible`` is called with a point that seems feasible, and returns the
    goal from then on; ``report`` is called with each certified bound that is better than the last.
    """
    first = float(lower[target] if sign > 0 else -upper[target])
    root = Node(lower, upper, first)
    bound, looked, margin, stuck = first, 0, np.inf, False
    weights = np.zeros(asker.cuts.multipliers.shape[1])

    def expand(_: float, node: Node) -> Iterator[tuple[float, Node]]:
        """Raise a node's bound by cuts; cut its box in two where that does not reach the goal."""
        nonlocal goal, looked, weights, margin, stuck
        looked += 1
        proof, worst, met = _tighten(asker, node, target, sign, goal)
        if proof is not None:
            weights = weights + proof[0] @ np.abs(asker.cuts.multipliers[: len(proof[0])])
            margin = min(margin, proof[1])
        if met is not None:
            goal = feasible(met)
        stuck = node.bound < goal and _is_narrow(node)
        if node.bound >= goal or stuck:
            yield node.bound, node
        else:
            node.parts = _halves(asker, node, worst)
            yield from ((part.bound, part) for part in node.parts)

    def better(found: float) -> None:
        nonlocal bound
        if found > bound:
            bound = found
            report(bound)

    stop: BaseException | None = None
    try:
        best_first(root, first, expand, enough=lambda: goal, more=lambda: looked < most and not stuck, report=better)
    except STOPS as early:  # the tree keeps what is proven so far
        stop = early
    return Bounded(bound, looked, root, weights, margin, stop)


def _tighten(
    asker: Asker, node: Node, target: int, sign: int, goal: float
) -> tuple[tuple[Array, float] | None, int, Point | None]:
    """Raise a node's bound as far as cuts go.

    Return the proof where the node is empty and no point is known elsewhere, the cut to branch for, and a point that
    seems feasible.
    """
    cost = np.zeros(len(node.lower))
    worst = -1
    for _ in range(PASSES):
        node.bound = max(node.bound, float(node.lower[target] if sign > 0 else -node.upper[target]))
        if node.bound >= goal:
            break
        # Shrink the box by single cuts first; repeat the pass where that took much.
        centre, radius = frame(node.lower, node.upper)
        b, a = asker.cuts.on_box(node.lower, node.upper)
        left = shrink(b, a)
        if left.empty or (left.upper - left.lower < 2 * WORTH)[radius > 0].any():
            _take(node, left, centre, radius, b, a)
            if left.empty:
                node.bound = np.inf
                return contradiction(b, a) if goal == np.inf else None, worst, None
            continue
        # Bound the end by the linear program over all cuts.
        cost[target] = sign * radius[target]
        found = least(cost, b, a, -np.ones(len(cost)), np.ones(len(cost)))
        if found is None:
            proof = contradiction(b, a)
            if proof is not None:
                node.bound = np.inf
                node.claims.append(Claim(None, 1, proof[1], proof[0]))
            return proof, worst, None
        proven = float(np.nextafter(sign * centre[target] + lower_bound(cost, b, a, found.weights), -np.inf))
        if proven > node.bound:
            node.bound = proven
            node.claims.append(Claim(target, sign, proven, found.weights))
        if node.bound >= goal:
            break
        p = np.clip(centre + radius * found.point, node.lower, node.upper)
        # Were the cuts exact around this point, would they reach the goal? Then it is the box that is too wide.
        values, slopes = asker.cuts.tangents(p)
        values = values + asker.cuts.rounding(np.abs(asker.cuts.split.values(p)))
        hoped = least(sign * np.eye(len(p))[target], values, slopes, node.lower - p, node.upper - p)
        if worst >= 0 or hoped is None or sign * (p + hoped.point)[target] >= goal:
            return None, int(np.argmin(values)) if len(values) else -1, None
        # Learn a new cut at the minimiser, for the next pass.
        answer = asker(p)
        worst = len(asker.cuts) - 1
        if answer is None:
            break
        if answer.excess <= FEASIBLE:
            return None, worst, answer
    return None, worst, None


def _take(node: Node, left: Shrunk, centre: Array, radius: Array, b: Array, a: Array) -> None:
    """Take a node's box to the part that rows allow, claim by claim."""
    outward = 4 * EPSILON * (np.abs(centre) + radius)
    node.lower, node.upper = node.lower.copy(), node.upper.copy()

    def alone(row: int, weight: float) -> Array:
        weights = np.zeros(len(b))
        weights[row] = weight
        return weights

    for j, side, row, end in left.taken:
        bound = side * centre[j] + side * radius[j] * end - outward[j]
        node.claims.append(Claim(j, side, float(bound), alone(row, radius[j] / abs(a[row, j]))))
        if side > 0:
            node.lower[j] = max(node.lower[j], bound)
        else:
            node.upper[j] = min(node.upper[j], -bound)
    if left.failing is not None:
        most = a[left.failing] * np.where(a[left.failing] > 0, left.upper, left.lower)
        node.claims.append(Claim(None, 1, 0.5 * float(-b[left.failing] - most.sum()), alone(left.failing, 1.0)))


def _is_narrow(node: Node) -> bool:
    """Return whether a box is a point but for rounding."""
    return bool((node.upper - node.lower <= NARROW * np.maximum(np.abs(node.lower), np.abs(node.upper))).all())


def _halves(asker: Asker, node: Node, worst: int) -> list[Node]:
    """Cut a node's box in two, where the cut that is to be tightened loses most."""
    width = node.upper - node.lower
    losses = asker.cuts.losses(worst, node.lower, node.upper) if worst >= 0 else np.zeros(len(width))
    k = int(np.argmax(losses if losses.max() > 0 else width))
    middle = float(0.5 * node.lower[k] + 0.5 * node.upper[k])
    below, above = node.upper.copy(), node.lower.copy()
    below[k] = above[k] = middle
    low, high = float(node.lower[k]), float(node.upper[k])
    return [
        Node(node.lower, below, node.bound, cut=k, range=(low, middle)),
        Node(above, node.upper, node.bound, cut=k, range=(middle, high)),
    ]
