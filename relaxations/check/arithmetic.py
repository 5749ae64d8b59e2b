"""Exact arithmetic: polynomials with rational coefficients, each known exactly or within a radius.

A polynomial ``mid +- rad`` is the set of polynomials whose coefficients differ from ``mid`` by at most ``rad``. Every
result contains the exact results of all members of its arguments. Nothing is rounded.

The products are counted and limited, so that a small file cannot take a long time.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction
from math import inf, lcm

Monomial = tuple[int, ...]  # the variables' numbers with repetition, sorted: x0^2 x1 is (0, 0, 1)
Terms = dict[Monomial, Fraction]
End = Fraction | float  # a float here is infinite
Interval = tuple[End, End]

ONE, ZERO = Fraction(1), Fraction(0)


class Refused(Exception):
    """The file does not prove its claim.

    Examples
    --------
    >>> from relaxations.check import check
    >>> try:
    ...     check({"format": "a shopping list"})
    ... except Refused as refusal:
    ...     print(refusal)
    the file is not a certificate: its 'format' is not 'relaxations certificate'
    """


class Unreadable(Refused):
    """The file is not a certificate, or exceeds a limit of this program.

    Examples
    --------
    >>> from relaxations.check import read
    >>> try:
    ...     read("nowhere.json")
    ... except Unreadable as error:
    ...     print(error)
    nowhere.json: No such file or directory
    """


@dataclass
class Work:
    """The remaining work, in products of short numbers."""

    left: int

    def spend(self, amount: int) -> None:
        """Count work, and refuse the file if it exceeds the limit."""
        self.left -= amount
        if self.left < 0:
            raise Unreadable("the check of this file takes more work than the limit for its size")


@dataclass(frozen=True)
class Polynomial:
    """Coefficients ``mid +- rad`` of monomials; a missing monomial has zero for both.

    Parameters
    ----------
    mid, rad
        A monomial is the sorted tuple of its variables' numbers, with repetition.

    Examples
    --------
    >>> p = Polynomial({(0, 0): Fraction(1), (): Fraction(-1, 3)}, {(): Fraction(1, 100)})  # x0^2 - 1/3 +- 1/100
    >>> sorted(p.monomials)
    [(), (0, 0)]
    """

    mid: Terms = field(default_factory=dict)
    rad: Terms = field(default_factory=dict)

    @property
    def monomials(self) -> set[Monomial]:
        """Return the monomials whose coefficient may differ from zero."""
        return {m for part in (self.mid, self.rad) for m, value in part.items() if value}

    @property
    def variables(self) -> set[int]:
        """Return the variables that occur."""
        return {v for m in self.monomials for v in m}

    def scaled(self, factor: Fraction) -> Polynomial:
        """Return the polynomial times a number."""
        size = abs(factor)
        return Polynomial({m: c * factor for m, c in self.mid.items()}, {m: c * size for m, c in self.rad.items()})

    def plus(self, other: Polynomial) -> Polynomial:
        """Return the sum."""
        total = Polynomial(dict(self.mid), dict(self.rad))
        total.add(other)
        return total

    def add(self, other: Polynomial, factor: Fraction = ONE) -> None:
        """Add a multiple of another polynomial to this one, in place."""
        _add(self.mid, other.mid, factor)
        _add(self.rad, other.rad, abs(factor))

    def times(self, other: Polynomial, work: Work) -> Polynomial:
        """Return the product."""
        mid = product(self.mid, other.mid, work)
        if not self.rad and not other.rad:
            return Polynomial(mid)
        rad = product(_absolute(self.mid), other.rad, work)
        _add(rad, product(self.rad, _absolute(other.mid), work))
        _add(rad, product(self.rad, other.rad, work))
        return Polynomial(mid, rad)


def constant(value: Fraction | int) -> Polynomial:
    """Return a constant polynomial."""
    return Polynomial({(): Fraction(value)})


def product(left: Terms, right: Terms, work: Work) -> Terms:
    """Return the product of two lists of terms."""
    degree = max(map(len, left), default=0) + max(map(len, right), default=0)
    work.spend(len(left) * len(right) * (_cost(_digits(left) + _digits(right)) + degree // 8))
    total: Terms = {}
    for m, a in left.items():
        for n, b in right.items():
            key = tuple(sorted(m + n)) if m and n else m or n
            total[key] = total[key] + a * b if key in total else a * b
    return total


def substituted(polynomial: Polynomial, values: dict[int, Polynomial], work: Work) -> Polynomial:
    """Return the polynomial with some variables replaced by polynomials."""
    if not values.keys() & polynomial.variables:
        return polynomial
    total = Polynomial()
    powers: dict[Monomial, Polynomial] = {(v,): value for v, value in values.items()} | {(): constant(1)}

    def power(m: Monomial) -> Polynomial:
        if m not in powers:
            powers[m] = power(m[:-1]).times(values[m[-1]], work)
        return powers[m]

    for m in polynomial.monomials:
        kept = tuple(v for v in m if v not in values)
        own = Polynomial({kept: polynomial.mid.get(m, ZERO)}, {kept: polynomial.rad[m]} if m in polynomial.rad else {})
        total.add(own.times(power(tuple(v for v in m if v in values)), work))
    return total


def sum_of_squares(basis: list[Monomial], factor: list[list[Fraction]], work: Work) -> Polynomial:
    """Return ``sum over columns f of (sum_i f_i b_i)^2``."""
    # Integers over one denominator are multiplied many times faster than fractions.
    denominator = lcm(*(value.denominator for row in factor for value in row))
    rows = [[value.numerator * (denominator // value.denominator) for value in row] for row in factor]
    digits = max((value.bit_length() for row in rows for value in row), default=0)
    work.spend(sum(map(len, rows)) * (len(rows) + 1) * _cost(digits) // 8 + len(rows) ** 2)
    total: dict[Monomial, int] = {}
    for i, left in enumerate(rows):
        for j in range(i, len(rows)):
            weight = sum(a * b for a, b in zip(left, rows[j], strict=True))
            key = tuple(sorted(basis[i] + basis[j]))
            total[key] = total.get(key, 0) + (weight if i == j else 2 * weight)
    return Polynomial({m: Fraction(value, denominator * denominator) for m, value in total.items()})


def value_range(polynomial: Polynomial, box: list[Interval], work: Work) -> Interval:
    """Return bounds of the polynomial on a box, added up monomial by monomial."""
    low: End = ZERO
    high: End = ZERO
    for m in polynomial.monomials:
        mid, rad = polynomial.mid.get(m, ZERO), polynomial.rad.get(m, ZERO)
        ends: Interval = (mid - rad, mid + rad)
        for v in m:
            work.spend(4 * _cost(_digits({(k,): e for k, e in enumerate((*ends, *box[v])) if isinstance(e, Fraction)})))
            products = [_times(a, b) for a in ends for b in box[v]]
            ends = min(products), max(products)
        low = -inf if -inf in (low, ends[0]) else low + ends[0]
        high = inf if inf in (high, ends[1]) else high + ends[1]
    return low, high


def _times(a: End, b: End) -> End:
    """Return the product of two bounds, of which each may be infinite."""
    if not a or not b:
        return ZERO  # the variables are finite, so 0 times any value is 0
    if isinstance(a, Fraction) and isinstance(b, Fraction):
        return a * b
    return inf if (a > 0) == (b > 0) else -inf


def _add(total: Terms, more: Terms, factor: Fraction = ONE) -> None:
    """Add terms times a factor, in place."""
    if factor == -1:
        more = {m: -value for m, value in more.items()}
    elif factor != 1:
        more = {m: value * factor for m, value in more.items()}
    for m, value in more.items():
        total[m] = total[m] + value if m in total else value


def _absolute(part: Terms) -> Terms:
    """Return the terms with absolute coefficients."""
    return {m: abs(value) for m, value in part.items()}


def _digits(part: Terms) -> int:
    """Return the largest number of bits of a coefficient."""
    return max([v.numerator.bit_length() + v.denominator.bit_length() for v in part.values()], default=0)


def _cost(bits: int) -> int:
    """Return the cost of a product of numbers with so many bits, in products of short numbers."""
    return 1 + (bits // 1024) ** 2
