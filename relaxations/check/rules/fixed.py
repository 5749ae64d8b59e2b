"""Rule: inequalities that follow from an equality with some variables fixed.

Claim: the theorems of the steps, with further rows ``sign h(x; v = e) + slack >= 0``: an equality h with numbers e in
place of variables v.

Proof. Let x be a point of the set, so that ``h(x) = 0``. The v are fixed one after the other. With h_i for h after the
first i of them, ``sign h(x; v = e) = sign h(x) - sum_i sign (h_{i-1}(x) - h_i(x))``. In each term ``v = v_i`` lies in
its box [l, u], so ``v = l + (u - l) t`` with t in [0, 1], and ``h_{i-1} = sum_m a_m t^m`` of degree n. There
``h_{i-1} = sum_j b_j B_j(t)`` with ``b_j = sum_m a_m C(j, m) / C(n, m)`` and the Bernstein polynomials B_j >= 0, which
add up to one. So ``sign (h_{i-1}(x) - h_i(x))`` is at most the largest ``sign (b_j(x) - h_i(x))``, and at most an upper
bound of these polynomials on the set. In ``h_i`` t is a number, so that each is a sum over the a_m. The slack is at
least the sum of such bounds, or of zero where they are lower. An upper bound of a polynomial D is that on the box, or
that of ``D + T`` on the box minus b, for a step before this one that proved ``T >= b``. ∎
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from math import comb

from relaxations.check.arithmetic import ZERO, End, Polynomial, constant, substituted, value_range
from relaxations.check.rules.bound import affine
from relaxations.check.statement import Context, Prove, Theorem, emptiness, shown
from relaxations.check.steps import Fixed, FixedRow


def fixed(step: Fixed, context: Context, prove: Prove) -> list[Theorem]:
    """Return the theorems of the steps inside a step."""
    rows = [_row(f"row {k}", row, context) for k, row in enumerate(step.rows)]
    stated = replace(context.stated, inequalities=[*context.stated.inequalities, *rows])
    here = replace(context, stated=stated, proven=[])
    return [*here.proven, emptiness(context.where)] if prove(step.steps, here) else here.proven


def _row(place: str, row: FixedRow, context: Context) -> Polynomial:
    """Return ``sign h(x; v = e) + slack`` once the slack is large enough."""
    h = context.stated.row("equality", row.equality, context.where).scaled(Fraction(row.sign))
    needed: End = ZERO
    for v, value in row.values:
        needed += max(_excess(h, v, value, context), ZERO)
        h = substituted(h, {v: constant(value)}, context.work)
    context.require(needed <= row.slack, f"{place}: slack >= {shown(needed)} fails: {shown(row.slack)}")
    return h.plus(constant(row.slack))


def _excess(h: Polynomial, v: int, value: Fraction, context: Context) -> End:
    """Return an upper bound of ``h(x) - h(x; v = value)`` on the set."""
    low, high = context.ends(v)
    context.require(low < high, f"the box of {context.name(v)} is a point")
    in_t = substituted(h, {v: affine(low, high - low, v)}, context.work)
    n, t = max((m.count(v) for m in in_t.monomials), default=0), (value - low) / (high - low)
    bounds: list[End] = []
    for j in range(n + 1):
        difference = Polynomial()
        for m in in_t.monomials:
            power, key = m.count(v), tuple(w for w in m if w != v)
            own = Polynomial({key: in_t.mid.get(m, ZERO)}, {key: in_t.rad.get(m, ZERO)})
            difference.add(own, Fraction(comb(j, power), comb(n, power)) - t**power)
        bounds.append(_upper_bound(difference, context))
    return max(bounds)


def _upper_bound(difference: Polynomial, context: Context) -> End:
    """Return an upper bound of a polynomial, by the box or by a theorem about the same monomials."""
    best = value_range(difference, context.box, context.work)[1]
    monomials = difference.monomials - {()}
    context.work.spend(4 * len(context.proven))
    for theorem in context.proven:
        if best > 0 and theorem.objective.monomials - {()} == monomials:
            rest = difference.plus(Polynomial(theorem.objective.mid))
            best = min(best, value_range(rest, context.box, context.work)[1] - theorem.bound)
    return best
