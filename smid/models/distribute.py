"""Products of parameters, taken out of the brackets that hold them.

The line ``x = J (c u - w v)`` of signals u and v is linear in the products ``J c`` and ``J w``, each of which is one
number at all samples, however much J, c and w themselves are in doubt. So brackets are written out whose terms have
factors of parameters alone; others stay, as what occurs once is enclosed best.
"""

from __future__ import annotations

from dataclasses import replace

import sympy

from smid.models.model import Model
from smid.models.symbols import plain_symbols, references


def distributed(model: Model) -> Model:
    """Return a model whose products of parameters are written out.

    Examples
    --------
    >>> from smid.models import OwnModel
    >>> model = OwnModel(["x[t] = x[t-1] + k*(u[t-1] - c*x[t-1])"], {"y": "x"}, ["u"], {k: (0, 1) for k in "kc"})
    >>> print(distributed(model).lines[0])
    x[t] = -c*k*x[t - 1] + k*u[t - 1] + x[t - 1]
    """
    lines = tuple(
        replace(line, expression=line.expression.replace(lambda node: node.is_Mul, _distributed))
        for line in model.lines
    )
    return replace(model, lines=lines)


def _distributed(product: sympy.Mul) -> sympy.Expr:
    sums = [own for own in product.args if own.is_Add and any(map(_scaled, own.args))]
    if not (sums and _scaled(product)):
        return product
    others = sympy.Mul(*(own for own in product.args if own is not sums[0]))
    return sympy.Add(*(_distributed(others * term) for term in sums[0].args))


def _scaled(product: sympy.Expr) -> bool:
    """Return whether parameters alone are a factor of a product."""
    return any(plain_symbols(own) and not references(own) for own in sympy.Mul.make_args(product))
