"""Tighten ends by rounds of certified bounds: relax, bound every watched variable, take the bounds as the new box.

All bounds of a round are computed on one relaxation. The smaller box makes the next relaxation tighter. Lower orders
cost a fraction of the highest one and go first.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.deadline import map_in_time
from relaxations.points.witness import find_witness
from relaxations.problem.problem import PolynomialProblem
from relaxations.proof.bounding import CLOSE, CertifiedBound, Emptiness, Relaxed, relax
from relaxations.proof.proof_steps import Bound
from relaxations.search.enclosure import Reason
from relaxations.search.interval_state import Ends, shrinkage
from relaxations.search.tightener import Task

WORTH_STAYING = 0.5  # a round at a lower order that takes less off every width than this leads to the next order
STALLED = 0.01
LARGE = 10  # moments for each variable
THINNER = 0.1  # of the tolerated gap: a shorter certificate may lose so much


def by_rounds(task: Task, ends: Ends) -> Reason | None:
    """Contract the box until the ends meet their witnesses, it no longer shrinks, or the rounds are used up."""
    plan, targets = task.plan, task.targets
    watched = sorted({*targets, *(plan.complicating.tolist() if plan.lifts else ())})
    ends.order = plan.least
    for ends.rounds in range(1, task.rounds + 1):
        ends.relaxed = relax(ends.box(task.problem), plan.method, ends.order, task.solver)
        lower, upper = ends.lower.copy(), ends.upper.copy()
        ends.empty = _round(task, ends, ends.relaxed, watched)
        if ends.empty is not None:
            return Reason.EMPTY
        if task.witnesses and ends.tight(targets):
            return Reason.TIGHT
        # Stay at this order while a watched variable shrinks, then raise the order, then stop.
        shrunk = shrinkage((upper - lower)[watched], (ends.upper - ends.lower)[watched])
        if ends.order < plan.order and shrunk < WORTH_STAYING:
            ends.order += 1
        elif shrunk < STALLED:
            return Reason.STALLED
    return None


def _round(task: Task, ends: Ends, relaxed: Relaxed, watched: Sequence[int]) -> Emptiness | None:
    """Bound every watched variable once; update the ends; return the proof where the set is empty."""
    problem = task.problem
    # Each end is looked at when its turn comes: a witness of this round may have settled it.
    open_ends = (
        (k, sign)
        for k in watched
        for sign in (1, -1)
        if ends.lower[k] < ends.upper[k] and not (k in task.targets and task.witnesses and ends.end_tight(k, sign))
    )
    # What a solver loses shrinks with the box, so it need not be small beside the gap before the last round.
    bound = partial(_bound, problem, relaxed, ends)
    # Beside a large relaxation the linear programs of a witness cost little.
    large = relaxed.relaxation.n_moments > LARGE * problem.n_variables
    for (k, sign), certified in map_in_time(task.executor, bound, open_ends):
        ends.solves += 1
        ends.status[k, sign] = certified.status
        if certified.certificate is None:
            continue
        # Take the bound as the new end, and record it where it gained.
        empty = certified.bound == np.inf
        width = ends.upper[k] - ends.lower[k]
        gained = 0.0 if empty else ends.tighten(k, sign, certified.bound)
        if task.record and (empty or gained > 0):
            task.record(Bound.of(relaxed, problem.variable(k, sign), certified))
        # Two proven bounds that contradict each other prove the set empty as well.
        if empty or ends.lower[k] > ends.upper[k]:
            return relaxed.emptiness(certified.certificate)
        # Look for a witness once the end has settled, or where the search costs little.
        settled = ends.rounds == task.rounds or large or gained < 0.1 * width
        if task.witnesses and k in task.targets and settled and certified.point is not None:
            _try_witness(task, ends, certified.point, k, sign)
        task.say(f"{problem.names[k]} in [{ends.lower[k]:.6g}, {ends.upper[k]:.6g}]")
    return None


def _bound(
    problem: PolynomialProblem, relaxed: Relaxed, ends: Ends, end: tuple[int, int]
) -> tuple[tuple[int, int], CertifiedBound]:
    """Bound one end."""
    low, high = ends.inner(end[0])
    loss = THINNER * ends.tolerance * (high - low) if high > low else 0.0
    return end, relaxed.bound(problem.variable(*end), max(CLOSE, 0.1 * ends.tolerance), loss)


def _try_witness(task: Task, ends: Ends, point: Array, k: int, sign: int) -> None:
    """Look for a verified point that pushes an end outwards, from the relaxation's point and the best one known."""
    starts = [point, *([min(ends.pool, key=lambda p: sign * p[k])] if ends.pool else [])]
    for start in starts:
        if task.search is not None:
            found = task.search(ends.lower, ends.upper, start, k, sign)
        else:
            box, objective = ends.box(task.problem), task.problem.variable(k, sign)
            found = find_witness(box, task.problem, objective, task.plan.complicating, start)
        if found is not None:
            ends.pool.append(found.point)
            if task.search is None or ends.end_tight(k, sign):  # a search within a part may end far inside
                return
