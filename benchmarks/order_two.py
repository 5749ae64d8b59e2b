"""The lift beside the sparse relaxation of order 2 (Waki, Kim, Kojima and Muramatsu, as in SparsePOP) on EIV, N = 30.

Both ends of the pole: a bound of order 2 takes a minute.

The sparse relaxation is ours, with facial reduction, on the same finite box, by the same solver and certificate.
"""

from __future__ import annotations

import time

from benchmarks.records import errors_in_variables
from relaxations.proof.bounding import relax
from smid import FeasibleSet
from smid.identification.finite_box import with_finite_box

SAMPLES = 30


def run() -> str:
    """Return the comparison of all ends as Markdown."""
    known = errors_in_variables(SAMPLES, poles=1)
    problem = with_finite_box(FeasibleSet(known.model, known.data, known.noise_bound)).feasible.problem
    lines = [
        f"## The lift beside sparse order 2: {known.name}, N = {SAMPLES}",
        "",
        "Each end is bounded once on the whole box, without contraction. Bounds are certified. "
        "Seconds include building and solving.",
        "",
        "| end | lift, order 1 | s | sparse, order 1 | s | sparse, order 2 | s | ratio |",
        "|---|---|---|---|---|---|---|---|",
    ]
    total = {"lift 1": 0.0, "sparse 2": 0.0}
    for k, sign in ((0, 1), (0, -1)):
        cells, seconds = [], {}
        for method, order in (("lift", 1), ("sparse", 1), ("sparse", 2)):
            started = time.perf_counter()
            bound = relax(problem, method, order).bound(problem.variable(k, sign)).bound
            seconds[f"{method} {order}"] = time.perf_counter() - started
            cells.append(f"{sign * bound:.6g} | {seconds[f'{method} {order}']:.3f}")
        for name in total:
            total[name] += seconds[name]
        side = "lower" if sign > 0 else "upper"
        ratio = seconds["sparse 2"] / seconds["lift 1"]
        lines.append(f"| {problem.names[k]} {side} | {' | '.join(cells)} | {ratio:.0f} |")
        print(lines[-1], flush=True)
    lines += ["", f"In all: sparse order 2 / lift = {total['sparse 2'] / total['lift 1']:.0f}."]
    return "\n".join(lines)
