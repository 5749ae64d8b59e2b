"""A problem as plain lists with every float in hexadecimal, as problem files and certificates contain it."""

from __future__ import annotations

from typing import Any

import numpy as np

from relaxations.algebra.polynomial import Polynomials
from relaxations.problem.problem import PolynomialProblem
from relaxations.writing import hexadecimal


def statement(problem: PolynomialProblem) -> dict[str, Any]:
    """Return ``variables``, ``box``, ``equalities`` and ``inequalities`` of a problem, ready for JSON."""

    def end(value: float) -> str | None:
        return hexadecimal(value) if np.isfinite(value) else None

    return {
        "variables": list(problem.names),
        "box": [[end(low), end(high)] for low, high in zip(problem.lower, problem.upper, strict=True)],
        "equalities": listed(problem.equalities),
        "inequalities": listed(problem.inequalities),
    }


def listed(polynomials: Polynomials) -> list[list[list[Any]]]:
    """Return ``[coefficient, radius, variables]`` for each term of each polynomial, numbers in hexadecimal."""
    return [
        [[hexadecimal(mid), hexadecimal(rad) if rad else 0, factor] for mid, rad, factor in row]
        for row in polynomials.terms()
    ]
