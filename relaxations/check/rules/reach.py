"""Rule: bounds of variables that have none.

Claim: ``|x_k| <= m_k tau`` for some variables x_k, with sizes m_k > 0 and a number tau that the steps prove.

Proof. Let x be a point of the set. Let ``tau >= 1`` be the least number with ``|x_k| <= m_k tau`` for each k. Let
s = 1 / tau and ``y_k = s x_k / m_k``. Further variables z ("riding") with a box [l, u] become ``y = s z``. Then
0 <= s <= 1, ``-1 <= y_k <= 1`` (one bound is 0 if the sign of x_k is known), and y lies between min(l, 0) and
max(u, 0), with ``s u - y >= 0`` and ``y - s l >= 0``.

A row that is affine in all these variables together, times s, is a row in y and s. A row without them is unchanged. No
other row may be used, and no kink. If tau > 1, then y_k is 1 or -1 for some k: x lies on a face. The faces where y_k
cannot be 1, or -1, are left out. Suppose that on each face the steps prove ``s >= s_min > 0``, or that the face is
empty. Then tau is at most the largest of 1 and all 1 / s_min. ∎
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

from relaxations.check.arithmetic import ONE, ZERO, Monomial, Polynomial, Terms
from relaxations.check.statement import Box, Context, Prove, Stated, Theorem, shown
from relaxations.check.steps import Reach


def reach(step: Reach, context: Context, prove: Prove) -> list[Theorem]:
    """Return the theorems of a step, two for each variable."""
    for k, own_size in step.sizes.items():
        context.require(own_size > 0, f"size > 0 fails for {context.name(k)}: {shown(own_size)}")
    stated, box = _cone(step, context)
    s, left = len(stated.names) - 1, {(k, side) for k in step.sizes for side in (1, -1)}
    left = {(k, side) for k, side in left if box[k][side > 0] != 0}
    tau = ONE
    for face in step.faces:
        name = f"face {context.name(face.variable)} = {face.side}"
        context.require((face.variable, face.side) in left, f"{name} is not needed, or occurs twice")
        left.remove((face.variable, face.side))
        here = context.inside(name, stated, box)
        here.box[face.variable] = (Fraction(face.side), Fraction(face.side))
        if not prove(face.steps, here):
            least = here.box[s][0]
            context.require(least > 0, f"{name}: s > 0 is not proven: {shown(least)}")
            tau = max(tau, 1 / Fraction(least))
    for k, side in sorted(left):
        context.require(False, f"face {context.name(k)} = {side} is missing")
    return [
        Theorem(context.where, Polynomial({(k,): sign}), -own_size * tau)
        for k, own_size in step.sizes.items()
        for sign in (ONE, -ONE)
    ]


def _cone(step: Reach, context: Context) -> tuple[Stated, Box]:
    """Return the constraints in y and s, s the last variable, and their box."""
    stated, s = context.stated, len(context.stated.names)
    # The box of y: [-1, 1], or one half of it if the sign of x_k is known.
    box = list(context.box)
    for k in step.sizes:
        low, high = context.box[k]
        box[k] = (ZERO if low >= 0 else -ONE, ZERO if high <= 0 else ONE)
    # The rows s u - y >= 0 and y - s l >= 0 of the riding variables.
    upper, lower = list[Polynomial](), list[Polynomial]()
    for v in step.riding:
        context.require(v not in step.sizes, f"{context.name(v)} has a size, so it cannot ride along")
        low, high = context.ends(v)
        box[v] = (min(low, ZERO), max(high, ZERO))
        upper.append(Polynomial({(s,): high, (v,): -ONE}))
        lower.append(Polynomial({(s,): -low, (v,): ONE}))
    moved = {*step.sizes, *step.riding}

    def times_s(row: Polynomial | None) -> Polynomial | None:
        degree = max((sum(v in moved for v in m) for m in row.monomials), default=0) if row else 2
        if row is None or degree > 1:
            return None
        return Polynomial(scaled(row.mid), scaled(row.rad)) if degree else row

    def scaled(terms: Terms) -> Terms:
        found: Terms = {}
        for m, value in terms.items():
            own = next((v for v in m if v in moved), None)
            key: Monomial = (*m, s) if own is None else m
            found[key] = value if own is None else value * step.sizes.get(own, ONE)
        return found

    # All rows times s; rows that are not affine become None and cannot be used.
    cone = replace(
        stated,
        names=[*stated.names, "s"],
        equalities=[times_s(row) for row in stated.equalities],
        inequalities=[*(times_s(row) for row in stated.inequalities), *upper, *lower],
        kinks=[],
        chosen={},
    )
    return cone, [*box, (ZERO, ONE)]
