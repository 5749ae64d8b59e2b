"""Expressions as text and back, exactly and without executing the text."""

from __future__ import annotations

import ast
import itertools
import operator
import re
from collections.abc import Callable
from keyword import iskeyword
from typing import Any, TypeVar

import sympy
from sympy.printing.str import StrPrinter

from smid.models.errors import ModelError
from smid.models.symbols import canonical, number, rewritten, signal, unevaluated

__all__ = ["Refusal", "TextError", "constraints_from_text", "decimals", "from_text", "shown", "to_text"]

Names = Callable[[ast.expr], ast.expr]
"""What the names in a text stand for: the parsed text with other names; Refusal for a name that stands for nothing."""


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


class TextError(ModelError):
    """A text that is no expression; knows the text, and the column (from 1) of what is wrong.

    Examples
    --------
    >>> from_text("a + w.real")
    Traceback (most recent call last):
        ...
    smid.models.expressions.TextError: column 5 of 'a + w.real': 'w.real' is not understood: use + - * / **, ...
    """

    def __init__(self, text: str, column: int, why: str) -> None:
        super().__init__(f"column {column} of {text!r}: {why}")
        self.text, self.column, self.why = text, column, why

    def __reduce__(self) -> tuple[type[TextError], tuple[str, int, str]]:
        return TextError, (self.text, self.column, self.why)


def _as_written(node: ast.expr) -> ast.expr:
    return node


def from_text(text: str, names: Names = _as_written) -> sympy.Expr:
    """Read an expression such as ``-alpha*w[t - 1] + Max(0, u[t])``.

    The text is parsed, never executed: only arithmetic, signals and the functions of `FUNCTIONS` are understood.

    Examples
    --------
    >>> from_text("2*w[t - 1] + Max(0, a)")
    2*w[t - 1] + Max(0, a)
    >>> from_text("Piecewise((u[t], u[t] > a), (0, True))")
    Piecewise((u[t], a < u[t]), (0, True))
    """
    return _parsed(text, lambda node: canonical(_read(names(node))), "write an expression such as -a*w[t - 1] + b*u[t]")


def constraints_from_text(text: str, names: Names = _as_written) -> tuple[sympy.Expr, ...]:
    """Read inequalities such as ``0 <= a1 + a2 <= 1`` as expressions that are at least zero.

    Examples
    --------
    >>> constraints_from_text("a1 + a2 <= 1")
    (-a1 - a2 + 1,)
    """
    return _parsed(text, lambda node: _read_inequalities(names(node)), "write an inequality such as a1 + a2 <= 1")


Parsed = TypeVar("Parsed")


def _parsed(text: str, read: Callable[[ast.expr], Parsed], cure: str) -> Parsed:
    flat = re.sub(r"[\s\0]", " ", text)  # several lines are one expression
    # Python reads a name with a bold letter as the plain name, but never as one of its own words: lambda, in.
    flat = re.sub(r"\b[a-z]+\b", lambda word: _bold(word[0]) if iskeyword(word[0]) else word[0], flat)
    margin = len(flat) - len(flat.lstrip())
    try:
        return read(ast.parse(flat.strip(), mode="eval").body)
    except SyntaxError as error:
        column, why = error.offset or 1, f"the text cannot be read from here; {cure}"
    except Refusal as refusal:
        # The parser counts bytes.
        column, why = len(flat.strip().encode()[: refusal.node.col_offset].decode()) + 1, str(refusal)
    except (RecursionError, MemoryError):
        column, why = 1, "too many brackets inside each other; split it into several equations"
    raise TextError(text, margin + column, why)


def _bold(word: str) -> str:
    return chr(ord(word[0]) - ord("a") + ord("\N{MATHEMATICAL BOLD SMALL A}")) + word[1:]


class Refusal(Exception):
    """A part of an expression that is not understood."""

    def __init__(self, node: ast.expr, why: str) -> None:
        super().__init__(why)
        self.node = node


def _read(node: ast.expr) -> Any:
    try:
        value = _read_node(node)
        if value in (sympy.zoo, sympy.nan):
            raise ModelError(f"'{ast.unparse(node)}' divides by zero")
        return canonical(value) if isinstance(node, ast.Subscript) else value
    except ModelError as error:
        raise Refusal(node, str(error)) from None
    except TypeError:
        raise Refusal(node, f"'{ast.unparse(node)}' has a wrong number of arguments") from None


def _read_node(node: ast.expr) -> Any:
    match node:
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            return number(value)
        case ast.Name(id=name):
            # The name t is time, and is valid inside an index only.
            return sympy.Symbol("t", integer=True) if name == "t" else sympy.Symbol(_plain(name), real=True)
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return -_read(operand)
        case ast.BinOp(left=left, op=kind, right=right) if type(kind) in _BINARY:
            first, second = _read(left), _read(right)
            if isinstance(kind, ast.Div) and second == 0:
                raise ModelError(f"'{ast.unparse(node)}' divides by zero")
            if (
                isinstance(kind, ast.Pow)
                and first.is_Rational
                and second.is_Rational
                and _digits(first, second) > _MOST
            ):
                raise ModelError(f"'{ast.unparse(node)}' has more than {_MOST} digits: write a number")
            return _BINARY[type(kind)](first, second)
        case ast.Subscript(value=ast.Name(id=name), slice=index):
            return signal(_plain(name))[_read(index)]
        case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]) if name in FUNCTIONS:
            return FUNCTIONS[name](*map(_read, arguments))
        case ast.Call(func=ast.Name(id="Piecewise"), args=branches, keywords=[]):
            return sympy.Piecewise(*map(_read_branch, branches))
    raise ModelError(
        f"'{ast.unparse(node)}' is not understood: use + - * / **, signals as w[t - 1], Piecewise, and "
        f"{', '.join(FUNCTIONS)}"
    )


def _plain(name: str) -> str:
    if "__" in name:
        raise ModelError(f"the name {name!r} holds '__': take another one")
    return name


def _digits(base: sympy.Expr, exponent: sympy.Expr) -> float:
    """Return about how many digits a power of two numbers has; 0 where one is no number."""
    if not (base.is_Rational and exponent.is_Rational):
        return 0.0
    return len(str(max(abs(base.p), base.q))) * float(abs(exponent))


def _read_inequalities(node: ast.expr) -> tuple[sympy.Expr, ...]:
    if not isinstance(node, ast.Compare) or not all(isinstance(kind, ast.LtE | ast.GtE) for kind in node.ops):
        raise Refusal(node, f"'{ast.unparse(node)}' is no inequality: compare parameters by <= or >=")
    sides = [canonical(_read(side)) for side in (node.left, *node.comparators)]
    pairs = itertools.pairwise(sides)
    ordered = [pair if isinstance(kind, ast.GtE) else pair[::-1] for pair, kind in zip(pairs, node.ops, strict=True)]
    # Nothing is subtracted where the smaller side is zero, so that an expression comes back as it was written.
    return tuple(large if small == 0 else large - small for large, small in ordered)


def _read_branch(node: ast.expr) -> tuple[Any, Any]:
    match node:
        case ast.Tuple(elts=[value, condition]):
            return _read(value), _read_condition(condition)
    raise Refusal(node, f"'{ast.unparse(node)}' is no branch of a Piecewise: write (value, condition)")


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
    raise Refusal(node, f"'{ast.unparse(node)}' is no condition: compare by < <= > >= Eq Ne, and join by & |")
