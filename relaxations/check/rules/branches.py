"""Rule: a lower bound that holds on every part.

Claim: ``objective >= bound`` on the set.

Proof. Every point lies in one of the parts (:mod:`relaxations.check.rules.parts`). A part is proven empty, or one of
its theorems bounds the same objective from below by at least the claimed bound, or its box does. ∎
"""

from __future__ import annotations

from relaxations.check.arithmetic import value_range
from relaxations.check.rules.parts import parts
from relaxations.check.statement import Context, Prove, Theorem, shown
from relaxations.check.steps import Branches


def branches(step: Branches, context: Context, prove: Prove) -> list[Theorem]:
    """Return the theorem of a step."""
    for part in parts(step.parts, step.equality, context, prove):
        if not part.empty:
            reached = [theorem.bound for theorem in part.proven if theorem.objective == step.objective]
            best = max([value_range(step.objective, part.box, context.work)[0], *reached])
            if best < step.bound:
                fails = "nothing is proven of the objective" if best == -float("inf") else shown(best)
                context.require(False, f"{part.where.rpartition(', ')[2]}: bound >= {shown(step.bound)} fails: {fails}")
    return [Theorem(context.where, step.objective, step.bound)]
