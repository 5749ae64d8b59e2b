"""What every rival is given, and what it returns."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from relaxations.algebra.polynomial import Polynomials
from relaxations.problem.problem import PolynomialProblem

REACH = 10.0
"""Ends of variables without a box, for a solver that needs one."""


@dataclass(frozen=True)
class RivalEnd:
    """One end by a rival: its dual bound, the gap to its best point (both in the variable's unit), its seconds."""

    bound: float
    gap: float
    seconds: float


def boxes(problem: PolynomialProblem) -> list[tuple[float, float]]:
    """Return the box of each variable, within `REACH` where the statement has none."""
    low, up = np.maximum(problem.lower, -REACH).tolist(), np.minimum(problem.upper, REACH).tolist()
    return list(zip(low, up, strict=True))


def members(family: Polynomials) -> list[list[tuple[float, list[int]]]]:
    """Return the terms of each polynomial: coefficient, and variables with repetition."""
    members: list[list[tuple[float, list[int]]]] = [[] for _ in range(family.n_rows)]
    for row, factor, value in zip(
        family.rows.tolist(), family.factors.tolist(), family.coefficients.mid.tolist(), strict=True
    ):
        members[row].append((value, [v for v in factor if v >= 0]))
    return members


def sums(family: Polynomials, x: list[Any]) -> list[Any]:
    """Return each polynomial of the variables of a solver that overloads plus and times."""
    return [sum(math.prod((x[v] for v in factors), start=c) for c, factors in member) for member in members(family)]
