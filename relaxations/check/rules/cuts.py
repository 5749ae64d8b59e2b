"""Rule: a lower bound by cuts in the outer variables p (generalised Benders decomposition).

Claim: ``objective >= bound`` on the set, for an objective in the outer variables.

Proof. Multipliers, nonnegative for inequalities, sum the constraints to a cut ``C = c_0(p) + sum_i c_i(p) z_i``, with
C >= 0 on the set, and z_i the other variables, in ``|z_i - m_i| <= q_i``. So ``c_i z_i <= c_i m_i + q_i |c_i|``. With
p_k = middle + radius t_k, t in [-1, 1], each c_i lies in [-l, h] by the sizes of its terms, where l, h >= 0. For any
share in [-1, 1] then ``|c_i| <= share c_i + max((1 - share) h, (1 + share) l)``: both sides are compared at c_i >= 0
and at c_i <= 0. This gives a polynomial U(t) >= C, and radii of coefficients add at most radius times size. With
weights w >= 0, ``objective >= objective - sum w C >= objective - sum w U``, which is bounded as in
:mod:`relaxations.check.rules.bound`. ∎
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from math import lcm

from relaxations.check.arithmetic import ONE, ZERO, Monomial, Polynomial, Terms, substituted
from relaxations.check.rules.bound import affine, reached
from relaxations.check.statement import Context, Prove, Theorem, shown, size
from relaxations.check.steps import Cuts


@dataclass(frozen=True)
class _Split:
    """A cut by inner variables, -1 for none: terms in the outer ones, whole numbers over one denominator."""

    parts: dict[int, list[tuple[Monomial, int]]]
    outer: set[Monomial]  # that occur in the terms
    denominator: int
    rad: Terms  # radii of the coefficients, with monomials in all variables


def cuts(step: Cuts, context: Context, _: Prove) -> list[Theorem]:
    """Return the theorem of a step."""
    context.require(step.objective.variables <= step.outer, "the objective holds an inner variable")
    in_t = {}
    for v in sorted(step.outer):
        low, high = context.ends(v)
        in_t[v] = affine((low + high) / 2, (high - low) / 2, v)
    residual = substituted(step.objective, in_t, context.work).plus(Polynomial())
    expanded: dict[Monomial, Terms] = {}
    for number, weight in step.weights:
        context.require(weight >= 0, f"weight >= 0 fails: {shown(weight)}")
        split = _split(number, step.outer, context)
        unknown = sum((rad * size(m, context) for m, rad in split.rad.items()), ZERO)
        for m in split.outer - expanded.keys():
            expanded[m] = substituted(Polynomial({m: ONE}), in_t, context.work).mid
        upper = Polynomial(_upper(split, expanded, context), {(): unknown} if unknown else {})
        residual.add(upper, -weight)
    return [reached(context, step.objective, step.bound, residual)]


def _split(number: int, outer: frozenset[int], context: Context) -> _Split:
    """Return the sum of the constraints times the multipliers of a cut."""
    memory = context.stated.memory
    if (number, outer) not in memory:
        cut, total = context.stated.cut(number, context.where), Polynomial()
        for kind, pairs in (("equality", cut.equalities), ("inequality", cut.inequalities)):
            for k, weight in pairs:
                legal = kind == "equality" or weight >= 0
                context.require(legal, f"cut {number}: multiplier >= 0 fails: {shown(weight)}")
                total.add(context.stated.row(kind, k, context.where), weight)
        context.work.spend(len(total.mid))
        denominator = lcm(*(value.denominator for value in total.mid.values()))
        parts: dict[int, list[tuple[Monomial, int]]] = {}
        for m, value in total.mid.items():
            inner = [v for v in m if v not in outer]
            context.require(len(inner) <= 1, f"cut {number} is not affine in the inner variables")
            own = tuple(v for v in m if v in outer)
            whole = value.numerator * (denominator // value.denominator)
            parts.setdefault(inner[0] if inner else -1, []).append((own, whole))
        used = {m for terms in parts.values() for m, _ in terms}
        memory[number, outer] = _Split(parts, used, denominator, total.rad)
    found: _Split = memory[number, outer]
    return found


def _upper(split: _Split, expanded: Mapping[Monomial, Terms], context: Context) -> Terms:
    """Return U: a polynomial in t that is at least the cut, but for the radii of its coefficients.

    ``expanded`` gives the monomials in the outer variables as polynomials in t.
    """
    # Integers over one denominator, because there are many coefficients.
    terms_of = {m: expanded[m] for m in split.outer}
    monomials = sorted({key for own in terms_of.values() for key in own} | {()}, key=len)
    unit = lcm(*(value.denominator for own in terms_of.values() for value in own.values()))
    place = {key: i for i, key in enumerate(monomials)}
    rows = {m: [(place[key], int(unit * value)) for key, value in own.items()] for m, own in terms_of.items()}
    ends = {v: context.ends(v) for v in split.parts if v >= 0}
    wide = lcm(*(end.denominator for pair in ends.values() for end in pair))
    context.work.spend(1 + (sum(map(len, split.parts.values())) * len(monomials) + len(ends)) // 8)
    total, one = [0] * len(monomials), 1 << 53
    for z, terms in split.parts.items():
        own = [0] * len(monomials)
        for m, value in terms:
            for i, whole in rows[m]:
                own[i] += value * whole
        factor = 2 * wide * one
        if z >= 0:
            low, high = (end.numerator * (wide // end.denominator) for end in ends[z])
            reach = sum(map(abs, own[1:]))
            above, below = max(own[0] + reach, 0), max(reach - own[0], 0)
            share = one * (above - below) // (above + below) if above + below else 0
            factor = (high + low) * one + (high - low) * share
            total[0] += (high - low) * max((one - share) * above, (one + share) * below)
        for i, value in enumerate(own):
            total[i] += factor * value
    whole = 2 * split.denominator * unit * wide * one
    return {m: Fraction(n, whole) for m, n in zip(monomials, total, strict=True)}
