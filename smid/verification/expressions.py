"""Evaluate the text of a model's expressions with exact polynomials.

A value is a fraction of two polynomials in the variables of a certificate. The caller evaluates piecewise functions, as
``max(a, b) = b + p(a - b)``, ``min(a, b) = -max(-a, -b)`` and ``|a| = 2 p(a) - a``, with p the positive part.
"""

from __future__ import annotations

import ast
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache, reduce
from itertools import permutations
from typing import Any

from relaxations.check.arithmetic import Monomial, Terms, Work, product

UNITY: Terms = {(): Fraction(1)}
_WORK = Work(1 << 62)  # no limit: the user's own model


class NotPolynomialError(ValueError):
    """An expression is not a polynomial in parameters, noises and samples."""


class OutsideError(Exception):
    """An equation reads a sample, a noise or a kink that the proof does not have; the proof need not state it."""


@dataclass(frozen=True)
class Value:
    """A fraction of polynomials, and the latest time of the signals that it reads."""

    above: Terms
    below: Terms
    newest: int = -1

    def __add__(self, other: Value) -> Value:
        newest = max(self.newest, other.newest)
        if self.below == other.below:
            return Value(_sum(self.above, other.above), self.below, newest)
        left, right = product(self.above, other.below, _WORK), product(other.above, self.below, _WORK)
        return Value(_sum(left, right), product(self.below, other.below, _WORK), newest)

    def __neg__(self) -> Value:
        return Value({m: -c for m, c in self.above.items()}, self.below, self.newest)

    def __sub__(self, other: Value) -> Value:
        return self + -other

    def __mul__(self, other: Value) -> Value:
        below = other.below if self.below == UNITY else product(self.below, other.below, _WORK)
        return Value(product(self.above, other.above, _WORK), below, max(self.newest, other.newest))

    def __truediv__(self, other: Value) -> Value:
        return self * Value(other.below, other.above, other.newest)

    def polynomial(self) -> Terms:
        """Return the fraction as a polynomial."""
        quotient = divided(self.above, self.below)
        if quotient is None:
            raise NotPolynomialError("a quotient in the model is not a polynomial")
        return quotient


def number(value: Fraction | int | float) -> Value:
    """Return the value of a number."""
    exact = Fraction(value)
    return Value({(): exact} if exact else {}, UNITY)


def variable(index: int, time: int = -1) -> Value:
    """Return the value that is a variable."""
    return Value({(index,): Fraction(1)}, UNITY, time)


def _sum(left: Terms, right: Terms) -> Terms:
    total = dict(left)
    for m, value in right.items():
        total[m] = total.get(m, Fraction(0)) + value
    return {m: value for m, value in total.items() if value}


def divided(above: Terms, below: Terms) -> Terms | None:
    """Return the exact quotient of two polynomials; None if there is none."""
    above, below = ({m: c for m, c in part.items() if c} for part in (above, below))
    if not below:
        return None
    if below.keys() == {()}:
        return {m: c / below[()] for m, c in above.items()}
    lead = _leading(below)
    quotient: Terms = {}
    while above:
        own = _leading(above)
        rest = list(own)
        for v in lead:
            if v not in rest:
                return None
            rest.remove(v)
        factor, m = above[own] / below[lead], tuple(rest)
        quotient[m] = factor
        above = _sum(above, {k: -c for k, c in product({m: factor}, below, _WORK).items()})
    return quotient


def _leading(terms: Terms) -> Monomial:
    highest = max(map(len, terms))
    return min(m for m in terms if len(m) == highest)


Signals = Callable[[str, int], Value]
Kinks = Callable[[str, Value], Value]


@lru_cache(maxsize=4096)
def parsed(text: str) -> ast.expr:
    """Return the syntax tree of an expression."""
    try:
        return ast.parse(text, mode="eval").body
    except (SyntaxError, RecursionError, ValueError):
        raise NotPolynomialError(f"the expression {text!r} cannot be read") from None


def evaluated(text: str, time: int, names: Callable[[str], Value], signals: Signals, kinks: Kinks) -> Value:
    """Return the value of an expression at a time.

    ``names`` returns parameters and the argument of a sensor curve; ``kinks`` the ``"positive part"`` or ``"sign"`` of
    a value.
    """

    def value(node: Any) -> Value:
        match node:
            case ast.Constant(value=int() | float() as given) if not isinstance(given, bool):
                return number(given)
            case ast.Name(id=name):
                return names(name)
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return -value(operand)
            case ast.BinOp(left=left, op=ast.Pow(), right=right):
                return _power(value(left), value(right))
            case ast.BinOp(left=left, op=ast.Add(), right=right):
                return value(left) + value(right)
            case ast.BinOp(left=left, op=ast.Sub(), right=right):
                return value(left) - value(right)
            case ast.BinOp(left=left, op=ast.Mult(), right=right):
                return value(left) * value(right)
            case ast.BinOp(left=left, op=ast.Div(), right=right):
                return value(left) / value(right)
            case ast.Subscript(value=ast.Name(id=name), slice=index):
                return signals(name, _read_time(index, time))
            case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]):
                return _function(name, [value(argument) for argument in arguments], kinks)
        raise NotPolynomialError(f"'{ast.unparse(node)}' is not part of a polynomial")

    return value(parsed(text))


def _read_time(index: Any, time: int) -> int:
    """Return the time that a subscript reads: ``t``, or ``t`` minus an integer."""
    match index:
        case ast.Name(id="t"):
            return time
        case ast.BinOp(left=ast.Name(id="t"), op=ast.Sub(), right=ast.Constant(value=int() as lag)):
            return time - lag
    raise NotPolynomialError(f"'{ast.unparse(index)}' is not t, or t minus an integer")


def _function(name: str, arguments: list[Value], kinks: Kinks) -> Value:
    if name == "Max":
        return _largest(arguments, kinks)
    if name == "Min":
        return -_largest([-a for a in arguments], kinks)
    if name == "Abs" and len(arguments) == 1:
        return number(2) * kinks("positive part", arguments[0]) - arguments[0]
    if name == "sign" and len(arguments) == 1:
        return kinks("sign", arguments[0])
    raise NotPolynomialError(f"the function {name!r} is not part of a polynomial")


def _largest(arguments: list[Value], kinks: Kinks) -> Value:
    # The order of three or more arguments decides which kinks occur; the proof has one of these orders.
    for order in permutations(arguments):
        with suppress(OutsideError):
            return reduce(lambda a, b: a + kinks("positive part", b - a), order)
    raise OutsideError


def _power(base: Value, exponent: Value) -> Value:
    whole = exponent.polynomial()
    size = whole.get((), Fraction(0))
    if whole.keys() > {()} or size.denominator != 1 or abs(size) > 64:
        raise NotPolynomialError("an exponent is not an integer of at most 64")
    result = number(1)
    for _ in range(abs(size.numerator)):
        result = result * base
    return result if size >= 0 else number(1) / result
