"""A public exercise of set-membership identification: errors in variables, one pole, N = 30, three pieces of knowledge.

Both noises within 0.05, stable, minimum phase, DC gain between 3 and 7. Our own seeded data; every method gets the same
finite box, and SCIP its answer in floating point.
"""

from __future__ import annotations

import time

import numpy as np
from scipy.signal import lfilter

from benchmarks.rivals.scip import scip_end
from relaxations.errors import ProblemError
from relaxations.problem.problem import PolynomialProblem
from relaxations.proof.bounding import relax
from smid import Dataset, ErrorsInVariables, FeasibleSet, identify
from smid.identification.finite_box import with_finite_box

SAMPLES, BOUND, GAP = 30, 0.05, 1e-4
A1, B0, B1 = -0.9, 0.35, 0.15  # DC gain 5, zero at -0.43


def _data() -> Dataset:
    rng = np.random.default_rng(6)
    u = rng.uniform(-1, 1, SAMPLES)
    w = lfilter([B0, B1], [1.0, A1], u)
    noise = rng.uniform(-BOUND, BOUND, (2, SAMPLES))
    return Dataset.from_arrays(input={"u": u + noise[0]}, output={"y": w + noise[1]}, sampling_time=1.0)


def run() -> str:
    """Return the table of the pole's interval by each method as Markdown."""
    model = ErrorsInVariables(1, 1, stable=True, minimum_phase=True, dc_gain=(3, 7))
    data = _data()
    problem = with_finite_box(FeasibleSet(model, data, BOUND)).feasible.problem
    started = time.perf_counter()
    estimate = identify(model, data, BOUND, tolerance=GAP)
    seconds = time.perf_counter() - started
    a1 = estimate["a1"]
    lines = [
        f"## A public exercise: errors in variables, one pole, N = {SAMPLES}",
        "",
        f"The true pole parameter is {A1}. With its defaults smid gives a1 in [{a1.lower:.6f}, {a1.upper:.6f}] "
        f"certified, [{a1.inner_lower:.6f}, {a1.inner_upper:.6f}] attained at verified points. All "
        f"{len(estimate.intervals)} parameters took {seconds:.2f} s.",
        "",
        "| method, one relaxation an end on the same box | a1, certified | s per bound | solver's words |",
        "|---|---|---|---|",
    ]
    for method, order in (("sparse", 1), ("sparse", 2), ("textbook", 1), ("textbook", 2), ("lift", 1), ("lift", 2)):
        lines.append(_row(problem, method, order))
        print(lines[-1], flush=True)
    ends = [scip_end(problem, 0, sign, GAP * a1.width, 120.0) for sign in (1.0, -1.0)]
    lines.append(
        f"| SCIP, gap {GAP:g} of the width | [{ends[0].bound:.6f}, {ends[1].bound:.6f}], floating point | "
        f"{sum(e.seconds for e in ends) / 2:.2f} | |"
    )
    return "\n".join(lines)


def _row(problem: PolynomialProblem, method: str, order: int) -> str:
    started = time.perf_counter()
    try:
        low, high = (relax(problem, method, order).bound(problem.variable(0, sign)) for sign in (1, -1))
    except ProblemError as error:
        return f"| {method}, order {order} | {error} | | |"
    seconds = (time.perf_counter() - started) / 2
    words = " / ".join(dict.fromkeys((low.status, high.status)))
    return f"| {method}, order {order} | [{low.bound:.6f}, {-high.bound:.6f}] | {seconds:.2f} | {words} |"
