"""The steps of a proof as data. Each kind has its rule in :mod:`relaxations.check.rules`."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from relaxations.check.arithmetic import Monomial, Polynomial, Terms

Proof = Iterable[Any]  # steps; each is read when it is checked


@dataclass(frozen=True)
class Product:
    """``weight * sigma * g``, where sigma is a sum of squares and g a product of constraints."""

    weight: Fraction
    basis: list[Monomial]
    factor: list[list[Fraction]]
    of: list[tuple[str, int]]  # ("inequality", number), or ("above" | "below" | "inside", variable)


@dataclass(frozen=True)
class Bound:
    """A lower bound by sums of squares."""

    objective: Polynomial
    bound: Fraction
    centre: list[Fraction]
    scale: list[Fraction]
    equalities: list[tuple[int, Terms]]
    products: list[Product]


@dataclass(frozen=True)
class Cut:
    """Multipliers of constraints, which several steps may use."""

    equalities: list[tuple[int, Fraction]]
    inequalities: list[tuple[int, Fraction]]


@dataclass(frozen=True)
class Cuts:
    """A lower bound by cuts in the outer variables."""

    objective: Polynomial
    bound: Fraction
    outer: frozenset[int]
    weights: list[tuple[int, Fraction]]


@dataclass(frozen=True)
class Range:
    """The part of the set on which a variable lies in [low, high]."""

    variable: int
    low: Fraction
    high: Fraction
    steps: Proof


@dataclass(frozen=True)
class OneSide:
    """The part of the set on which the argument of a kink is at least zero (side 1), or at most zero (side -1)."""

    kink: int
    side: int
    steps: Proof


@dataclass(frozen=True)
class Branches:
    """A lower bound that holds on every part."""

    objective: Polynomial
    bound: Fraction
    parts: Iterable[Range | OneSide]
    equality: int | None


@dataclass(frozen=True)
class Hull:
    """The range of some variables over all parts."""

    variables: list[int]
    parts: Iterable[Range | OneSide]
    equality: int | None


@dataclass(frozen=True)
class Level:
    """A lower bound, proven on the points whose objective is at most a level."""

    objective: Polynomial
    bound: Fraction
    level: Fraction
    steps: Proof


@dataclass(frozen=True)
class Quotient:
    """Bounds of the variable x of an equality ``A + B x = 0``."""

    equality: int
    variable: int


@dataclass(frozen=True)
class Face:
    """The points at which a scaled variable is 1 (side 1) or -1 (side -1)."""

    variable: int
    side: int
    steps: Proof


@dataclass(frozen=True)
class Reach:
    """Bounds of variables that have none."""

    sizes: dict[int, Fraction]
    riding: list[int]
    faces: Iterable[Face]


@dataclass(frozen=True)
class FixedRow:
    """The inequality ``sign h + slack >= 0`` for an equality h in which some variables have given values."""

    equality: int
    sign: int
    slack: Fraction
    values: list[tuple[int, Fraction]]


@dataclass(frozen=True)
class Fixed:
    """Steps with further inequalities, from equalities with fixed variables."""

    rows: list[FixedRow]
    steps: Proof


@dataclass(frozen=True)
class Row:
    """An inequality between a kink and its argument."""

    kind: str
    kink: int
    ends: list[Fraction]


@dataclass(frozen=True)
class Sides:
    """Steps on constraints in which decided kinks are replaced by their values."""

    sides: dict[int, int]
    rows: list[Row]
    defined: list[Quotient]
    steps: Proof
