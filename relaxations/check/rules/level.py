"""Rule: a bound that is proven only below a level.

Claim: ``objective >= bound`` on the set.

Proof. Let x be a point of the set. If ``objective > level`` at x, the claim holds because ``bound <= level``.
Otherwise the inequality ``level - objective >= 0`` holds at x, so the steps may use it as one more inequality, after
those stated. They prove that the objective is at least the bound there, or that there is no such point. ∎
"""

from __future__ import annotations

from dataclasses import replace

from relaxations.check.arithmetic import ONE, constant, value_range
from relaxations.check.statement import Context, Prove, Theorem, shown
from relaxations.check.steps import Level


def level(step: Level, context: Context, prove: Prove) -> list[Theorem]:
    """Return the theorem of a step."""
    context.require(step.bound <= step.level, f"bound <= level fails: {shown(step.bound)} > {shown(step.level)}")
    below = constant(step.level).plus(step.objective.scaled(-ONE))
    stated = replace(context.stated, inequalities=[*context.stated.inequalities, below])
    here = context.inside("below the level", stated)
    if not prove(step.steps, here):
        reached = [theorem.bound for theorem in here.proven if theorem.objective == step.objective]
        best = max([value_range(step.objective, here.box, context.work)[0], *reached])
        context.require(step.bound <= best, f"bound <= what the steps prove fails: {shown(step.bound)}")
    return [Theorem(context.where, step.objective, step.bound)]
