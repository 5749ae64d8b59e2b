"""The statement of a certificate: variables in a box, constraints and kinks; and theorems about it.

The *set* of a statement contains the points x for which coefficients exist, each inside its ball, such that

- every x_k lies in its box,
- every equality is zero and every inequality is nonnegative at x,
- every kink variable equals ``max(0, a(x))``, or ``sign(a(x))``, of its argument a.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from decimal import ROUND_FLOOR, Decimal
from decimal import Context as DecimalContext
from fractions import Fraction
from functools import cached_property
from math import inf
from typing import Any

from relaxations.check.arithmetic import ONE, ZERO, End, Interval, Polynomial, Refused, Work


@dataclass(frozen=True)
class Kink:
    """A variable that is ``max(0, argument)``, or the sign of the argument; the argument may contain earlier kinks."""

    variable: int
    sign: bool
    argument: Polynomial


@dataclass(frozen=True)
class Theorem:
    """The objective is at least the bound at every point of the set.

    Parameters
    ----------
    step
        The step that proves it.
    objective
        In the variables of the file.

    Examples
    --------
    >>> Theorem("step 1", Polynomial(), ONE).empty  # 0 >= 1 holds at no point
    True
    """

    step: str
    objective: Polynomial
    bound: Fraction

    @property
    def empty(self) -> bool:
        """Return whether the theorem proves that the set is empty."""
        return not self.objective.monomials and self.bound > 0

    @property
    def single(self) -> tuple[int, Fraction] | None:
        """Return variable and slope if the objective is an exact multiple of one variable, else None."""
        monomials = self.objective.monomials
        if self.objective.rad or len(monomials) != 1:
            return None
        (m,) = monomials
        return (m[0], self.objective.mid[m]) if len(m) == 1 else None


def emptiness(step: str) -> Theorem:
    """Return the theorem that the set is empty."""
    return Theorem(step, Polynomial(), ONE)


@dataclass(frozen=True)
class Stated:
    """Constraints that hold on the set; a constraint that is None must not be used."""

    names: list[str]
    equalities: list[Polynomial | None]
    inequalities: list[Polynomial | None]
    kinks: list[Kink]
    chosen: dict[int, int]  # by the number of a kink: the sign of its argument on this part
    cuts: list[Any]  # multipliers of the constraints, for rules/cuts.py

    def row(self, kind: str, number: int, where: str) -> Polynomial:
        """Return a constraint by its number."""
        rows = self.equalities if kind == "equality" else self.inequalities
        if number >= len(rows):
            raise Refused(f"{where}: {kind} {number} is not among the {len(rows)} that are stated")
        row = rows[number]
        if row is None:
            raise Refused(f"{where}: {kind} {number} is not affine in the variables without a box")
        return row

    def kink(self, number: int, where: str) -> Kink:
        """Return a kink by its number."""
        if number >= len(self.kinks):
            raise Refused(f"{where}: kink {number} is not among the {len(self.kinks)} that are stated")
        return self.kinks[number]

    def cut(self, number: int, where: str) -> Any:
        """Return the multipliers of a cut by its number."""
        if number >= len(self.cuts):
            raise Refused(f"{where}: cut {number} is not among the {len(self.cuts)} that are stated")
        return self.cuts[number]

    @cached_property
    def memory(self) -> dict[Any, Any]:
        """Return a cache for rules about these constraints."""
        return {}

    @cached_property
    def vanishing(self) -> dict[int, set[int]]:
        """Return the variables of each equality that is one monomial with a nonzero coefficient.

        The monomial is zero at every point of the set, so one of its variables is zero.
        """
        found = {}
        for number, row in enumerate(self.equalities):
            monomials = list(row.monomials) if row is not None else []
            if row is not None and len(monomials) == 1:
                (m,) = monomials
                if abs(row.mid.get(m, ZERO)) > row.rad.get(m, ZERO):
                    found[number] = set(m)
        return found


Box = list[Interval]


@dataclass(frozen=True)
class Context:
    """What a rule may use. Every point of the set lies in ``box``, which each step can narrow."""

    where: str
    stated: Stated
    box: Box
    proven: list[Theorem]
    work: Work

    def inside(self, place: str, stated: Stated | None = None, box: Box | None = None) -> Context:
        """Return the context of the steps inside a step, with a box and theorems of its own."""
        return Context(
            f"{self.where}, {place}", stated or self.stated, list(self.box if box is None else box), [], self.work
        )

    def at(self, number: int) -> Context:
        """Return the context with the number of a step, for messages."""
        return replace(self, where=f"{self.where}, step {number}" if self.where else f"step {number}")

    def name(self, variable: int) -> str:
        """Return the name of a variable."""
        return self.stated.names[variable]

    def ends(self, variable: int) -> tuple[Fraction, Fraction]:
        """Return both bounds of a variable, which must be finite."""
        return self.end(variable, 0), self.end(variable, 1)

    def end(self, variable: int, side: int) -> Fraction:
        """Return the lower bound (side 0) or the upper one (side 1) of a variable, which must be finite."""
        end = self.box[variable][side]
        if isinstance(end, Fraction):
            return end
        raise Refused(f"{self.where}: {self.name(variable)} has no finite box")

    def require(self, condition: bool, message: str) -> None:
        """Refuse the file unless a condition holds."""
        if not condition:
            raise Refused(f"{self.where}: {message}")


Prove = Callable[[Iterable[Any], Context], bool]


def size(monomial: Iterable[int], context: Context) -> Fraction:
    """Return the largest absolute value of a monomial on the box."""
    largest = ONE
    for v in monomial:
        low, high = context.ends(v)
        largest *= max(abs(low), abs(high))
    return largest


def narrow(box: Box, variable: int, low: End, high: End) -> None:
    """Intersect the range of a variable with [low, high]."""
    lower, upper = box[variable]
    box[variable] = (max(lower, low), min(upper, high))


def tighten(box: Box, theorem: Theorem) -> None:
    """Narrow the box of x_k by a theorem ``c x_k >= bound``."""
    if theorem.single is not None:
        k, slope = theorem.single
        end = theorem.bound / slope
        narrow(box, k, *((end, inf) if slope > 0 else (-inf, end)))


def may_vanish(ends: Interval) -> bool:
    """Return whether a range contains zero."""
    return ends[0] <= 0 <= ends[1]


def settle(context: Context) -> bool:
    """Fix variables of vanishing monomials at zero, and return whether the box is empty.

    If only one variable of a vanishing monomial can be zero, it is zero. If none can, the set is empty.
    """
    box, products = context.box, context.stated.vanishing.values()
    changed = True
    while changed:
        changed = False
        for variables in products:
            able = [v for v in variables if may_vanish(box[v])]
            if not able:
                return True
            if len(able) == 1 and box[able[0]] != (ZERO, ZERO):
                box[able[0]] = (ZERO, ZERO)
                changed = True
    return any(low > high for low, high in box)


def shown(value: End, digits: int = 15) -> str:
    """Return a decimal that is at most the value, so that a printed lower bound is valid.

    >>> shown(Fraction(2, 3), 4), shown(Fraction(-2, 3), 4)
    ('0.6666', '-0.6667')
    """
    if not isinstance(value, Fraction):
        return "no bound"
    decimals = DecimalContext(prec=digits, rounding=ROUND_FLOOR)
    return format(decimals.divide(Decimal(value.numerator), Decimal(value.denominator)).normalize(decimals), "g")
