"""Tighten ends by Benders cuts: fast on long records, for the variables that complicate."""

from __future__ import annotations

from relaxations.search.benders.enclose import enclose
from relaxations.search.enclosure import Reason
from relaxations.search.interval_state import Ends
from relaxations.search.tightener import BOXES, Task


def by_cuts(task: Task, ends: Ends) -> Reason | None:
    """Tighten the ends of the targets that complicate, or of all targets where cuts are the only method."""
    problem, plan = task.problem, task.plan
    complicating = plan.complicating.tolist()
    suited = [k for k in task.targets if plan.only_cuts or k in complicating]
    wanted, others = (
        [(k, sign) for k in chosen for sign in (1, -1)]
        for chosen in (suited, [k for k in complicating if k not in suited])
    )
    ends.empty = enclose(
        problem,
        ends,
        wanted,
        plan.complicating,
        also=others,
        solver=task.solver,
        start=0.5 * problem.lower + 0.5 * problem.upper if task.start is None else task.start,
        nodes=BOXES,
        say=task.say,
        record=task.record,
    )
    if ends.empty is not None:
        return Reason.EMPTY
    if ends.tight(task.targets):
        return Reason.TIGHT
    return Reason.ROUNDS if plan.only_cuts else None
