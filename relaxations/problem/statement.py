"""A problem as plain lists, with every float in hexadecimal: what problem files and certificates state."""

from __future__ import annotations

from typing import Any

import numpy as np

from relaxations.algebra.polynomial import Polynomials
from relaxations.problem.problem import PolynomialProblem


def statement(problem: PolynomialProblem) -> dict[str, Any]:
    """Return a problem as JSON holds it, without format, version and objective.

    Returns
    -------
    dict
        ``variables``, ``box``, ``equalities`` and ``inequalities``.

    Examples
    --------
    >>> from relaxations.formats.expressions import problem_of, variables
    >>> (x,) = variables("x")
    >>> problem, _ = problem_of(x, [x >= 0.5])
    >>> statement(problem)["box"]
    [['0x1.0000000000000p-1', None]]
    """

    def end(value: float) -> str | None:
        return float(value).hex() if np.isfinite(value) else None

    return {
        "variables": list(problem.names),
        "box": [[end(low), end(high)] for low, high in zip(problem.lower, problem.upper, strict=True)],
        "equalities": listed(problem.equalities),
        "inequalities": listed(problem.inequalities),
    }


def listed(polynomials: Polynomials) -> list[list[list[Any]]]:
    """Return ``[coefficient, radius, variables]`` for each term of each member.

    Returns
    -------
    list of list of [str, str or 0, list of int]
        Numbers in hexadecimal.

    Examples
    --------
    >>> listed(Polynomials.from_terms([{(0, 0): 1.5, (): -1.0}]))
    [[['-0x1.0000000000000p+0', 0, []], ['0x1.8000000000000p+0', 0, [0, 0]]]]
    """
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
