"""Tighten ends by branch and bound, where contraction leaves a gap to a witness."""

from __future__ import annotations

from functools import partial

import numpy as np

from relaxations.proof.bounding import CertifiedBound, relax
from relaxations.search.branching import branch_and_bound
from relaxations.search.enclosure import Reason
from relaxations.search.interval_state import Ends
from relaxations.search.tightener import Task


def by_branches(task: Task, ends: Ends) -> Reason | None:
    """Branch for every end of a target that has a witness but does not meet it."""
    problem, plan = task.problem, task.plan
    for k in task.targets:
        for sign in (1, -1):
            inner = ends.inner(k)
            if np.isnan(inner[0]) or ends.end_tight(k, sign):
                continue
            start, best = (ends.lower[k], inner[0]) if sign > 0 else (-ends.upper[k], -inner[1])
            goal = float(best - ends.allowed_gap(k))
            bound = branch_and_bound(
                ends.box(problem),
                problem.variable(k, sign),
                plan.complicating,
                lambda part: relax(part, plan.method, plan.least, task.solver),
                start=float(start),
                goal=partial(_fixed, goal),
                nodes=task.nodes,
                report=lambda bound, goal: task.say(f"branching: bound {bound:.9g}, goal {goal:.9g}"),
                record=task.record,
            )
            if np.isfinite(bound):  # a witness exists, so the set is not empty
                ends.tighten(k, sign, bound)
    return Reason.TIGHT if ends.tight(task.targets) else None


def _fixed(goal: float, _: CertifiedBound | None) -> float:
    return goal
