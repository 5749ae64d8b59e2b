"""Intervals through a projection: the noises of curves are eliminated, and the box is contracted meanwhile.

The rows of a projection (:mod:`relaxations.reductions.projection`) may have slacks that shrink with the box. So it is
made again on the box that is proven, until no row has a slack, or the box no longer shrinks. While there are slacks,
points are searched and verified with the inner rows, which have none.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from enum import Enum
from functools import partial

import numpy as np

from relaxations.algebra.arrays import Array, Index
from relaxations.deadline import STOPS, stopped_by
from relaxations.points.witness import Witness, find_witness
from relaxations.proof.bounding import relax
from relaxations.proof.proof_steps import Bound, Fixed, Quotient, Step
from relaxations.reductions.projection import Key, Projected, Projection
from relaxations.search.enclosure import Enclosure, Reason
from relaxations.search.interval_state import Ends, shrinkage
from relaxations.search.plan import Plan
from relaxations.search.tightener import Task

FAST = 0.3  # a pass of one round that takes more off some width than this is followed by another
STALLED = 0.05
PASSES = 2  # for each round that is allowed
SINGLES = 3  # rows that are turned one by one
GAINED = 1e-3  # share of the width: a turn of rows that moves a point by less is not taken
ENDED = (Reason.EMPTY, Reason.TIME, Reason.INTERRUPTED, Reason.MEMORY)


class _Stage(Enum):
    """What a pass is for: to shrink the box, look for points, shrink slacks too, look again and end."""

    BOX = 0
    LOOK = 1
    CAP = 2
    END = 3


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
    caps: dict[Key, float] = {}
    solves, stage = 0, _Stage.BOX
    for last in (*[False] * PASSES * task.rounds, True):
        _narrow(projection, task, ends)
        part = projection.on(ends.lower, ends.upper, caps)
        final = part.exact or last or stage is _Stage.END
        look = final or stage is _Stage.LOOK
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
                rounds=task.rounds if look else 1,
                witnesses=task.witnesses and look,
                search=None if part.exact else partial(_search, projection, ends, plan.complicating),
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
        if final or found.reason in (*ENDED, Reason.TIGHT):
            break
        if stage is _Stage.BOX:
            stage = stage if shrunk > FAST else _Stage.LOOK
        else:
            try:
                capped = _cap(projection, part, ends, task, plan, caps, shrunk > STALLED)
            except STOPS as stop:  # the ends are proven
                found = replace(found, reason=Reason[stopped_by(stop)])
                break
            solves += capped
            stage = _Stage.CAP if capped else _Stage.END
    return _in_all_variables(projection, task, replace(found, solves=solves), time.perf_counter() - started)


def _narrow(projection: Projection, task: Task, ends: Ends) -> None:
    """Narrow the variables that projected equalities give explicitly."""
    ends.lower, ends.upper, given = projection.narrowed(ends.lower, ends.upper)
    if task.record:
        for equality, variable in given:
            task.record(Quotient(projection.problem, equality, variable))


def _cap(
    projection: Projection, part: Projected, ends: Ends, task: Task, plan: Plan, caps: dict[Key, float], again: bool
) -> int:
    """Bound the differences that leave a slack by the relaxation, which may decide their sign; return their number.

    Those that have a bound by now are bounded ``again`` where the box has shrunk.
    """
    relaxed = relax(part.problem, plan.method, plan.least, task.solver)
    steps: list[Step] = []
    todo = [d for d in projection.differences(ends.lower, ends.upper, caps) if again or d.key not in caps]
    for difference in todo:
        certified = relaxed.bound(difference.objective)
        if certified.certificate is not None and np.isfinite(certified.bound):
            bound = float(np.nextafter(difference.error - certified.bound, np.inf))
            caps[difference.key] = min(bound, caps.get(difference.key, bound))
            steps.append(Bound.of(relaxed, difference.objective, certified))
    if task.record and steps:
        task.record(Fixed(part, tuple(steps)))
    return len(todo)


def _search(
    projection: Projection, ends: Ends, complicating: Index, lower: Array, upper: Array, start: Array, k: int, sign: int
) -> Witness | None:
    """Look for a verified point with inner rows that suit the start, and turn those that the point is pinched by."""
    box = [ends.lower.copy(), ends.upper.copy()]
    for own, end in zip(box, (lower, upper), strict=True):
        own[projection.kept] = end

    def found_from(point: Array, turned: Index) -> Witness | None:
        inner = projection.inner(box[0], box[1], point, turned)
        return find_witness(inner, inner, inner.variable(k, sign), complicating, point)

    best = found_from(start, np.zeros(0, dtype=np.int64))
    turns = [] if best is None else _turns(projection.pinched(best.point))
    while best is not None and turns:
        other = found_from(best.point, np.array(turns.pop(0)))
        if other is not None and other.value < best.value - GAINED * (upper[k] - lower[k]):
            best = other
            turns = _turns(projection.pinched(best.point))
    return best


def _turns(pinched: list[int]) -> list[list[int]]:
    """Return the rows to be turned, in turn: all together, then some one by one."""
    singles = [[one] for one in pinched[:SINGLES]] if len(pinched) > 1 else []
    return [pinched, *singles] if pinched else []


def _in_all_variables(projection: Projection, task: Task, found: Enclosure, seconds: float) -> Enclosure:
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
    points = tuple(projection.recover(point) for point in found.witnesses)
    return replace(found, intervals=intervals, witnesses=points, empty=empty, seconds=seconds)
