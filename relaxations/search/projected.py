"""Intervals through a projection: the noises of curves are eliminated, and the box is contracted meanwhile.

The rows of a projection (:mod:`relaxations.reductions.projection`) may have slacks that shrink with the box. So it is
made again on the box that is proven, until no row has a slack, or the box no longer shrinks. While there are slacks,
points are searched and verified with the inner rows, which have none.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from relaxations.algebra.arrays import Array, Index
from relaxations.points.witness import find_witness
from relaxations.proof.proof_steps import Fixed, Quotient, Step
from relaxations.reductions.projection import Projection
from relaxations.search.enclosure import Enclosure, Reason
from relaxations.search.interval_state import Ends, shrinkage
from relaxations.search.tightener import Task

FAST = 0.3  # a pass of one round that takes more off some width than this is followed by another
STALLED = 0.01
PASSES = 30
ENDED = (Reason.EMPTY, Reason.TIME, Reason.INTERRUPTED, Reason.MEMORY)


def through_projection(
    projection: Projection, task: Task, ends: Ends, tightened: Callable[[Task, Ends], Enclosure]
) -> Enclosure:
    """Tighten the ends of a task through a projection of its problem."""
    started = time.perf_counter()
    kept, targets = projection.kept, list(task.targets)
    own_targets = np.searchsorted(kept, targets).tolist()
    plan = replace(task.plan, projection=None)
    pool = [point[kept] for point in ends.pool]
    start = None if task.start is None else task.start[kept]
    status: dict[tuple[int, int], str] = {}
    solves, whole = 0, False
    for _ in range(PASSES):
        _narrow(projection, task, ends)
        part = projection.on(ends.lower, ends.upper)
        whole = whole or part.exact
        if whole and task.witnesses and not part.exact:
            pool += _points(projection, ends, own_targets, plan.complicating, pool, start)
        steps: list[Step] = []
        found_ends = Ends(
            part.problem.lower.copy(), part.problem.upper.copy(), ends.tolerance, ends.absolute, pool, status
        )
        found = tightened(
            replace(
                task,
                problem=part.problem,
                targets=own_targets,
                # Cuts verify points with the rows that they bound; a slack would let too many pass.
                plan=plan if part.exact else plan.without_cuts,
                rounds=task.rounds if whole else 1,
                witnesses=task.witnesses and part.exact,
                start=start,
                record=steps.append if task.record else None,
            ),
            found_ends,
        )
        solves += found.solves
        if task.record and steps:
            task.record(Fixed(part, tuple(steps)))
        if found.empty is not None:
            break
        before = (ends.upper - ends.lower)[targets]
        ends.lower[kept], ends.upper[kept] = found_ends.lower, found_ends.upper
        shrunk = shrinkage(before, (ends.upper - ends.lower)[targets])
        if part.exact or found.reason in (*ENDED, Reason.TIGHT) or (whole and shrunk < STALLED):
            break
        whole = whole or shrunk < FAST
    return _in_all_variables(projection, task, ends, replace(found, solves=solves), time.perf_counter() - started)


def _narrow(projection: Projection, task: Task, ends: Ends) -> None:
    """Narrow the variables that projected equalities give explicitly."""
    ends.lower, ends.upper, given = projection.narrowed(ends.lower, ends.upper)
    if task.record:
        for equality, variable in given:
            task.record(Quotient(projection.problem, equality, variable))


def _points(
    projection: Projection, ends: Ends, targets: list[int], complicating: Index, pool: list[Array], start: Array | None
) -> list[Array]:
    """Return verified points far out towards all ends."""
    inner = projection.inner(ends.lower, ends.upper)
    found = list[Array]()
    first = 0.5 * inner.lower + 0.5 * inner.upper if start is None else np.clip(start, inner.lower, inner.upper)
    for k in targets:
        for sign in (1, -1):
            begin = min([*pool, *found], key=lambda point: sign * point[k], default=first)
            point = find_witness(inner, inner, inner.variable(k, sign), complicating, begin)
            if point is not None:
                found.append(point.point)
    return found


def _in_all_variables(projection: Projection, task: Task, ends: Ends, found: Enclosure, seconds: float) -> Enclosure:
    """Return an enclosure with the points, the ends and the weights of all variables and equalities."""
    problem = task.problem
    intervals = tuple(
        replace(interval, from_box=(interval.lower == problem.lower[k], interval.upper == problem.upper[k]))
        for k, interval in zip(task.targets, found.intervals, strict=True)
    )
    empty = found.empty
    if empty is not None:
        weights = np.zeros(problem.equalities.n_rows)
        weights[projection.left] = empty.weights
        empty = replace(empty, weights=weights)
    points = tuple(projection.recover(point, ends.lower, ends.upper) for point in found.witnesses)
    return replace(found, intervals=intervals, witnesses=points, empty=empty, seconds=seconds)
