"""Read the text of an expression: a parser of its own, which executes nothing.

The text is as Python reads it: ``+ - * /``, ``**`` (which binds tighter than a minus before it), calls, signals as
``w[t - 1]``, and ``Piecewise((value, condition), ..., (value, True))``. A decimal is the nearest float of 64 bits.

An expression is returned as nested tuples: ``("number", value)``, ``("name", name)``, ``("signal", name, lag)``,
``("+", ...)``, ``("*", ...)``, ``("**", base, exponent)``, ``("call", name, ...)``, and ``("choose", above, strict,
value, other)``, which is the value where above is positive (or zero, unless strict), and the other elsewhere.
"""

from __future__ import annotations

import re
from fractions import Fraction
from math import isfinite
from typing import Any

from relaxations.check.arithmetic import Unreadable
from relaxations.check.forms import excerpt

Node = tuple[Any, ...]

DEEPEST = 60  # brackets within each other
LONGEST_NUMBER = 400  # characters

_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)|(?P<name>[^\W\d]\w*)"
    r"|(?P<sign>\*\*|<=|>=|[-+*/()\[\],<>]))"
)


class _Tokens:
    """The tokens of a text, one after the other."""

    def __init__(self, text: str) -> None:
        self.text, self.depth, self.place = text, 0, 0
        self.tokens: list[tuple[str, str]] = []
        at, length = 0, len(text.rstrip())
        while at < length:
            found = _TOKEN.match(text, at)
            if found is None:
                raise self.wrong(text[at:])
            self.tokens.append((str(found.lastgroup), found[str(found.lastgroup)]))
            at = found.end()
        self.tokens.append(("end", ""))

    def wrong(self, what: str) -> Unreadable:
        return Unreadable(f"the expression {excerpt(self.text)} cannot be read at {excerpt(what)}")

    @property
    def next(self) -> str:
        return self.tokens[self.place][1]

    def take(self) -> tuple[str, str]:
        token = self.tokens[self.place]
        self.place = min(self.place + 1, len(self.tokens) - 1)
        return token

    def given(self, sign: str) -> bool:
        """Skip a sign, and return whether it came next."""
        found = self.tokens[self.place] == ("sign", sign)
        self.place += found
        return found

    def need(self, sign: str) -> None:
        if not self.given(sign):
            raise self.wrong(self.next)


def parsed(text: str) -> Node:
    """Return an expression as nested tuples.

    >>> parsed("-a*w[t - 1]**2")
    ('*', ('number', Fraction(-1, 1)), ('name', 'a'), ('**', ('signal', 'w', 1), ('number', Fraction(2, 1))))
    """
    tokens = _Tokens(text)
    node = _sum(tokens)
    if tokens.take()[0] != "end":
        raise tokens.wrong(tokens.tokens[tokens.place - 1][1])
    return node


def _number(value: int) -> Node:
    return ("number", Fraction(value))


def _sum(tokens: _Tokens) -> Node:
    tokens.depth += 1
    if tokens.depth > DEEPEST:
        raise Unreadable(f"the expression {excerpt(tokens.text)} has more than {DEEPEST} brackets within each other")
    parts = [_product(tokens)]
    while tokens.next in ("+", "-"):
        factor = 1 if tokens.take()[1] == "+" else -1
        part = _product(tokens)
        parts.append(part if factor > 0 else _times(_number(-1), part))
    tokens.depth -= 1
    return parts[0] if len(parts) == 1 else ("+", *parts)


def _product(tokens: _Tokens) -> Node:
    factors = [_signed(tokens)]
    while tokens.next in ("*", "/"):
        divides = tokens.take()[1] == "/"
        factor = _signed(tokens)
        factors.append(("**", factor, _number(-1)) if divides else factor)
    return _times(*factors)


def _times(*factors: Node) -> Node:
    flat = [own for factor in factors for own in (factor[1:] if factor[0] == "*" else [factor])]
    return flat[0] if len(flat) == 1 else ("*", *flat)


def _signed(tokens: _Tokens) -> Node:
    signs = 0
    while tokens.next in ("-", "+"):
        signs += tokens.take()[1] == "-"
    power = _power(tokens)
    return _times(_number(-1), power) if signs % 2 else power


def _power(tokens: _Tokens) -> Node:
    base = _atom(tokens)
    if not tokens.given("**"):
        return base
    tokens.depth += 1
    exponent = _signed(tokens) if tokens.depth <= DEEPEST else _sum(tokens)
    tokens.depth -= 1
    return ("**", base, exponent)


def _atom(tokens: _Tokens) -> Node:
    kind, word = tokens.take()
    if kind == "number" and len(word) <= LONGEST_NUMBER:
        if word.isdigit():
            return ("number", Fraction(int(word)))
        value = float(word)
        if isfinite(value):
            return ("number", Fraction(value))
    elif kind == "name":
        if tokens.given("["):
            return _read(tokens, word)
        if tokens.given("("):
            return _piecewise(tokens) if word == "Piecewise" else ("call", word, *_arguments(tokens))
        return ("name", word)
    elif (kind, word) == ("sign", "("):
        node = _sum(tokens)
        tokens.need(")")
        return node
    raise tokens.wrong(word)


def _read(tokens: _Tokens, name: str) -> Node:
    """Return a signal at ``t``, or ``t`` less a whole number."""
    if tokens.take() != ("name", "t"):
        raise tokens.wrong(name)
    lag = 0
    if tokens.given("-"):
        kind, word = tokens.take()
        if kind != "number" or not word.isdigit() or len(word) > 9:
            raise tokens.wrong(word)
        lag = int(word)
    tokens.need("]")
    return ("signal", name, lag)


def _arguments(tokens: _Tokens) -> list[Node]:
    found = [_sum(tokens)]
    while tokens.given(","):
        found.append(_sum(tokens))
    tokens.need(")")
    return found


def _piecewise(tokens: _Tokens) -> Node:
    branches: list[tuple[Node, Node, bool]] = []
    while True:
        tokens.need("(")
        value = _sum(tokens)
        tokens.need(",")
        if tokens.tokens[tokens.place] == ("name", "True"):
            break
        left, sign, right = _sum(tokens), tokens.take()[1], _sum(tokens)
        if sign not in ("<", "<=", ">", ">="):
            raise tokens.wrong(sign)
        more, less = (left, right) if sign[0] == ">" else (right, left)
        branches.append((value, ("+", more, _times(_number(-1), less)), sign in "<>"))
        tokens.need(")")
        tokens.need(",")
    tokens.take()
    tokens.need(")")
    tokens.need(")")
    for own, over, strict in reversed(branches):
        value = ("choose", over, strict, own, value)
    return value
