"""Branch and bound in outline: split the part with the least bound, again and again.

What a part is, how it is bounded and how it is split are left to the caller
(:mod:`relaxations.search.branching`, :mod:`relaxations.search.benders.tree`).
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterable
from typing import TypeVar

import numpy as np

Node = TypeVar("Node")


def best_first(
    root: Node,
    start: float,
    expand: Callable[[float, Node], Iterable[tuple[float, Node]]],
    *,
    enough: Callable[[], float],
    more: Callable[[], bool],
    report: Callable[[float], None],
) -> float:
    """Return a lower bound of the whole: the least bound among the parts that are left and those that are closed.

    Parameters
    ----------
    start
        A bound of the root.
    expand
        Yields bound and node of parts that cover a node, itself among them where its bound was raised.
    enough
        Returns the bound at which a part is closed; it may fall while a node is expanded.
    report
        Called with the bound after each node; what it raises ends the search.
    """
    # The count keeps nodes of equal bound in order, so that nodes are never compared.
    heap, count, closed = [(start, 0, root)], 0, np.inf
    while heap and heap[0][0] < enough() and more():
        bound, _, node = heapq.heappop(heap)
        for own, part in expand(bound, node):
            if own >= enough():
                closed = min(closed, own)
            else:
                count += 1
                heapq.heappush(heap, (own, count, part))
        report(float(min(closed, heap[0][0] if heap else np.inf)))
    return float(min(closed, heap[0][0] if heap else np.inf))
