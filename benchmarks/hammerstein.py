"""All four parameters of the clutch thesis's Hammerstein model, N = 200: smid beside SCIP on the same problem.

SCIP is given the finite box that smid derives for the polynomial's coefficients (without one it has nothing to branch
on) and all variables scaled to [-1, 1] (unscaled, the gap asked of gamma1 is below its feasibility tolerance). It stops
at a gap of 1e-3 of the interval's width. Its answer is floating point; smid's ends are certified, and smid's time
includes deriving the box and verifying the witnesses.
"""

from __future__ import annotations

import time

import numpy as np
import pyscipopt

from relaxations.problem import PolynomialProblem
from relaxations.reductions.scaling import Scaling
from smid import FeasibleSet, Hammerstein, identify
from smid.box import with_finite_box
from smid.records import load_clutch

SAMPLES, NOISE_BOUND, GAP, LIMIT = 200, 0.3, 1e-3, 120.0


def scip_end(problem: PolynomialProblem, variable: int, sign: float, gap: float, limit: float) -> tuple[float, float]:
    """Return SCIP's dual bound of one end, and its seconds."""
    scaling = Scaling.of_box(problem)
    problem = scaling.apply(problem)
    model = pyscipopt.Model()
    model.hideOutput()
    model.setParam("limits/absgap", gap / scaling.scale[variable])
    model.setParam("limits/gap", 0.0)
    model.setParam("limits/time", limit)
    model.setParam("parallel/maxnthreads", 1)
    x = [model.addVar(lb=float(low), ub=float(high)) for low, high in zip(problem.lower, problem.upper, strict=True)]
    equalities = problem.equalities
    members: list[list[tuple[float, list[int]]]] = [[] for _ in range(equalities.n_rows)]
    for row, factor, value in zip(
        equalities.rows.tolist(), equalities.factors.tolist(), equalities.coefficients.mid.tolist(), strict=True
    ):
        members[row].append((value, [v for v in factor if v >= 0]))
    for member in members:
        expression = pyscipopt.quicksum(c * _product([x[v] for v in variables]) for c, variables in member)
        model.addCons(expression == 0)
    model.setObjective(sign * x[variable], "minimize")
    started = time.perf_counter()
    model.optimize()
    end = scaling.centre[variable] + scaling.scale[variable] * sign * model.getDualbound()
    return float(end), time.perf_counter() - started


def _product(factors: list[pyscipopt.Variable]) -> object:
    result: object = 1.0
    for factor in factors:
        result = result * factor  # type: ignore[operator]
    return result


def run() -> str:
    """Return the comparison as Markdown."""
    data = load_clutch("clutch_20C_ramp_a").crop(0, SAMPLES)
    model = Hammerstein(poles=1, powers=(5, 4, 3), input_scale=0.01, stable=True)
    started = time.perf_counter()
    estimate = identify(model, data, NOISE_BOUND, order=2, tolerance=GAP)
    ours = time.perf_counter() - started
    box = with_finite_box(FeasibleSet(model, data, NOISE_BOUND)).feasible.problem
    lines = [
        f"## Hammerstein, N = {SAMPLES}, eight ends to a gap of {GAP:g} of the width",
        "",
        "| parameter | smid lower, certified | smid upper, certified | gap / width | SCIP lower | upper | SCIP s |",
        "|---|---|---|---|---|---|---|",
    ]
    theirs = 0.0
    for k, i in enumerate(estimate.intervals):
        low, first = scip_end(box, k, 1.0, GAP * i.width, LIMIT)
        high, second = scip_end(box, k, -1.0, GAP * i.width, LIMIT)
        theirs += first + second
        lines.append(
            f"| {i.name} | {i.lower:.8g} | {i.upper:.8g} | {i.gap / i.width:.1e} | {low:.8g} | {high:.8g} "
            f"| {first + second:.2f} |"
        )
    largest = max(i.gap / i.width for i in estimate.intervals)
    lines += [
        "",
        f"smid {ours:.2f} s in all (box, bounds, witnesses), largest gap {largest:.1e} of the width; "
        f"SCIP {theirs:.2f} s in all (limit {LIMIT:g} s an end); SCIP / smid = {theirs / ours:.2f}.",
    ]
    assert np.isfinite(largest)
    return "\n".join(lines)
