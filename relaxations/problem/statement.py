"""A problem as plain lists with every float in hexadecimal, as problem files and certificates contain it."""

from __future__ import annotations

from typing import Any

import numpy as np

from relaxations.algebra.polynomial import Polynomials
from relaxations.problem.problem import PolynomialProblem


def statement(problem: PolynomialProblem) -> dict[str, Any]:
    """Return ``variables``, ``box``, ``equalities`` and ``inequalities`` of a problem, ready for JSON."""

    def end(value: float) -> str | None:
        return float(value).hex() if np.isfinite(value) else None

    return {
        "variables": list(problem.names),
        "box": [[end(low), end(high)] for low, high in zip(problem.lower, problem.upper, strict=True)],
        "equalities": listed(problem.equalities),
        "inequalities": listed(problem.inequalities),
    }


def listed(polynomials: Polynomials) -> list[list[list[Any]]]:
    """Return ``[coefficient, radius, variables]`` for each term of each polynomial, numbers in hexadecimal."""
    rows: list[list[list[Any]]] = [[] for _ in range(polynomials.n_rows)]
    for row, factor, mid, rad in zip(
        polynomials.rows.tolist(),
        polynomials.factors.tolist(),
        polynomials.coefficients.mid.tolist(),
        polynomials.coefficients.rad.tolist(),
        strict=True,
    ):
        rows[row].append([mid.hex(), rad.hex() if rad else 0, [v for v in factor if v >= 0]])
    return rows
