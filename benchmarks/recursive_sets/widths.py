"""How wide the intervals are, beside batch intervals, linear programs, rivals and a sliding window."""

from __future__ import annotations

import time
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import numpy as np
from scipy.optimize import linprog

from benchmarks.recursive_sets.records import Record, plant_record, record
from benchmarks.recursive_sets.rivals import Ellipsoid, Zonotope
from benchmarks.recursive_sets.section import section
from relaxations.algebra.arrays import Array
from smid import Dataset, OutputError, identify
from smid.recursive.sliding_window import SlidingWindow

BATCH_LIMIT = 120.0  # seconds
PIECES = (16, 64, 256)
PLANTS: tuple[tuple[str, Array, Array], ...] = (
    ("0.8", np.array([-0.8]), np.array([1.0])),
    ("0.8, 0.6", np.poly([0.8, 0.6])[1:], np.array([1.0, 0.5])),
    ("0.7 ± 0.4i", np.poly([0.7 + 0.4j, 0.7 - 0.4j]).real[1:], np.array([1.0, 0.5])),
)
CASES = (
    *PLANTS,
    *((f"2 poles, random {seed}", seed, 2) for seed in (0, 1, 2, 4, 5, 6, 7)),
    ("3 poles, random 0", 0, 3),
)


def batch(case: Record, n: int) -> tuple[Array, Array, float, str]:
    """Return the batch intervals of the first samples, the processor seconds that they took, and why they ended."""
    reach = {p.name: (p.lower, p.upper) for p in OutputError(case.arx.na, case.arx.nb, stable=True).parameters}
    bounds = {name: reach[name] for name in case.arx.names if name.startswith("a")} | case.bounds
    data = Dataset.from_arrays(input={"u": case.u[:n]}, output={"y": case.y[:n]}, sampling_time=1.0)
    began = time.process_time()
    model = OutputError(case.arx.na, case.arx.nb, bounds=bounds)
    found = identify(model, data, case.noise_bound, tolerance=1e-2, seconds=BATCH_LIMIT)
    seconds = time.process_time() - began
    ends = found.intervals
    return np.array([i.lower for i in ends]), np.array([i.upper for i in ends]), seconds, found.reason.name.lower()


def beside_batch(case: tuple[Any, ...]) -> list[str]:
    """Return a row: widths before and after refinements as multiples of the batch widths, and the times."""
    title, first, second = case
    known = (
        plant_record(first, second, 400) if isinstance(first, np.ndarray) else record(first, second, second - 1, 400)
    )
    low, high, seconds, reason = batch(known, 400)
    ratios, spent, inside = list[str](), list[str](), True
    for pieces in (0, *PIECES):
        estimator = known.estimator()
        for sample in zip(known.u.tolist(), known.y.tolist(), strict=True):
            estimator.update(*sample)
        before = time.process_time()
        if pieces:
            estimator.refine(pieces)
            spent.append(f"{time.process_time() - before:.1f}")
        ratio = (estimator.upper - estimator.lower) / (high - low)
        ratios.append(f"{ratio.min():.2f} to {ratio.max():.2f}")
        inside &= bool((estimator.lower <= known.truth).all() and (known.truth <= estimator.upper).all())
    return [title, *ratios, "yes" if inside else "no", f"{seconds:.1f}, {reason}", ", ".join(spent)]


def widths() -> str:
    """Return how much wider the recursive intervals are than the batch ones, before and after a refinement."""
    began = time.perf_counter()
    with ProcessPoolExecutor(2) as pool:
        rows = list(pool.map(beside_batch, CASES))
    head = [
        "poles",
        "recursive / batch, over the parameters",
        *(f"refined in {pieces} pieces / batch" for pieces in PIECES),
        "truth inside",
        "batch s, ended by",
        "refinement s",
    ]
    text = section("Width beside batch intervals, output error, N = 400", head, rows, began)
    return f"{text}\n\n{linear_widths()}"


def linear_widths() -> str:
    """Return the widths for equation errors, beside linear programs over all samples, an ellipsoid and a zonotope."""
    began = time.perf_counter()
    rows = []
    for na, nb in ((1, 0), (2, 1), (3, 2)):
        a = np.poly([0.8, 0.5, -0.3][:na])[1:]
        case = plant_record(a, np.array([1.0, 0.5, 0.2])[: nb + 1], 2000, error="equation")
        estimator = case.estimator()
        lower, upper = estimator.lower, estimator.upper
        rivals = (Ellipsoid(lower, upper), Zonotope(lower, upper))
        matrix, y = case.arx.matrix(case.u, case.y), case.y[case.arx.max_lag :]
        for row, value in zip(matrix, y.tolist(), strict=True):
            for rival in rivals:
                rival.update(row, value, case.noise_bound)
        for sample in zip(case.u.tolist(), case.y.tolist(), strict=True):
            estimator.update(*sample)
        system = np.concatenate([matrix, -matrix]), np.concatenate([y, -y]) + case.noise_bound
        box = list(zip(lower, upper, strict=True))
        axes = np.eye(len(lower))
        exact = np.array([[-linprog(-s * c, *system, bounds=box).fun for s in (1, -1)] for c in axes]).sum(axis=1)
        ratios = [(s.upper - s.lower) / exact for s in (estimator, *rivals)]
        rows.append([str(len(lower)), f"{exact[0]:.2g}", *(f"{r.min():.4g} to {r.max():.4g}" for r in ratios)])
    head = ["parameters", "exact width of a1", "smid / exact", "ellipsoid / exact", "zonotope / exact"]
    return section("Width beside linear programs over all samples, equation error, N = 2000", head, rows, began)


def window() -> str:
    """Return the intervals over a sliding window."""
    began = time.perf_counter()
    rows = []
    for title, a, b in PLANTS:
        case = plant_record(a, b, 300)
        model = OutputError(case.arx.na, case.arx.nb, stable=True, bounds=case.bounds)
        estimator = SlidingWindow(model, case.noise_bound, window=100, every=50)
        recursive, inside, spent = case.estimator(), True, 0.0
        for sample in zip(case.u.tolist(), case.y.tolist(), strict=True):
            before = time.perf_counter()
            estimator.update(*sample)
            spent += time.perf_counter() - before
            recursive.update(*sample)
            inside &= all(i.lower <= t <= i.upper for i, t in zip(estimator.intervals, case.truth, strict=True))
        ours = recursive.upper - recursive.lower
        widths = [i.width for i in estimator.intervals]
        rows.append(
            [
                title,
                " ".join(f"{w:.2g}" for w in widths),
                " ".join(f"{w:.2g}" for w in ours),
                "yes" if inside else "no",
                f"{spent / 5:.2f}",
            ]
        )
    head = ["poles", "window of 100, widths", "recursive set of all 300, widths", "truth inside", "s for each window"]
    return section("Sliding window, every 50 samples", head, rows, began)
