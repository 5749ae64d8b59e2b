"""All four parameters of the clutch thesis's Hammerstein model, N = 200: smid beside SCIP on the same problem.

SCIP stops at a gap of 1e-3 of the interval's width. Its answer is floating point; smid's ends are certified, and smid's
time includes deriving the box and verifying the witnesses.
"""

from __future__ import annotations

import time

import numpy as np

from benchmarks.scip import scip_end
from smid import FeasibleSet, Hammerstein, identify
from smid.box import with_finite_box
from smid.records import load_clutch

SAMPLES, NOISE_BOUND, GAP, LIMIT = 200, 0.3, 1e-3, 120.0


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
        low, high = (scip_end(box, k, sign, GAP * i.width, LIMIT) for sign in (1.0, -1.0))
        theirs += low.seconds + high.seconds
        lines.append(
            f"| {i.name} | {i.lower:.8g} | {i.upper:.8g} | {i.gap / i.width:.1e} | {low.bound:.8g} | {high.bound:.8g} "
            f"| {low.seconds + high.seconds:.2f} |"
        )
    largest = max(i.gap / i.width for i in estimate.intervals)
    lines += [
        "",
        f"smid {ours:.2f} s in all (box, bounds, witnesses), largest gap {largest:.1e} of the width; "
        f"SCIP {theirs:.2f} s in all (limit {LIMIT:g} s an end); SCIP / smid = {theirs / ours:.2f}.",
    ]
    assert np.isfinite(largest)
    return "\n".join(lines)
