"""Rule: a lower bound by sums of squares (Putinar's certificate, with its remainder bounded).

Claim: ``objective >= bound`` on the set. Given are a centre c and a scale s, polynomials p_k, weights w_j >= 0, sums of
squares sigma_j, and g_j, each a product of inequalities and of ``1 - t_i``, ``1 + t_i`` or ``1 - t_i^2``.

Proof. Let x be a point of the set. For every variable that occurs below, ``s_i >= 0``; where s_i is zero, the box is
the point c_i. So there is a t with ``x_i = c_i + s_i t_i``. At this t let

    r = objective - sum_k p_k h_k - sum_j w_j sigma_j g_j,       h_k the equalities, all polynomials written in t.

For every variable that occurs in r, the box lies in ``[c_i - s_i, c_i + s_i]``, so that ``-1 <= t_i <= 1``. Where
``1 + t_i`` is used, the box begins at ``c_i - s_i`` or later; where ``1 - t_i`` is, it ends at ``c_i + s_i`` or before;
``1 - t_i^2`` needs both. (Other variables need no box: a disc bounds both of its own.)
There h_k = 0, w_j >= 0, sigma_j >= 0 and g_j >= 0, so ``objective >= r``. As every monomial of r lies in [-1, 1],
``r >= r_0 - sum_{i > 0} |r_i|``, and the claimed bound is at most this number, for all coefficients in their balls. ∎
"""

from __future__ import annotations

from fractions import Fraction

from relaxations.check.arithmetic import ONE, ZERO, Polynomial, constant, substituted, sum_of_squares
from relaxations.check.statement import Context, Prove, Theorem, shown
from relaxations.check.steps import Bound


def bound(step: Bound, context: Context, _: Prove) -> list[Theorem]:
    """Return the theorem of a step."""
    work, known = context.work, dict[tuple[str, int], Polynomial]()
    occurring, begins, ends = set(step.objective.variables), set[int](), set[int]()

    def in_t(polynomial: Polynomial) -> Polynomial:
        own = polynomial.variables
        occurring.update(own)
        return substituted(polynomial, {v: affine(step.centre[v], step.scale[v], v) for v in own}, work)

    def factor(kind: str, number: int) -> Polynomial:
        if kind not in ("equality", "inequality"):
            return _end(kind, number)
        if (kind, number) not in known:
            known[kind, number] = in_t(context.stated.row(kind, number, context.where))
        return known[kind, number]

    # r = objective - sum_k p_k h_k - sum_j w_j sigma_j g_j, in t.
    residual = in_t(step.objective).plus(Polynomial())
    for number, terms in step.equalities:
        multiplier = Polynomial(terms)
        occurring.update(multiplier.variables)
        residual.add(factor("equality", number).times(multiplier, work), -ONE)
    for place, product in enumerate(step.products):
        context.require(product.weight >= 0, f"product {place}: weight >= 0 fails: {shown(product.weight)}")
        total = sum_of_squares(product.basis, product.factor, work)
        occurring.update(total.variables)
        for kind, number in product.of:
            own = factor(kind, number)
            begins |= {number} if kind in ("above", "inside") else set()
            ends |= {number} if kind in ("below", "inside") else set()
            total = own.times(total, work)
        residual.add(total, -product.weight)

    # Where -1 <= t or t <= 1 was used, the box begins at centre - scale, or ends at centre + scale.
    left = residual.variables
    for k in sorted(occurring | begins | ends):
        centre, scale, name = step.centre[k], step.scale[k], context.name(k)
        context.require(scale >= 0, f"scale >= 0 fails for {name}: {shown(scale)}")
        whole = not scale or k in left
        if whole or k in begins:
            at_most(context, centre - scale, context.end(k, 0), "centre - scale <= lower", name)
        if whole or k in ends:
            at_most(context, context.end(k, 1), centre + scale, "upper <= centre + scale", name)
    return [reached(context, step.objective, step.bound, residual)]


def affine(centre: Fraction, scale: Fraction, variable: int) -> Polynomial:
    """Return ``centre + scale t`` for the t of a variable."""
    return Polynomial({m: value for m, value in (((), centre), ((variable,), scale)) if value})


def reached(context: Context, objective: Polynomial, claimed: Fraction, residual: Polynomial) -> Theorem:
    """Return the theorem that follows from a polynomial in t below the objective, with every monomial in [-1, 1]."""
    least = residual.mid.get((), ZERO) - residual.rad.get((), ZERO)
    for m in residual.monomials - {()}:
        least -= abs(residual.mid.get(m, ZERO)) + residual.rad.get(m, ZERO)
    context.require(claimed <= least, f"bound <= r_0 - sum |r_i| fails: {shown(claimed)} > {shown(least)}")
    return Theorem(context.where, objective, claimed)


def at_most(context: Context, left: Fraction, right: Fraction, inequality: str, name: str) -> None:
    """Refuse the file unless ``left <= right``."""
    context.require(left <= right, f"{inequality} fails for {name}: {shown(left)} > {shown(right)}")


def _end(kind: str, variable: int) -> Polynomial:
    """Return ``1 + t``, ``1 - t`` or ``1 - t^2``."""
    if kind == "inside":
        return constant(1).plus(Polynomial({(variable, variable): -ONE}))
    return constant(1).plus(Polynomial({(variable,): ONE if kind == "above" else -ONE}))
