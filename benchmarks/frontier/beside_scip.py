"""All ends to a gap of 1e-3 of the width: smid beside SCIP on the same box, both one end after the other on one core.

smid's ends are certified and its time counts the box, the bounds and the witnesses; SCIP's are floating point. smid
also runs with two threads, each on a core of its own: the ends of a round are bounded side by side.
"""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor

from benchmarks.frontier.records import Known, errors_in_variables, hammerstein
from benchmarks.scip import scip_end
from smid import FeasibleSet, identify
from smid.box import with_finite_box

GAP = 1e-3
LIMIT = 300.0  # s an end, for SCIP


def table(known: Known, limit: float = LIMIT) -> str:
    """Return the comparison of all ends of one record as Markdown."""
    started = time.perf_counter()
    estimate = identify(known.model, known.data, known.noise_bound, tolerance=GAP)
    ours = time.perf_counter() - started
    started = time.perf_counter()
    with ThreadPoolExecutor(2) as threads:
        identify(known.model, known.data, known.noise_bound, tolerance=GAP, executor=threads)
    in_threads = time.perf_counter() - started
    box = with_finite_box(FeasibleSet(known.model, known.data, known.noise_bound)).feasible.problem
    lines = [
        f"### {known.name}, N = {known.data.n_samples}",
        "",
        "| parameter | truth | smid lower | upper | gap / width | SCIP lower | upper | gap / width | SCIP s |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    theirs, unfinished = 0.0, 0
    for k, (i, true) in enumerate(zip(estimate.intervals, known.truth, strict=True)):
        low, high = (scip_end(box, k, sign, GAP * i.width, limit) for sign in (1.0, -1.0))
        theirs += low.seconds + high.seconds
        unfinished += (low.seconds >= limit) + (high.seconds >= limit)
        lines.append(
            f"| {i.name} | {true:.6g} | {i.lower:.7g} | {i.upper:.7g} | {i.gap / i.width:.1e} | {low.bound:.7g} "
            f"| {high.bound:.7g} | {max(low.gap, high.gap) / i.width:.1e} | {low.seconds + high.seconds:.1f} |"
        )
    largest = max(i.gap / i.width for i in estimate.intervals)
    lines += [
        "",
        f"smid {ours:.1f} s in all, largest gap {largest:.1e} of the width; SCIP {theirs:.1f} s in all, {unfinished} "
        f"ends stopped at the limit of {limit:g} s; SCIP / smid = {theirs / ours:.1f}. smid with two threads "
        f"{in_threads:.1f} s, {theirs / in_threads:.1f} times.",
    ]
    return "\n".join(lines)


def run() -> str:
    """Return both comparisons of the issue's size."""
    return "\n\n".join(["## Beside SCIP", table(errors_in_variables(200)), table(hammerstein(5000), limit=120.0)])
