"""Rule: a box by division.

Claim: ``|x| <= max |A| / b`` for the variable x of an equality ``A + B x = 0``, where neither A nor B holds x.

Proof. ``|B| >= b > 0``, because B is a number, or because a step before this one proved ``B >= b`` or ``-B >= b``. So
``|x| = |A| / |B|``, and |A| is at most the sum of its terms' largest magnitudes on the box. ∎
"""

from __future__ import annotations

from relaxations.check.arithmetic import ONE, ZERO, Polynomial
from relaxations.check.statement import Context, Prove, Theorem, size
from relaxations.check.steps import Quotient


def quotient(step: Quotient, context: Context, _: Prove) -> list[Theorem]:
    """Return the theorems of a step."""
    row = context.stated.row("equality", step.equality, context.where)
    x, name = step.variable, context.name(step.variable)
    divisor, largest = Polynomial(), ZERO
    for m in row.monomials:
        mid, rad = row.mid.get(m, ZERO), row.rad.get(m, ZERO)
        if x not in m:
            largest += (abs(mid) + rad) * size(m, context)
            continue
        rest = tuple(v for v in m if v != x)
        context.require(len(rest) == len(m) - 1, f"the equality is not affine in {name}")
        divisor.mid[rest] = mid
        if rad:
            divisor.rad[rest] = rad
    if divisor.monomials <= {()}:
        away = abs(divisor.mid.get((), ZERO)) - divisor.rad.get((), ZERO)
    else:
        both = (divisor, divisor.scaled(-ONE))
        away = max((theorem.bound for theorem in context.proven if theorem.objective in both), default=ZERO)
    context.require(away > 0, f"no step before it keeps what {name} is multiplied by from zero")
    return [Theorem(context.where, Polynomial({(x,): sign}), -largest / away) for sign in (ONE, -ONE)]
