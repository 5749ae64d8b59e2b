"""The statement of a certificate file at rational points: numbers, polynomials and feasibility in fractions.

Nothing here is shared with the checker. A coefficient ``mid +- rad`` stands for each number in it, so a point is
feasible if some choice of the coefficients makes it so.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

__all__ = ["Kink", "Point", "Stated", "Terms", "is_feasible", "number", "range_at", "stated", "terms_of"]

Point = Sequence[Fraction]
Terms = list[tuple[Fraction, Fraction, tuple[int, ...]]]


@dataclass(frozen=True)
class Kink:
    """A variable that is the positive part of its argument, or the sign of it."""

    variable: int
    is_sign: bool
    argument: Terms


@dataclass(frozen=True)
class Stated:
    """What a file states: the box (None: no end), the rows and the kinks."""

    box: list[tuple[Fraction | None, Fraction | None]]
    equalities: list[Terms]
    inequalities: list[Terms]
    kinks: list[Kink]


def number(value: int | str) -> Fraction:
    """Return a number of a file, of any size, exactly."""
    if isinstance(value, int) or "x" not in value:
        return Fraction(value)
    mantissa, exponent = value.lower().replace("0x", "", 1).split("p")
    whole, _, digits = mantissa.partition(".")
    return Fraction(int(whole + digits, 16)) * Fraction(2) ** (int(exponent) - 4 * len(digits))


def terms_of(listed: Iterable[Any]) -> Terms:
    """Return the terms of a polynomial of a file, or of a theorem's pairs."""
    return [(number(mid), number(rad), tuple(monomial)) for mid, rad, monomial in listed]


def theorem_terms(mid: Mapping[tuple[int, ...], Fraction], rad: Mapping[tuple[int, ...], Fraction]) -> Terms:
    """Return the terms of a theorem's objective."""
    return [(mid.get(m, Fraction(0)), rad.get(m, Fraction(0)), m) for m in {*mid, *rad}]


def stated(document: Mapping[str, Any]) -> Stated:
    """Read what an accepted file states."""
    return Stated(
        [tuple(None if end is None else number(end) for end in pair) for pair in document["box"]],  # type: ignore[misc]
        [terms_of(row) for row in document["equalities"]],
        [terms_of(row) for row in document["inequalities"]],
        [
            Kink(kink["variable"], kink["kind"] == "sign", terms_of(kink["argument"]))
            for kink in document.get("kinks", [])
        ],
    )


def range_at(terms: Terms, point: Point) -> tuple[Fraction, Fraction]:
    """Return both ends of a polynomial's value at a point, over all choices of the coefficients."""
    middle = reach = Fraction(0)
    for mid, rad, monomial in terms:
        power = Fraction(1)
        for v in monomial:
            power *= point[v]
        middle += mid * power
        if rad:
            reach += rad * abs(power)
    return middle - reach, middle + reach


def is_kink(kink: Kink, point: Point) -> bool:
    """Say whether a kink has the value of its argument, for some choice of coefficients."""
    (low, high), value = range_at(kink.argument, point), point[kink.variable]
    if not kink.is_sign:
        return max(low, 0) <= value <= max(high, 0)
    return (value == 1 and high > 0) or (value == -1 and low < 0) or (value == 0 and low <= 0 <= high)


def is_inside(stated: Stated, point: Point) -> bool:
    """Say whether a point lies in the box."""
    return all(
        (low is None or low <= value) and (high is None or value <= high)
        for value, (low, high) in zip(point, stated.box, strict=True)
    )


def is_feasible(stated: Stated, point: Point) -> bool:
    """Say whether a point is feasible for some choice of coefficients inside their balls."""
    if not is_inside(stated, point):
        return False
    for row in stated.equalities:
        low, high = range_at(row, point)
        if low > 0 or high < 0:
            return False
    return all(range_at(row, point)[1] >= 0 for row in stated.inequalities) and all(
        is_kink(kink, point) for kink in stated.kinks
    )
