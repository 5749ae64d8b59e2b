"""Decide in fractions whether a point lies in a polynomial problem whose coefficients are balls."""

from collections.abc import Mapping
from fractions import Fraction
from math import isinf

from relaxations.algebra.polynomial import Polynomials
from relaxations.problem.problem import PolynomialProblem


def what_excludes(problem: PolynomialProblem, point: Mapping[str, Fraction]) -> list[str]:
    """Name the boxes and rows that no choice of coefficients within their balls lets the point meet; none if inside."""
    x = [point[name] for name in problem.names]
    ends = zip(problem.names, x, problem.lower.tolist(), problem.upper.tolist(), strict=True)
    found = [name for name, value, low, high in ends if not (_below(low, value) and _below(-high, -value))]
    found += [f"equality {k}" for k, (low, high) in enumerate(_values(problem.equalities, x)) if not low <= 0 <= high]
    return found + [f"inequality {k}" for k, (_, high) in enumerate(_values(problem.inequalities, x)) if high < 0]


def _below(end: float, value: Fraction) -> bool:
    return isinf(end) or Fraction(end) <= value


def _values(family: Polynomials, x: list[Fraction]) -> list[tuple[Fraction, Fraction]]:
    rows = []
    for terms in family.terms():
        low = high = Fraction(0)
        for mid, rad, variables in terms:
            monomial = Fraction(1)
            for v in variables:
                monomial *= x[v]
            low += Fraction(mid) * monomial - Fraction(rad) * abs(monomial)
            high += Fraction(mid) * monomial + Fraction(rad) * abs(monomial)
        rows.append((low, high))
    return rows
