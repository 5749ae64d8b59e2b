"""The lift beside its linear variant, rlt, of the same order: certified widths and seconds, round by round.

Both by Clarabel, and rlt by the simplex method of HiGHS too. A round bounds both ends of every parameter once, on the
box that the rounds before left.
"""

from __future__ import annotations

import time
from functools import partial

import numpy as np

from benchmarks.records import Known, errors_in_variables, hammerstein, output_error
from relaxations.problem.problem import PolynomialProblem
from relaxations.proof.bounding import relax
from smid import FeasibleSet
from smid.identification.finite_box import with_finite_box

ROUNDS = 3
CASES = (
    (output_error, 200, 1),
    (output_error, 200, 2),
    (output_error, 1000, 1),
    (hammerstein, 200, 1),
    (hammerstein, 200, 2),
    (partial(errors_in_variables, poles=1), 200, 1),
)
WAYS = (("lift", "clarabel"), ("rlt", "clarabel"), ("rlt", "highs"))
LIMIT = 20.0  # s of the processor, after which no further bound is begun


def rounds(problem: PolynomialProblem, known: Known, method: str, order: int, solver: str) -> list[tuple[float, float]]:
    """Return the sum of the widths, in those of the first box, and the seconds of the processor, round by round."""
    count = len(known.truth)
    first = (problem.upper - problem.lower)[:count]
    found, started = [], time.process_time()
    for _ in range(ROUNDS):
        begun = time.process_time()
        relaxed = relax(problem, method, order, solver)
        lower, upper = problem.lower.copy(), problem.upper.copy()
        for k in range(count):
            if time.process_time() - started > LIMIT:
                return found
            lower[k] = max(lower[k], relaxed.bound(problem.variable(k)).bound)
            upper[k] = min(upper[k], -relaxed.bound(problem.variable(k, -1.0)).bound)
        assert ((lower[:count] <= known.truth) & (np.array(known.truth) <= upper[:count])).all(), "the truth is outside"
        problem = problem.with_box(lower, upper)
        found.append((float(((upper - lower)[:count] / first).sum()), time.process_time() - begun))
    return found


def run() -> str:
    """Return the table as Markdown."""
    numbers = [str(k + 1) for k in range(ROUNDS)]
    lines = [
        "## The lift beside its linear variant, rlt",
        "",
        f"{ROUNDS} rounds of contraction at one order. Width: the sum over the parameters of the interval's width "
        f"divided by the width of its first box. Times are processor times. A dash: not reached within {LIMIT:g} s.",
        "",
        "| model, N | order | method, solver | "
        + " | ".join([f"width, round {k}" for k in numbers] + [f"s, round {k}" for k in numbers])
        + " |",
        "|---" * (3 + 2 * ROUNDS) + "|",
    ]
    for make, n_samples, order in CASES:
        known = make(n_samples)
        problem = with_finite_box(FeasibleSet(known.model, known.data, known.noise_bound)).feasible.problem
        for method, solver in WAYS:
            found = rounds(problem, known, method, order, solver)
            missing = ["-"] * (ROUNDS - len(found))
            widths = [f"{width:.4g}" for width, _ in found] + missing
            seconds = [f"{spent:.2f}" for _, spent in found] + missing
            cells = [f"{known.name}, {n_samples}", str(order), f"{method}, {solver}", *widths, *seconds]
            lines.append(f"| {' | '.join(cells)} |")
            print(lines[-1], flush=True)
    return "\n".join(lines)
