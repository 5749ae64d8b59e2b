"""Rule: the hull of the parts.

Claim: each of some variables lies between its least and its largest value over all parts.

Proof. Every point lies in one of the parts (:mod:`relaxations.check.rules.parts`), and there in the box after the steps
of this part. A part that is proven empty has no point. ∎
"""

from __future__ import annotations

from fractions import Fraction

from relaxations.check.arithmetic import Polynomial
from relaxations.check.rules.parts import parts
from relaxations.check.statement import Context, Prove, Theorem, emptiness
from relaxations.check.steps import Hull


def hull(step: Hull, context: Context, prove: Prove) -> list[Theorem]:
    """Return the theorems of a step, two for each variable, or that the set is empty."""
    left = [part.box for part in parts(step.parts, step.equality, context, prove) if not part.empty]
    if not left:
        return [emptiness(context.where)]
    found = []
    for v in step.variables:
        for side, end in ((1, min(box[v][0] for box in left)), (-1, max(box[v][1] for box in left))):
            if isinstance(end, Fraction):
                found.append(Theorem(context.where, Polynomial({(v,): Fraction(side)}), side * end))
    return found
