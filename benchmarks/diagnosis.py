"""One diagnosis with all effects: analytic sensitivities in two processes against finite differences in one.

The search is the same, `smid.diagnosis.search.search`; what differs is where the Jacobians come from and how many
processes share the effects.  The case is a blind one of 1000 samples.  Where the time goes is told by the innermost of
some functions on the stack, looked at every 5 ms of processor time.
"""

from __future__ import annotations

import signal
import time
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from types import FrameType

import numpy as np

from benchmarks.blind.cases import TEST, draw
from smid.diagnosis import EFFECTS
from smid.diagnosis.search.record import Record
from smid.diagnosis.search.search import search
from smid.diagnosis.search.trial import fitted_base
from smid.fitting.binding import bind

SEED = 0
PHASES = {
    "extensions": "effects put on the model (sympy)",
    "predictor": "equations of the one-step-ahead fit (sympy)",
    "compile_free_run": "machine code",
    "start": "initial states",
    "explained": "first steps, which rank the starts",
    "one_step_ahead": "one-step-ahead fits",
    "solve": "fits of the free run",
    "rank": "merits",
}
EVERY = 0.005  # s


def phases(work: Callable[[], object]) -> Counter[str]:
    """Return how often each phase was met while some work was done."""
    met: Counter[str] = Counter()

    def look(_number: int, frame: FrameType | None) -> None:
        while frame is not None and frame.f_code.co_name not in PHASES:
            frame = frame.f_back
        met[PHASES[frame.f_code.co_name] if frame else "all else"] += 1

    before = signal.signal(signal.SIGPROF, look)
    signal.setitimer(signal.ITIMER_PROF, EVERY, EVERY)
    try:
        work()
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)
    return met


def run() -> str:
    """Measure both and return the section for docs/benchmarks.md."""
    case = draw(SEED)
    model, n = bind(case.model, case.data), case.data.experiments[0].n_samples
    used = (np.arange(n) < round((1 - TEST) * n),)
    channels = model.input_channels[0], model.output_channels[0]
    record = Record(case.data, used, *channels)
    slow_base, base = (fitted_base(model, case.data, used, *channels, difference=d) for d in (True, False))

    met = phases(lambda: search(record, base, EFFECTS))
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
            "",
            "| where the time goes, one process | share |",
            "|---|---|",
            *(f"| {phase} | {count / met.total():.0%} |" for phase, count in met.most_common()),
        ]
    )


if __name__ == "__main__":
    print(run())
