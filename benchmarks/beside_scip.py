"""All ends to a gap of 1e-3 of the width: smid beside SCIP on the same box, both one end after the other on one core.

smid's ends are certified and its time counts the box, the bounds and the witnesses; SCIP's are floating point. smid
also runs with two threads, each on a core of its own: the ends of a round are bounded side by side.
"""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor

from benchmarks.records import CLUTCH, Known, errors_in_variables, hammerstein
from benchmarks.rivals.scip import scip_end
from smid import FeasibleSet, Hammerstein, identify
from smid.data.bundled import load_clutch
from smid.identification.finite_box import with_finite_box

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


def bundled() -> Known:
    """Return the clutch thesis's model on the first 200 samples of the ramp that comes with smid."""
    data = load_clutch("hammerstein_20C_ramp_a").crop(0, 200)
    model = Hammerstein(poles=1, powers=(5, 4, 3), input_scale=0.01, stable=True)
    return Known("Hammerstein of the clutch, bundled ramp", model, data, {data.output: 0.3}, CLUTCH)


def run() -> str:
    """Return the comparisons as Markdown."""
    records = (errors_in_variables(200), LIMIT), (hammerstein(5000), 120.0), (bundled(), 120.0)
    return "\n\n".join(["## Beside SCIP", *(table(known, limit) for known, limit in records)])
