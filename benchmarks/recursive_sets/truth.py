"""Does the truth stay inside: seeded runs over random plants."""

from __future__ import annotations

import time
from concurrent.futures import ProcessPoolExecutor

import numpy as np

from benchmarks.recursive_sets.records import record
from benchmarks.recursive_sets.section import section

RUNS, SAMPLES = 200, 5000
FAMILIES: tuple[tuple[str, int, int, str], ...] = (
    ("output error, 1 pole", 1, 0, "output"),
    ("output error, 2 poles", 2, 1, "output"),
    ("output error, 3 poles", 3, 2, "output"),
    ("equation error, 3 poles", 3, 2, "equation"),
)
KINDS = ("uniform", "extreme", "held")


def stays(seed: int) -> tuple[str, str, bool, float]:
    """Return family and noise of a run, whether the truth was inside at every sample, and the final width of a1."""
    name, na, nb, error = FAMILIES[seed % len(FAMILIES)]
    kind = KINDS[seed // len(FAMILIES) % len(KINDS)]
    case = record(seed, na, nb, SAMPLES, error, kind)
    estimator = case.estimator()
    inside = True
    for u, y in zip(case.u.tolist(), case.y.tolist(), strict=True):
        estimator.update(u, y)
        inside &= bool((estimator.lower <= case.truth).all() and (case.truth <= estimator.upper).all())
    inside &= estimator.empty is None
    return name, kind, inside, float((estimator.upper - estimator.lower)[0])


def truth() -> str:
    """Return how often the truth stayed inside."""
    began = time.perf_counter()
    with ProcessPoolExecutor(2) as pool:
        results = list(pool.map(stays, range(RUNS), chunksize=5))
    rows = []
    for name, na, nb, _ in FAMILIES:
        own = [inside for family, _, inside, _ in results if family == name]
        cells = [name, str(na + nb + 1), f"{sum(own)} of {len(own)}"]
        for kind in KINDS:
            widths = [width for family, other, _, width in results if (family, other) == (name, kind)]
            cells.append(f"{np.median(widths):.2g}, {max(widths):.2g}")
        rows.append(cells)
    head = ["model", "parameters", "truth inside at every sample", *(f"width of a1, {kind} noise" for kind in KINDS)]
    return section(f"Truth, {RUNS} runs of {SAMPLES} samples; final widths: median, largest", head, rows, began)
