"""Products of parameters as parameters of their own.

A box is derived from equations that are affine in all parameters without one. Two things stand against that: products
of such parameters, as beta gamma of a Hammerstein model with zeros, and factors that can vanish, as in
``(1 + alpha) gamma`` at alpha = -1. So let the signals of an equation have the coefficients c_j(p), polynomials in the
parameters. They are sums of a few polynomials D_i(p), the reduced echelon form of the c_j over their monomials. With
``delta_i = D_i(p)`` as parameters the equations are affine in delta, and every feasible p gives a feasible delta.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import sympy

from smid.feasible.piecewise_functions import Kind, unfold
from smid.feasible.template import flat_lines
from smid.models import Line, Model, Parameter
from smid.models.hidden_states import first_instants
from smid.models.symbols import references, signal, t

__all__ = ["in_products", "products_needed"]

_Coefficients = dict[sympy.Expr, sympy.Poly]  # by the signals that they multiply


def products_needed(model: Model, names: Sequence[str]) -> dict[str, sympy.Expr]:
    """Return the polynomials that are to be parameters, so that those named can get a box; none where all can already.

    Examples
    --------
    >>> from smid.models import Hammerstein
    >>> products_needed(Hammerstein(powers=(3,), stable=True), ("gamma1",))
    {'product1': alpha*gamma1 + gamma1}
    """
    if first_instants(model):  # lines without hidden states hold from some later sample, which a new line would not say
        return {}
    symbols = [p.symbol for p in model.parameters]
    loose = {p.symbol for p in model.parameters if p.name in names}
    coefficients = [_coefficients(line, symbols) for line in flat_lines(model)]
    if any(own is None for own in coefficients):
        return {}
    # Take all coefficients that share a monomial with one that is curved in parameters without a box.
    left = [c for own in coefficients if own for c in own.values()]
    chosen, shared = list[sympy.Poly](), set[tuple[int, ...]]()
    grown = True
    while grown:
        taken = [c for c in left if shared & {*c.monoms()} or (c.total_degree() > 1 and c.free_symbols & loose)]
        left, grown = [c for c in left if c not in taken], bool(taken)
        chosen += taken
        shared |= {m for c in taken for m in c.monoms()}
    rows = _echelon(chosen)
    # A polynomial that is one parameter leaves it as it is.
    alone = {row.free_symbols.pop() for row in rows if row.total_degree() == 1 and len(row.terms()) == 1}
    own = {s: k for k, s in enumerate(symbols)}
    needed = any(
        row.free_symbols & (loose - alone) or any(sum(m[own[s]] for s in loose) > 1 for m in row.monoms())
        for row in rows
        if row.total_degree() > 1
    )
    if not needed:
        return {}
    taken_names = {p.name for p in model.parameters}
    free = (name for k in range(1, 2 * len(rows) + len(symbols) + 2) if (name := f"product{k}") not in taken_names)
    return {next(free): row.as_expr() for row in rows if len(row.terms()) > 1 or row.total_degree() > 1}


def in_products(model: Model, products: dict[str, sympy.Expr]) -> Model:
    """Return the model with the products as parameters; priors on what they replace are left out."""
    symbols = [p.symbol for p in model.parameters]
    rows = {sympy.Symbol(name, real=True): sympy.Poly(own, *symbols) for name, own in products.items()}
    lines = []
    for line in flat_lines(model):
        (target,) = {s for s in line.atoms(sympy.Indexed) if s in {known.target for known in unfold(model).lines}}
        total = sympy.S.Zero
        for signals, coefficient in (_coefficients(line, symbols) or {}).items():
            left = coefficient
            for delta, row in rows.items():
                share = left.coeff_monomial(row.monoms()[0]) / row.LC()
                left -= share * row
                total += share * delta * signals
            total += left.as_expr() * signals
        lines.append(Line(target, _folded(model, sympy.expand(target - total))))
    occurring = {s for line in lines for s in line.expression.free_symbols}
    gone = {s for own in products.values() for s in own.free_symbols} - occurring
    return replace(
        model,
        parameters=(*(p for p in model.parameters if p.symbol not in gone), *map(Parameter, products)),
        lines=tuple(lines),
        constraints=tuple(c for c in model.constraints if not c.free_symbols & gone),
        values={},
    )


def _coefficients(line: sympy.Expr, symbols: Sequence[sympy.Symbol]) -> _Coefficients | None:
    """Return the coefficient of each product of signals in a line; None where one is not a polynomial."""
    found: dict[sympy.Expr, sympy.Expr] = {}
    for term in sympy.Add.make_args(sympy.expand(line)):
        signals, parameters = term.as_independent(*symbols, as_Add=False)
        number, signals = signals.as_coeff_Mul()
        found[signals] = found.get(signals, sympy.S.Zero) + number * parameters
    if not all(c.is_polynomial(*symbols) for c in found.values()):
        return None
    return {signals: sympy.Poly(c, *symbols) for signals, c in found.items()}


def _echelon(polynomials: Sequence[sympy.Poly]) -> list[sympy.Poly]:
    """Return the reduced echelon form over the monomials, those of high degree first."""
    if not polynomials:
        return []
    symbols = polynomials[0].gens
    monomials = sorted({m for p in polynomials for m in p.monoms()}, key=lambda m: (sum(m), m), reverse=True)
    matrix = sympy.Matrix([[p.coeff_monomial(m) for m in monomials] for p in polynomials])
    reduced, pivots = matrix.rref()
    return [
        sympy.Poly.from_dict({m: reduced[k, j] for j, m in enumerate(monomials) if reduced[k, j]}, *symbols)
        for k in range(len(pivots))
    ]


def _folded(model: Model, expression: sympy.Expr) -> sympy.Expr:
    """Put Max and sign back in the place of the names of kinks."""
    for kink in reversed(unfold(model).kinks):
        own = sympy.Max(0, kink.argument) if kink.kind is Kind.POSITIVE_PART else sympy.sign(kink.argument)
        if kink.constant:
            expression = expression.xreplace({sympy.Symbol(kink.name, real=True): own})
        else:
            lags = [lag for name, lag in references(expression) if name == kink.name]
            expression = expression.xreplace({signal(kink.name)[t - lag]: own.xreplace({t: t - lag}) for lag in lags})
    return expression
