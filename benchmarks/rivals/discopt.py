"""discopt on the same polynomial problem: spatial branch and bound over convex relaxations. It needs boxes."""

from __future__ import annotations

import math
import time

import discopt

from benchmarks.rivals.stated import RivalEnd, boxes, sums
from relaxations.algebra.polynomial import Polynomials
from relaxations.problem.problem import PolynomialProblem


def discopt_minimum(problem: PolynomialProblem, objective: Polynomials, gap: float, limit: float) -> RivalEnd:
    """Minimise a polynomial, to a relative gap or until a limit in seconds."""
    model = discopt.Model("problem")
    x = [model.continuous(f"x{k}", lb=low, ub=up) for k, (low, up) in enumerate(boxes(problem))]
    for value in sums(problem.equalities, x):
        model.subject_to(value == 0)
    for value in sums(problem.inequalities, x):
        model.subject_to(value >= 0)
    model.minimize(sums(objective, x)[0])
    started = time.process_time()
    found = model.solve(time_limit=limit, gap_tolerance=gap)
    seconds = time.process_time() - started
    nothing = found.bound is None or found.objective is None
    lower, upper = (-math.inf, math.inf) if nothing else (float(found.bound), float(found.objective))
    return RivalEnd(lower, upper - lower, seconds)
