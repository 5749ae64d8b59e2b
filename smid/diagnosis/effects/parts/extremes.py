"""The larger and the smaller of expressions, as they are written.

Sympy's own first tries to tell which argument is the larger one. Of the lines of a plant it never can, and its attempts
take up to a sixth of the time of a diagnosis.
"""

from __future__ import annotations

import sympy

from smid.models.symbols import unevaluated

__all__ = ["larger", "smaller"]


def larger(first: sympy.Expr | float, second: sympy.Expr | float) -> sympy.Expr:
    """Return the larger of two expressions.

    Examples
    --------
    >>> a = sympy.Symbol("a")
    >>> larger(0, a - 1) == sympy.Max(0, a - 1)
    True
    """
    return unevaluated(sympy.Max, [sympy.sympify(first), sympy.sympify(second)])


def smaller(first: sympy.Expr | float, second: sympy.Expr | float) -> sympy.Expr:
    """Return the smaller of two expressions.

    Examples
    --------
    >>> a = sympy.Symbol("a")
    >>> smaller(0, a - 1) == sympy.Min(0, a - 1)
    True
    """
    return unevaluated(sympy.Min, [sympy.sympify(first), sympy.sympify(second)])
