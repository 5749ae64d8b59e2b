"""Expressions as text and back, exactly and without executing the text."""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable
from typing import Any

import sympy
from sympy.printing.str import StrPrinter

from smid.models.errors import ModelError
from smid.models.symbols import canonical, signal

__all__ = ["from_text", "to_text"]

FUNCTIONS: dict[str, Any] = {
    name: getattr(sympy, name)
    for name in (
        *("Max", "Min", "Abs", "sign", "sqrt", "exp", "log"),
        *("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh"),
    )
}
_BINARY: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}


class _Printer(StrPrinter):  # type: ignore[misc]
    """Sympy's own text form, but with every digit a float needs to come back unchanged."""

    def _print_Float(self, expr: sympy.Float) -> str:
        return repr(float(expr))


def to_text(expression: sympy.Expr) -> str:
    """Write an expression so that `from_text` gives it back.

    Parameters
    ----------
    expression : sympy.Expr
        Expression in parameters and signals.

    Returns
    -------
    str
        Python-like text.

    Examples
    --------
    >>> to_text(0.1 * sympy.Symbol("a") ** 2)
    '0.1*a**2'
    """
    return str(_Printer().doprint(expression))


def from_text(text: str) -> sympy.Expr:
    """Read an expression such as ``-alpha*w[t - 1] + Max(0, u[t])``.

    Parameters
    ----------
    text : str
        Arithmetic, signals indexed by ``t``, and the functions of `FUNCTIONS`.

    Returns
    -------
    sympy.Expr
        The expression.

    Raises
    ------
    ModelError
        If the text holds anything else.

    Examples
    --------
    >>> from_text("2*w[t - 1] + Max(0, a)")
    2*w[t - 1] + Max(0, a)
    """
    try:
        return canonical(_read(ast.parse(text, mode="eval").body))
    except SyntaxError:
        raise ModelError(f"the expression {text!r} cannot be read: write it as in '-a*w[t - 1] + b*u[t]'") from None


def _read(node: ast.expr) -> Any:
    match node:
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            return sympy.sympify(value)
        case ast.Name(id=name):
            # The name t is time inside an index, where alone it may stand.
            return sympy.Symbol("t", integer=True) if name == "t" else sympy.Symbol(name, real=True)
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return -_read(operand)
        case ast.BinOp(left=left, op=kind, right=right) if type(kind) in _BINARY:
            return _BINARY[type(kind)](_read(left), _read(right))
        case ast.Subscript(value=ast.Name(id=name), slice=index):
            return signal(name)[_read(index)]
        case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]) if name in FUNCTIONS:
            return FUNCTIONS[name](*map(_read, arguments))
    raise ModelError(
        f"'{ast.unparse(node)}' is not understood: use + - * / **, signals as w[t - 1], and {', '.join(FUNCTIONS)}"
    )
