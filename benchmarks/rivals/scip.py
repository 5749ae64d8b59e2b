"""SCIP on the same polynomial problem: the rival of the benchmarks, in floating point and without proof.

It is given the finite box that smid derives (without one it has nothing to branch on) and all variables scaled to
[-1, 1] (unscaled, a gap that is asked of a small parameter lies below its feasibility tolerance).
"""

from __future__ import annotations

import time

import numpy as np
import pyscipopt

from benchmarks.rivals.stated import RivalEnd, members
from relaxations.algebra.polynomial import Polynomials
from relaxations.problem.problem import PolynomialProblem
from relaxations.reductions.scaling import Scaling


def scip_minimum(problem: PolynomialProblem, objective: Polynomials, gap: float, limit: float) -> RivalEnd:
    """Minimise a polynomial on the problem as stated, to a gap relative to ``max(1, |minimum|)`` or until a limit."""
    model = pyscipopt.Model()
    model.hideOutput()
    model.setParam("limits/absgap", gap)
    model.setParam("limits/gap", gap)
    model.setParam("limits/time", limit)
    model.setParam("parallel/maxnthreads", 1)
    ends = np.stack([problem.lower, problem.upper], axis=1).tolist()
    x = [model.addVar(lb=low if np.isfinite(low) else None, ub=up if np.isfinite(up) else None) for low, up in ends]
    for member in members(problem.equalities):
        model.addCons(_sum(member, x) == 0)
    for member in members(problem.inequalities):
        model.addCons(_sum(member, x) >= 0)
    value = model.addVar(lb=None)
    model.addCons(_sum(members(objective)[0], x) <= value)
    model.setObjective(value, "minimize")
    started = time.process_time()
    model.optimize()
    seconds = time.process_time() - started
    lower, upper = model.getDualbound(), model.getPrimalbound()
    return RivalEnd(float(lower), float(upper - lower), seconds)


def scip_end(problem: PolynomialProblem, variable: int, sign: float, gap: float, limit: float) -> RivalEnd:
    """Bound one variable from below (sign 1) or above (-1), to a gap in its unit or until a limit in seconds."""
    scaling = Scaling.of_box(problem)
    problem = scaling.apply(problem)
    model = pyscipopt.Model()
    model.hideOutput()
    model.setParam("limits/absgap", gap / scaling.scale[variable])
    model.setParam("limits/gap", 0.0)
    model.setParam("limits/time", limit)
    model.setParam("parallel/maxnthreads", 1)
    x = [model.addVar(lb=float(low), ub=float(high)) for low, high in zip(problem.lower, problem.upper, strict=True)]
    for member in members(problem.equalities):
        model.addCons(_sum(member, x) == 0)
    for member in members(problem.inequalities):
        model.addCons(_sum(member, x) >= 0)
    model.setObjective(sign * x[variable], "minimize")
    started = time.perf_counter()
    model.optimize()
    seconds = time.perf_counter() - started
    left = abs(model.getPrimalbound() - model.getDualbound()) * scaling.scale[variable]
    end = scaling.centre[variable] + scaling.scale[variable] * sign * model.getDualbound()
    return RivalEnd(float(end), float(left), seconds)


def _sum(member: list[tuple[float, list[int]]], x: list[pyscipopt.Variable]) -> object:
    return pyscipopt.quicksum(c * np.prod([x[v] for v in variables] or [1.0]) for c, variables in member)
