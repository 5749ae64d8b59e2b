"""Time and memory against the number of samples, and beside linear programs at the true complicating parameters.

Once the complicating parameters are known, what is left is a linear program for each end: no method that has to find
them can be faster than these, solved by HiGHS on the same data. Each size runs in a process of its own, whose peak
memory is its own.
"""

from __future__ import annotations

import multiprocessing
import resource
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from scipy import sparse
from scipy.optimize import linprog

from benchmarks.records import Known, errors_in_variables, hammerstein, output_error
from relaxations.moments.parametric_lift import complicating_variables
from relaxations.problem.problem import PolynomialProblem
from smid import FeasibleSet, identify

Measured = TypeVar("Measured")

GAP = 1e-3
KINDS = {"output error": output_error, "Hammerstein": hammerstein, "errors in variables": errors_in_variables}
SIZES = (1000, 2000, 4000)
LARGEST = 20000


@dataclass(frozen=True)
class Run:
    """One record identified: seconds for all ends and for the linear programs, peak memory in MB, gap / width."""

    n_samples: int
    seconds: float
    programs: float
    memory: float
    gap: float


def linear_programs(known: Known) -> float:
    """Return the seconds of one linear program for each end, the complicating variables at the truth."""
    feasible = FeasibleSet(known.model, known.data, known.noise_bound)
    problem = feasible.problem
    complicating = complicating_variables(problem)
    assert complicating is not None
    point = np.zeros(problem.n_variables)
    point[: len(known.truth)] = known.truth
    lower, upper = problem.lower.copy(), problem.upper.copy()
    lower[complicating] = upper[complicating] = point[complicating]
    equal, rest = _linear(problem, point)
    seconds = 0.0
    for k in range(len(known.truth)):
        for sign in (1.0, -1.0):
            cost = np.zeros(problem.n_variables)
            cost[k] = sign
            started = time.process_time()
            # Without presolve, which ends the process on some of these programs (HiGHS 1.12 to 1.15).
            linprog(
                cost,
                A_eq=equal,
                b_eq=rest,
                bounds=np.stack([lower, upper], axis=1),
                method="highs",
                options={"presolve": False},
            )
            seconds += time.process_time() - started
    return seconds


def _linear(problem: PolynomialProblem, point: np.ndarray) -> tuple[sparse.csr_matrix, np.ndarray]:
    """Return the equalities at fixed complicating variables: affine in all others, so the derivative is exact."""
    rows, columns, values = problem.equalities.jacobian(point)
    shape = (problem.equalities.n_rows, problem.n_variables)
    matrix = sparse.csr_matrix((values, (rows, columns)), shape=shape)
    return matrix, matrix @ point - problem.equalities.evaluate(point)


def one(kind: str, n_samples: int) -> Run:
    """Identify one record."""
    known = KINDS[kind](n_samples)
    started = time.process_time()
    estimate = identify(known.model, known.data, known.noise_bound, tolerance=GAP)
    seconds = time.process_time() - started
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    programs = linear_programs(known)
    inside = all(i.lower <= t <= i.upper for i, t in zip(estimate.intervals, known.truth, strict=True))
    assert inside, "the truth lies outside"
    return Run(n_samples, seconds, programs, memory, max(i.gap / i.width for i in estimate.intervals))


def apart(measure: Callable[[str, int], Measured], kind: str, n_samples: int) -> Measured:
    """Return what a function measures in a process of its own, whose peak memory is its own."""
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        return pool.apply(measure, (kind, n_samples))


def run(sizes: tuple[int, ...] = SIZES, largest: int = LARGEST) -> str:
    """Return the table as Markdown."""
    lines = [
        "## Growth with the number of samples, and the distance to linear programs",
        "",
        f"Asked for is a gap of {GAP:g} of the width at each end. Times are processor times. "
        "Ratio: s / s of the linear programs.",
        "",
        "| model | N | s | gap / width | peak MB | kB a sample | s of the linear programs | ratio |",
        "|---|---|---|---|---|---|---|---|",
    ]
    growth = []
    for kind in KINDS:
        done: dict[int, Run] = {}
        for n in (*sizes, largest):
            r = done[n] = apart(one, kind, n)
            per_sample = (r.memory - done[sizes[0]].memory) / (n - sizes[0]) * 1e3 if n > sizes[0] else float("nan")
            lines.append(
                f"| {kind} | {n} | {r.seconds:.1f} | {r.gap:.1e} | {r.memory:.0f} | {per_sample:.1f} | "
                f"{r.programs:.2f} | {r.seconds / r.programs:.1f} |"
            )
            print(lines[-1], flush=True)
        growth.append(f"{kind} {done[sizes[-1]].seconds / done[sizes[0]].seconds:.1f}")
    lines += ["", f"Time at N = {sizes[-1]} over time at N = {sizes[0]}: {', '.join(growth)}."]
    return "\n".join(lines)
