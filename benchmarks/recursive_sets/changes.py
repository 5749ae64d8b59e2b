"""When a change of the pole is certified, and whether one is where there is none."""

from __future__ import annotations

import time
from concurrent.futures import ProcessPoolExecutor

import numpy as np

from benchmarks.recursive_sets.records import Record, noise_of
from benchmarks.recursive_sets.section import section
from smid.recursive import Arx
from smid.recursive.locate_change import locate_change

SEEDS, CHANGED, LENGTH = 100, 300, 600
WITHIN = 50
POLES = ((0.8, 0.6, 0.03), (0.8, 0.6, 0.1), (0.8, 0.75, 0.03), (0.8, 0.8, 0.03), (0.8, 0.8, 0.1))
"""Before, after, and the noise bound as a share of the largest output."""


def changing(seed: int, before: float, after: float, share: float) -> Record:
    """Simulate one pole that changes in the middle, at unit gain: ``w[t] = p w[t-1] + (1 - p) u[t-1]``."""
    generator = np.random.default_rng(seed)
    pole = np.where(np.arange(LENGTH) < CHANGED, before, after)
    u, w = generator.choice([-1.0, 1.0], LENGTH), np.zeros(LENGTH)
    for k in range(1, LENGTH):
        w[k] = pole[k] * w[k - 1] + (1 - pole[k]) * u[k - 1]
    bound = share * float(np.abs(w).max())
    y = w + bound * noise_of(generator, LENGTH, "uniform")
    return Record(Arx(), np.column_stack([-pole, 1 - pole]), u, y, bound)


def alarms(task: tuple[int, float, float, float]) -> tuple[list[int], int, bool]:
    """Return the samples of the certified changes, the length of the first one's located stretch, and soundness."""
    case = changing(*task)
    estimator, inside = case.estimator(), True
    for k, (u, y) in enumerate(zip(case.u.tolist(), case.y.tolist(), strict=True)):
        if estimator.update(u, y) is None and (estimator.empty is not None or k < CHANGED):
            inside &= bool((estimator.lower <= case.truth[k]).all() and (case.truth[k] <= estimator.upper).all())
    changes = estimator.history.changes
    if not changes:
        return [], 0, inside
    located = locate_change(estimator, changes[0], case.u, case.y)
    inside &= located.after < CHANGED <= located.sample
    return [change.sample for change in changes], located.sample - located.after, inside


def changes() -> str:
    """Return when a change of the pole is certified, and whether one is where there is none."""
    began = time.perf_counter()
    rows = []
    with ProcessPoolExecutor(2) as pool:
        for before, after, share in POLES:
            tasks = [(seed, before, after, share) for seed in range(SEEDS)]
            found = list(pool.map(alarms, tasks, chunksize=5))
            delays = [samples[0] - CHANGED for samples, _, _ in found if samples]
            stretches = [stretch for samples, stretch, _ in found if samples]
            true = before != after
            rows.append(
                [
                    f"{before} to {after}" if true else f"stays {before}",
                    f"{share:.0%}",
                    f"{sum(0 <= d < WITHIN for d in delays)} of {SEEDS}" if true else "",
                    f"{np.median(delays):.0f}, {max(delays)}" if delays else "",
                    f"{np.median(stretches):.0f}, {max(stretches)}" if stretches else "",
                    str(sum(d < 0 for d in delays) + sum(len(s) > true for s, _, _ in found)),
                    f"{sum(inside for *_, inside in found)} of {SEEDS}",
                ]
            )
    head = [
        "pole",
        "noise",
        f"certified within {WITHIN} samples",
        "delay: median, largest",
        "located within: median, largest",
        "false alarms",
        "truth inside",
    ]
    return section(f"A change of the pole at sample {CHANGED} of {LENGTH}, {SEEDS} seeds", head, rows, began)
