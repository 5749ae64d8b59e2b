"""SCIP on the same polynomial problem: the rival of the benchmarks, in floating point and without proof.

It is given the finite box that smid derives (without one it has nothing to branch on) and all variables scaled to
[-1, 1] (unscaled, a gap that is asked of a small parameter lies below its feasibility tolerance).
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
import pyscipopt

from relaxations.algebra.polynomial import Polynomials
from relaxations.problem.problem import PolynomialProblem
from relaxations.reductions.scaling import Scaling


@dataclass(frozen=True)
class ScipEnd:
    """One end by SCIP: its dual bound, the gap to its best point (both in the variable's unit), its seconds."""

    bound: float
    gap: float
    seconds: float


def scip_minimum(problem: PolynomialProblem, objective: Polynomials, gap: float, limit: float) -> ScipEnd:
    """Minimise a polynomial on the problem as stated, to a gap relative to ``max(1, |minimum|)`` or until a limit."""
    model = pyscipopt.Model()
    model.hideOutput()
    model.setParam("limits/absgap", gap)
    model.setParam("limits/gap", gap)
    model.setParam("limits/time", limit)
    model.setParam("parallel/maxnthreads", 1)
    ends = np.stack([problem.lower, problem.upper], axis=1).tolist()
    x = [model.addVar(lb=low if np.isfinite(low) else None, ub=up if np.isfinite(up) else None) for low, up in ends]
    for member in _members(problem.equalities):
        model.addCons(_sum(member, x) == 0)
    for member in _members(problem.inequalities):
        model.addCons(_sum(member, x) >= 0)
    value = model.addVar(lb=None)
    model.addCons(_sum(_members(objective)[0], x) <= value)
    model.setObjective(value, "minimize")
    started = time.process_time()
    model.optimize()
    seconds = time.process_time() - started
    lower, upper = model.getDualbound(), model.getPrimalbound()
    return ScipEnd(float(lower), float(upper - lower), seconds)


def scip_end(problem: PolynomialProblem, variable: int, sign: float, gap: float, limit: float) -> ScipEnd:
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
    for member in _members(problem.equalities):
        model.addCons(_sum(member, x) == 0)
    for member in _members(problem.inequalities):
        model.addCons(_sum(member, x) >= 0)
    model.setObjective(sign * x[variable], "minimize")
    started = time.perf_counter()
    model.optimize()
    seconds = time.perf_counter() - started
    left = abs(model.getPrimalbound() - model.getDualbound()) * scaling.scale[variable]
    end = scaling.centre[variable] + scaling.scale[variable] * sign * model.getDualbound()
    return ScipEnd(float(end), float(left), seconds)


def _members(family: Polynomials) -> list[list[tuple[float, list[int]]]]:
    members: list[list[tuple[float, list[int]]]] = [[] for _ in range(family.n_rows)]
    for row, factor, value in zip(
        family.rows.tolist(), family.factors.tolist(), family.coefficients.mid.tolist(), strict=True
    ):
        members[row].append((value, [v for v in factor if v >= 0]))
    return members


def _sum(member: list[tuple[float, list[int]]], x: list[pyscipopt.Variable]) -> object:
    return pyscipopt.quicksum(c * np.prod([x[v] for v in variables] or [1.0]) for c, variables in member)
