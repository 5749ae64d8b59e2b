"""One diagnosis with all effects: analytic sensitivities in two processes against finite differences in one.

The search is the same, `smid.diagnosis.search.search`; what differs is where the Jacobians come from and how many
processes share the effects.  The case is a blind one of 1000 samples.
"""

from __future__ import annotations

import time
from concurrent.futures import ProcessPoolExecutor

import numpy as np

from benchmarks.blind.cases import TEST, draw
from smid.diagnosis import EFFECTS
from smid.diagnosis.search.record import Record
from smid.diagnosis.search.search import search
from smid.diagnosis.search.trial import fitted_base
from smid.fitting.binding import bind

SEED = 0


def run() -> str:
    """Measure both and return the section for docs/benchmarks.md."""
    case = draw(SEED)
    model, n = bind(case.model, case.data), case.data.experiments[0].n_samples
    used = (np.arange(n) < round((1 - TEST) * n),)
    channels = model.input_channels[0], model.output_channels[0]
    record = Record(case.data, used, *channels)
    slow_base, base = (fitted_base(model, case.data, used, *channels, difference=d) for d in (True, False))

    began = time.perf_counter()
    slow = search(record, slow_base, EFFECTS)
    differences = time.perf_counter() - began
    began = time.perf_counter()
    with ProcessPoolExecutor(2) as pool:
        found = search(record, base, EFFECTS, pool)
    analytic = time.perf_counter() - began
    named = [found.visited[0].names, slow.visited[0].names]
    return "\n".join(
        [
            "## Diagnosis, N = 1000, all effects",
            "",
            f"Hidden: {', '.join(case.truth)} on {case.plant}; {len(EFFECTS)} effects.",
            "",
            "| search | named | s | ratio |",
            "|---|---|---|---|",
            f"| analytic sensitivities, two processes | {', '.join(named[0])} | {analytic:.1f} | 1 |",
            f"| finite differences, one process | {', '.join(named[1])} | {differences:.1f} "
            f"| {differences / analytic:.1f} |",
        ]
    )


if __name__ == "__main__":
    print(run())
