"""Rule: a box by division.

Claim: ``low / b <= x <= high / b`` for the variable x of an equality ``A + B x = 0``, where neither A nor B holds x,
and ``-A`` (or ``A``, if B is negative) lies between low and high on the box. Where low > 0 it is divided by the largest
``|B|`` instead, or replaced by zero if B is no number; so is high < 0.

Proof. ``|B| >= b > 0``, because B is a number, or because a step before this one proved ``B >= b`` or ``-B >= b``. So
``x = -A / B`` has the sign of ``-A`` times that of B, and ``|x| = |A| / |B|``. ∎
"""

from __future__ import annotations

from fractions import Fraction

from relaxations.check.arithmetic import ONE, ZERO, End, Polynomial, value_range
from relaxations.check.statement import Context, Prove, Theorem
from relaxations.check.steps import Quotient


def quotient(step: Quotient, context: Context, _: Prove) -> list[Theorem]:
    """Return the theorems of a step."""
    row = context.stated.row("equality", step.equality, context.where)
    x, name = step.variable, context.name(step.variable)
    divisor, rest = Polynomial(), Polynomial()
    for m in row.monomials:
        mid, rad = row.mid.get(m, ZERO), row.rad.get(m, ZERO)
        own, others = (rest, m) if x not in m else (divisor, tuple(v for v in m if v != x))
        context.require(len(m) - len(others) <= 1, f"the equality is not affine in {name}")
        own.mid[others] = mid
        if rad:
            own.rad[others] = rad
    both = {sign: divisor.scaled(sign) for sign in (ONE, -ONE)}
    largest: Fraction | None = None
    if divisor.monomials <= {()}:
        mid, rad = divisor.mid.get((), ZERO), divisor.rad.get((), ZERO)
        away = {sign: sign * mid - rad for sign in both}
        largest = abs(mid) + rad
    else:
        away = {s: max((t.bound for t in context.proven if t.objective == both[s]), default=ZERO) for s in both}
    sign = max(both, key=lambda s: away[s])
    context.require(away[sign] > 0, f"no step before it keeps what {name} is multiplied by from zero")

    def divided(end: End) -> Fraction | None:
        """Return a lower end divided so that it stays one."""
        if not isinstance(end, Fraction):
            return None
        return end / away[sign] if end < 0 else ZERO if largest is None else end / largest

    low, high = value_range(rest.scaled(-sign), context.box, context.work)
    ends = ((ONE, divided(low)), (-ONE, divided(-high)))
    found = [Theorem(context.where, Polynomial({(x,): side}), end) for side, end in ends if end is not None]
    context.require(bool(found), f"what remains beside {name} has no bounds")
    return found
