"""Order studies to order 3: each bound certified, with the solver's words and what the fallback chain did."""

from __future__ import annotations

import time

from benchmarks.records import errors_in_variables, hammerstein, output_error
from relaxations.algebra.polynomial import Polynomials
from relaxations.library import load
from relaxations.problem.problem import PolynomialProblem
from relaxations.proof.bounding import relax
from smid import FeasibleSet
from smid.identification.finite_box import with_finite_box

LIBRARY = ("gms_Bex3_1_4", "gms_st_e09", "gms_Bex9_2_8", "gms_gbd", "gms_st_e24", "floudas_3_2")


def _identification() -> dict[str, tuple[PolynomialProblem, Polynomials, str]]:
    found = {}
    for known in (output_error(40), hammerstein(40), errors_in_variables(12, poles=1)):
        problem = with_finite_box(FeasibleSet(known.model, known.data, known.noise_bound)).feasible.problem
        found[f"{known.name}, N = {len(known.data.values('y'))}"] = (problem, problem.variable(0), "lift")
    return found


def run() -> str:
    """Return the table as Markdown."""
    problems = {name: (load(name).problem, load(name).objective, "sparse") for name in LIBRARY} | _identification()
    lines = [
        "## Order studies to order 3",
        "",
        "| problem, method | order | certified bound | known optimum | s | solver's words |",
        "|---|---|---|---|---|---|",
    ]
    for name, (problem, objective, method) in problems.items():
        optimum = f"{load(name).optimum:.8g}" if name in LIBRARY else ""
        for order in (1, 2, 3):
            if 2 * order < max(problem.degree, objective.degree):
                continue
            started = time.perf_counter()
            proven = relax(problem, method, order, objective=objective).bound(objective)
            seconds = time.perf_counter() - started
            lines.append(
                f"| {name}, {method} | {order} | {proven.bound:.8g} | {optimum} | {seconds:.2f} | {proven.status} |"
            )
            print(lines[-1], flush=True)
    return "\n".join(lines)
