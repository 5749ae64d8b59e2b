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
from smid.diagnosis.search.merit import Record
from smid.diagnosis.search.search import search
from smid.diagnosis.search.trial import Base
from smid.fitting.binding import bind
from smid.fitting.fit import fit

SEED = 0


def run() -> str:
    """Measure both and return the section for docs/benchmarks.md."""
    case = draw(SEED)
    model, n = bind(case.model, case.data), case.data.experiments[0].n_samples
    used = (np.arange(n) < round((1 - TEST) * n),)
    fitted = fit(model, case.data, used)
    channels = model.input_channels[0], model.output_channels[0]
    # Without the bound the search goes on until no effect is left to name, the longest it can take.
    record = Record(case.data, used, (~used[0],), *channels)

    began = time.perf_counter()
    slow = search(record, Base(fitted, case.data, used, *channels, difference=True), EFFECTS)
    differences = time.perf_counter() - began
    began = time.perf_counter()
    with ProcessPoolExecutor(2) as pool:
        found = search(record, Base(fitted, case.data, used, *channels), EFFECTS, pool)
    analytic = time.perf_counter() - began
    named = [[s.leader.trial.effect for s in f.stages if s.leader] for f in (found, slow)]
    return "\n".join(
        [
            "## Diagnosis, N = 1000, all effects",
            "",
            f"Hidden: {', '.join(case.truth)} on {case.plant}; {len(EFFECTS)} effects; "
            "the search ends when no further effect is significant.",
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
