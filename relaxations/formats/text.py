"""Polynomials as text: ``4*x1**2 - 2.1*sqr(x2) + power(x1, 3)/3``. Decimals are read as exact fractions.

The grammar is the common part of Python and GAMS:

    sum     = product {("+" | "-") product}
    product = signed {("*" | "/") signed}
    signed  = ("+" | "-") signed | atom [("**" | "^") signed]
    atom    = number | name | "(" sum ")" | "sqr" "(" sum ")" | "power" "(" sum "," sum ")"
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction

from relaxations.errors import ProblemError
from relaxations.formats.expressions import Expression, constant

TOKEN = re.compile(
    r"(?P<space>\s+)|(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d{1,4})?)|(?P<name>[A-Za-z_]\w*)"
    r"|(?P<relation>=[A-Za-z]=)|(?P<sign>\.\.|\*\*|[-+*/^(),=.])|(?P<other>.)"
)


@dataclass(frozen=True)
class Token:
    """A piece of text and its line; ``kind`` is "number", "name", "relation" or "sign"."""

    kind: str
    text: str
    line: int


def tokens(text: str, line: int = 1) -> list[Token]:
    """Return the numbers, names, relations and signs of a text; ProblemError for an unknown character."""
    found = []
    for match in TOKEN.finditer(text):
        kind = str(match.lastgroup)
        if kind == "other":
            raise ProblemError(f"line {line}: {match.group()!r} cannot be read")
        if kind != "space":
            found.append(Token(kind, match.group(), line))
        line += match.group().count("\n")
    return found


def parse(text: str, names: Mapping[str, Expression]) -> Expression:
    """Return the polynomial of a text; ``names`` gives the expression of each name.

    Raises
    ------
    ProblemError
        With the line and the cause.

    Examples
    --------
    >>> from relaxations.formats.expressions import variables
    >>> x, y = variables("x y")
    >>> parse("-x**2 + 0.1*sqr(x - y)", {"x": x, "y": y})
    -9/10*x**2 - 1/5*x*y + 1/10*y**2
    """
    return parse_tokens(tokens(text), names)


def parse_tokens(pieces: list[Token], names: Mapping[str, Expression]) -> Expression:
    """Return the polynomial of some tokens; see :func:`parse`."""
    if not pieces:
        raise ProblemError("an expression is missing: write a polynomial")
    reader = _Reader(pieces, names)
    result = reader.sum()
    if reader.place < len(pieces):
        left = pieces[reader.place]
        raise ProblemError(f"line {left.line}: {left.text!r} is not expected here")
    return result


class _Reader:
    """A recursive descent parser; ``place`` is the index of the next token."""

    def __init__(self, pieces: list[Token], names: Mapping[str, Expression]) -> None:
        self.pieces = pieces
        self.names = names
        self.place = 0

    def sum(self) -> Expression:
        total = self.product()
        while self._next() in ("+", "-"):
            sign = self._take()
            right = self.product()
            total = total + right if sign.text == "+" else total - right
        return total

    def product(self) -> Expression:
        total = self.signed()
        while self._next() in ("*", "/"):
            sign = self._take()
            right = self.signed()
            total = total * right if sign.text == "*" else self._quotient(sign, total, right)
        return total

    def signed(self) -> Expression:
        if self._next() in ("+", "-"):
            sign = self._take()
            value = self.signed()
            return value if sign.text == "+" else -value
        base = self.atom()
        if self._next() in ("**", "^"):
            sign = self._take()
            exponent = self.signed()
            return self._with_line(sign, lambda: base**exponent)
        return base

    def atom(self) -> Expression:
        piece = self._take()
        if piece.kind == "number":
            return constant(Fraction(piece.text.replace("d", "e").replace("D", "e")))
        if piece.kind == "name":
            if self._next() == "(":
                return self._call(piece)
            if piece.text not in self.names:
                raise ProblemError(f"line {piece.line}: {piece.text!r} is not a variable")
            return self.names[piece.text]
        if piece.text == "(":
            value = self.sum()
            self._expect(")")
            return value
        raise ProblemError(f"line {piece.line}: a number, a name or a parenthesis is expected, not {piece.text!r}")

    def _quotient(self, sign: Token, above: Expression, below: Expression) -> Expression:
        return self._with_line(sign, lambda: above / below)

    def _call(self, function: Token) -> Expression:
        self._expect("(")
        arguments = [self.sum()]
        while self._next() == ",":
            self._take()
            arguments.append(self.sum())
        self._expect(")")
        name = function.text.lower()
        if name == "sqr" and len(arguments) == 1:
            return arguments[0] * arguments[0]
        if name == "power" and len(arguments) == 2:
            return self._with_line(function, lambda: arguments[0] ** arguments[1])
        raise ProblemError(
            f"line {function.line}: {function.text} of {len(arguments)} arguments cannot be read; "
            "of the functions only sqr(a) and power(a, n) are polynomials"
        )

    def _with_line(self, piece: Token, make: Callable[[], Expression]) -> Expression:
        """Return what ``make`` returns; an error message gets the line of the token."""
        try:
            return make()
        except ProblemError as error:
            raise ProblemError(f"line {piece.line}: {error}") from None

    def _next(self) -> str | None:
        return self.pieces[self.place].text if self.place < len(self.pieces) else None

    def _take(self) -> Token:
        if self.place == len(self.pieces):
            raise ProblemError(f"line {self.pieces[-1].line}: the expression ends after {self.pieces[-1].text!r}")
        self.place += 1
        return self.pieces[self.place - 1]

    def _expect(self, text: str) -> None:
        piece = self._take()
        if piece.text != text:
            raise ProblemError(f"line {piece.line}: {text!r} is expected, not {piece.text!r}")
