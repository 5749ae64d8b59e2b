"""Expressions as text and back, exactly and without executing the text."""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable
from typing import Any

import sympy
from sympy.printing.str import StrPrinter

from smid.models.errors import ModelError
from smid.models.symbols import canonical, number, rewritten, signal, unevaluated

__all__ = ["decimals", "from_text", "shown", "to_text"]

FUNCTIONS: dict[str, Any] = {
    name: getattr(sympy, name)
    for name in (
        *("Max", "Min", "Abs", "sign", "sqrt", "exp", "log"),
        *("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh"),
    )
}
_RELATIONS = {ast.Lt: sympy.Lt, ast.LtE: sympy.Le, ast.Gt: sympy.Gt, ast.GtE: sympy.Ge}
_EQUALITIES = {"Eq": sympy.Eq, "Ne": sympy.Ne}
_JUNCTIONS = {ast.BitAnd: sympy.And, ast.BitOr: sympy.Or}
_BINARY: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}


_MOST, _LARGEST = 1000, 10**15  # a fraction of a larger denominator, or numerator, is written as a decimal


class _Printer(StrPrinter):  # type: ignore[misc]
    """Sympy's own text form, but with every digit a float needs to come back unchanged."""

    def _print_Float(self, expr: sympy.Float) -> str:
        return repr(float(expr))


def decimals(expression: sympy.Expr, exactly: bool = False) -> sympy.Expr:
    """Write long fractions as decimals, for display: 0.3 is shown as 0.3, and 5/2 as 2.5.

    Short fractions below one stay: 1/2 and 3/16.

    For printing only: the result is not evaluated.

    Examples
    --------
    >>> decimals(canonical(0.3 * sympy.Symbol("a")) / 7)
    0.0428571428571429*a
    """
    swap: dict[sympy.Expr, sympy.Expr] = {}
    for item in expression.atoms(sympy.Rational):
        nearest = _nearest(item)
        is_same = nearest is not None and sympy.Rational(nearest) == item
        is_long = item.q > _MOST or abs(item.p) > _LARGEST or (is_same and abs(item.p) > item.q > 1)
        if is_long and nearest is not None and (is_same or not exactly):
            swap[item] = sympy.Float(nearest if is_same else float(f"{nearest:.15g}"))
    if not swap:
        return expression
    return rewritten(expression, swap, lambda node, arguments: unevaluated(node.func, arguments))


def _nearest(item: sympy.Rational) -> float | None:
    try:
        return int(item.p) / int(item.q)
    except OverflowError:
        return None


def to_text(expression: sympy.Expr) -> str:
    """Return an expression as text that `from_text` reads back exactly.

    Examples
    --------
    >>> to_text(canonical(0.1 * sympy.Symbol("a") ** 2))
    '0.1*a**2'
    """
    return str(_Printer().doprint(decimals(expression, exactly=True)))


def shown(expression: sympy.Expr) -> str:
    """Return an expression as text for display: as `to_text`, with at most 15 digits.

    Examples
    --------
    >>> shown(canonical(0.1 * sympy.Symbol("a")) / 3)
    '0.0333333333333333*a'
    """
    return str(_Printer().doprint(decimals(expression)))


def from_text(text: str) -> sympy.Expr:
    """Read an expression such as ``-alpha*w[t - 1] + Max(0, u[t])``.

    Examples
    --------
    >>> from_text("2*w[t - 1] + Max(0, a)")
    2*w[t - 1] + Max(0, a)
    >>> from_text("Piecewise((u[t], u[t] > a), (0, True))")
    Piecewise((u[t], a < u[t]), (0, True))
    """
    try:
        return canonical(_read(ast.parse(text, mode="eval").body))
    except SyntaxError:
        raise ModelError(f"the expression {text!r} cannot be read: write it as in '-a*w[t - 1] + b*u[t]'") from None


def _read(node: ast.expr) -> Any:
    match node:
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            return number(value)
        case ast.Name(id=name):
            # The name t is time, and is valid inside an index only.
            return sympy.Symbol("t", integer=True) if name == "t" else sympy.Symbol(name, real=True)
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return -_read(operand)
        case ast.BinOp(left=left, op=kind, right=right) if type(kind) in _BINARY:
            return _BINARY[type(kind)](_read(left), _read(right))
        case ast.Subscript(value=ast.Name(id=name), slice=index):
            return signal(name)[_read(index)]
        case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]) if name in FUNCTIONS:
            return FUNCTIONS[name](*map(_read, arguments))
        case ast.Call(func=ast.Name(id="Piecewise"), args=branches, keywords=[]):
            return sympy.Piecewise(*map(_read_branch, branches))
    raise ModelError(
        f"'{ast.unparse(node)}' is not understood: use + - * / **, signals as w[t - 1], Piecewise, and "
        f"{', '.join(FUNCTIONS)}"
    )


def _read_branch(node: ast.expr) -> tuple[Any, Any]:
    match node:
        case ast.Tuple(elts=[value, condition]):
            return _read(value), _read_condition(condition)
    raise ModelError(f"'{ast.unparse(node)}' is no branch of a Piecewise: write (value, condition)")


def _read_condition(node: ast.expr) -> Any:
    match node:
        case ast.Constant(value=bool() as value):
            return sympy.true if value else sympy.false
        case ast.Compare(left=left, ops=[kind], comparators=[right]) if type(kind) in _RELATIONS:
            return _RELATIONS[type(kind)](_read(left), _read(right))
        case ast.Call(func=ast.Name(id=name), args=[left, right], keywords=[]) if name in _EQUALITIES:
            return _EQUALITIES[name](_read(left), _read(right))
        case ast.BinOp(left=left, op=kind, right=right) if type(kind) in _JUNCTIONS:
            return _JUNCTIONS[type(kind)](_read_condition(left), _read_condition(right))
    raise ModelError(f"'{ast.unparse(node)}' is no condition: compare by < <= > >= Eq Ne, and join by & |")
