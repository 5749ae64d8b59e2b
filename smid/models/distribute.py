"""A model as inversion reads it: products of parameters are out of brackets, and what a sign multiplies is in one.

The line ``x = J (c u - w v)`` of signals u and v is linear in the products ``J c`` and ``J w``, each of which is one
number at all samples, however much J, c and w themselves are in doubt. So brackets of signals are written out whose
terms have factors of parameters alone; others stay, as what occurs once is enclosed best. All that multiplies the same
signals is one coefficient: what is unknown of x becomes less by ``(1 - a) x``, and more by ``x - a x``.

A sign is put together for the same reason. The memory of a hysteresis is ``z = s + (z - s) exp(-r |d|)`` with
s = sign(d), which is not known where d is small; but ``s (1 - exp(-r |d|))`` is small there.
"""

from __future__ import annotations

from dataclasses import replace

import sympy

from smid.models.model import Model
from smid.models.symbols import number, plain_symbols, references, swapped


def as_inverted(model: Model) -> Model:
    """Return a model with a sampling time as inversion reads it.

    Unless the intervals are those of the differential equation, it is discretised. Parameters that are known are
    numbers, so that derivatives become simpler.

    Examples
    --------
    >>> from smid.models import OwnModel
    >>> how, boxes = {"scheme": "enclosed", "sampling_time": 1.0}, {"k": (0, 1), "c": (2, 2)}
    >>> print(as_inverted(OwnModel(["d/dt x = k*u - c*x"], {"y": "x"}, ["u"], boxes, **how)).lines[0])
    d/dt x[t] = k*u[t] - 2*x[t]
    """
    if not model.enclosed:
        return distributed(model.discretised())
    known = {p.symbol: number(p.lower) for p in model.parameters if p.lower == p.upper}
    return distributed(
        replace(model, lines=tuple(replace(e, expression=swapped(e.expression, known)) for e in model.lines))
    )


def distributed(model: Model) -> Model:
    """Return a model whose products of parameters are written out, and whose signs are put together.

    Examples
    --------
    >>> from smid.models import OwnModel
    >>> model = OwnModel(["x[t] = x[t-1] + k*(u[t-1] - c*x[t-1])"], {"y": "x"}, ["u"], {k: (0, 1) for k in "kc"})
    >>> print(distributed(model).lines[0])
    x[t] = k*u[t - 1] + (-c*k + 1)*x[t - 1]
    """
    lines = tuple(
        replace(line, expression=_gathered(_collected(line.expression.replace(lambda node: node.is_Mul, _distributed))))
        for line in model.lines
    )
    return replace(model, lines=lines)


def _collected(expression: sympy.Expr) -> sympy.Expr:
    """Return a sum of different signals or functions of them, each with one coefficient."""
    return sympy.Add(*(sympy.factor_terms(own) * rest for rest, own in coefficients(expression).items()))


def coefficients(expression: sympy.Expr) -> dict[sympy.Expr, sympy.Expr]:
    """Return what parameters and numbers multiply, signals or functions of them, each with its coefficient.

    Examples
    --------
    >>> from smid.models import signal, t
    >>> a, x = sympy.Symbol("a"), signal("x")
    >>> coefficients(x[t] - a * x[t] + a)
    {1: a, x[t]: 1 - a}
    """
    found = dict[sympy.Expr, sympy.Expr]()
    for term in sympy.Add.make_args(expression):
        own, rest = term.as_independent(sympy.Indexed, as_Add=False)
        found[rest] = found.get(rest, sympy.S.Zero) + own
    return found


def _gathered(expression: sympy.Expr) -> sympy.Expr:
    """Return an expression in which each sign multiplies the sum of what it has as a factor.

    A bracket stays where a parameter multiplies the sign, too.
    """
    for sign in sorted(expression.atoms(sympy.sign), key=str):
        others, shares = list[sympy.Expr](), list[sympy.Expr]()
        for bracket in sympy.Add.make_args(expression):
            terms = sympy.Add.make_args(sympy.expand_mul(bracket, deep=False))
            signed = [term for term in terms if term.has(sign)]
            if any(map(_scaled, signed)):
                others.append(bracket)
            else:
                shares += [term / sign for term in signed]
                others += [term for term in terms if not term.has(sign)]
        if len(shares) > 1 and not any(share.has(sign) for share in shares):
            expression = sympy.Add(*others, sign * sympy.Add(*shares))
    return expression


def _distributed(product: sympy.Mul) -> sympy.Expr:
    sums = [own for own in product.args if own.is_Add and references(own) and any(map(_scaled, own.args))]
    if not (sums and _scaled(product)):
        return product
    others = sympy.Mul(*(own for own in product.args if own is not sums[0]))
    return sympy.Add(*(_distributed(others * term) for term in sums[0].args))


def _scaled(product: sympy.Expr) -> bool:
    """Return whether parameters alone are a factor of a product."""
    return any(plain_symbols(own) and not references(own) for own in sympy.Mul.make_args(product))
