"""The parts of a certificate file: names, numbers, monomials, polynomials, lists and objects.

Every limit and every type is checked here. Everything else is refused, unknown keys included.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from math import inf, lcm
from typing import Any

from relaxations.check.arithmetic import ZERO, Interval, Monomial, Polynomial, Terms, Unreadable, Work

LONGEST_NAME = 120  # characters
HIGHEST_DEGREE = 64
MOST_DIGITS = 700  # of a whole number, or of either part of a fraction
LARGEST_EXPONENT = 2300  # of two, in a float
MOST_ODD_BITS = 512  # of the least common multiple of all denominators, without its factors of two
MANY = 1 << 31  # limit of constraint, kink and cut numbers here; the rules check them against the statement

WORK_FOR_A_NUMBER = 80  # products of short numbers, allowed for each number in the file

_HEXADECIMAL = re.compile(r"(-?)0x([01])(?:\.([0-9a-f]{1,32}))?p([+-]?[0-9]{1,5})")
_FRACTION = re.compile(r"(-?[0-9]+)(?:/([0-9]+))?")


def read_name(value: Any, where: str) -> str:
    """Return a name that can be printed on one line."""
    if not isinstance(value, str) or not value or len(value) > LONGEST_NAME:
        raise Unreadable(f"{where}: {excerpt(value)} is not a name of 1 to {LONGEST_NAME} characters")
    if not value.isprintable():
        raise Unreadable(f"{where}: the name {excerpt(value)} has characters that cannot be printed")
    return value


def shown_name(name: str) -> str:
    """Return a name for printing: in quotes and escaped, unless it is an identifier, optionally with an index.

    >>> print(shown_name("eta[12,run_a]"), shown_name("x >= 5"))
    eta[12,run_a] "x >= 5"
    """
    return name if re.fullmatch(r"[A-Za-z_]\w*(\[[\w,.-]*\])?", name, re.ASCII) else json.dumps(name)


def excerpt(value: Any) -> str:
    """Return the beginning of a value in plain ASCII, for messages."""
    if isinstance(value, int) and value.bit_length() > 200:
        return f"a whole number of {value.bit_length()} bits"
    text = ascii(value) if isinstance(value, str | int | None) else f"a {type(value).__name__}"
    return text if len(text) <= 60 else text[:57] + "..."


@dataclass
class Reader:
    """Reads nested values of a file. The amount of data read determines how much work the check may take."""

    count: int  # variables
    work: Work
    odd: int = 1  # least common multiple of all denominators, without its factors of two

    def fields(self, value: Any, where: str, required: Iterable[str], optional: Iterable[str] = ()) -> dict[str, Any]:
        """Return an object after checking its keys."""
        if not isinstance(value, dict):
            raise Unreadable(f"{where} is not an object")
        for key in required:
            if key not in value:
                raise Unreadable(f"{where} has no {key!r}")
        for key in value:
            if key not in (*required, *optional):
                raise Unreadable(f"{where} has an unknown key {excerpt(key)}")
        return value

    def items(self, value: Any, where: str, length: int | None = None) -> list[Any]:
        """Return a list after checking its length, if one is given."""
        if not isinstance(value, list):
            raise Unreadable(f"{where} is not a list")
        if length is not None and len(value) != length:
            raise Unreadable(f"{where} has {len(value)} entries instead of {length}")
        return value

    def number(self, value: Any, where: str) -> Fraction:
        """Return a number exactly."""
        self.work.left += WORK_FOR_A_NUMBER
        if isinstance(value, str):
            found = _HEXADECIMAL.fullmatch(value)
            if found and abs(exponent := int(found[4])) <= LARGEST_EXPONENT:
                digits = found[3] or ""
                whole, places = int(found[1] + found[2] + digits, 16), exponent - 4 * len(digits)
                return Fraction(whole << places) if places >= 0 else Fraction(whole, 1 << -places)
            found = _FRACTION.fullmatch(value) if len(value) <= 2 * MOST_DIGITS else None
            if found and len(found[1]) <= MOST_DIGITS and (divisor := int(found[2] or 1)):
                odd = divisor // (divisor & -divisor)
                if self.odd % odd:
                    self.odd = lcm(self.odd, odd)
                if self.odd.bit_length() > MOST_ODD_BITS:
                    raise Unreadable(f"{where}: the denominators in this file have no small common multiple")
                return Fraction(int(found[1]), divisor)
        elif isinstance(value, int) and not isinstance(value, bool) and value.bit_length() <= 3 * MOST_DIGITS:
            return Fraction(value)
        raise Unreadable(
            f"{where}: {excerpt(value)} is not a number; write 3, '1/3' or a float in hexadecimal, '0x1.8p+1'"
        )

    def index(self, value: Any, where: str, count: int | None = None) -> int:
        """Return an integer from 0 to ``count - 1``; by default the number of a variable."""
        limit = self.count if count is None else count
        # A negative number would count from the end.
        if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < limit:
            raise Unreadable(f"{where}: {excerpt(value)} is not a number from 0 to {limit - 1}")
        return value

    def side(self, value: Any, where: str) -> int:
        """Return 1 or -1."""
        if value not in (1, -1) or not isinstance(value, int) or isinstance(value, bool):
            raise Unreadable(f"{where}: {excerpt(value)} is not a side, 1 or -1")
        return value

    def ends(self, value: Any, where: str) -> Interval:
        """Return both bounds of a variable; null is infinite."""
        low, high = self.items(value, where, 2)
        return -inf if low is None else self.number(low, where), inf if high is None else self.number(high, where)

    def monomial(self, value: Any, where: str) -> Monomial:
        """Return the variables of a monomial."""
        variables = self.items(value, where)
        if len(variables) > HIGHEST_DEGREE:
            raise Unreadable(f"{where}: degree {len(variables)}, the limit is {HIGHEST_DEGREE}")
        self.work.left += WORK_FOR_A_NUMBER * len(variables)
        return tuple(sorted([self.index(v, where) for v in variables]))

    def polynomial(self, value: Any, where: str) -> Polynomial:
        """Read ``[[mid, rad, [variables]], ...]``."""
        mids: Terms = {}
        rads: Terms = {}
        for entry in self.items(value, where):
            mid, rad, variables = self.items(entry, f"{where}, a term", 3)
            m = self.monomial(variables, where)
            mids[m] = mids.get(m, ZERO) + self.number(mid, where)
            if rad != 0 or isinstance(rad, bool):
                radius = self.number(rad, where)
                if radius < 0:
                    raise Unreadable(f"{where}: radius >= 0 fails for {excerpt(rad)}")
                rads[m] = rads.get(m, ZERO) + radius
        return Polynomial(mids, rads)

    def terms(self, value: Any, where: str) -> Terms:
        """Read ``[[coefficient, [variables]], ...]``."""
        found: Terms = {}
        for entry in self.items(value, where):
            number, variables = self.items(entry, where, 2)
            m = self.monomial(variables, where)
            found[m] = found.get(m, ZERO) + self.number(number, where)
        return found

    def pairs(self, value: Any, where: str, count: int) -> list[tuple[int, Fraction]]:
        """Read ``[[index, number], ...]``."""
        found = []
        for entry in self.items(value, where):
            k, number = self.items(entry, where, 2)
            found.append((self.index(k, where, count), self.number(number, where)))
        return found
