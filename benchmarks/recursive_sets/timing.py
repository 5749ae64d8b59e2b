"""How long an update takes, beside an ellipsoid, a zonotope and padasip's RLS."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from importlib.util import find_spec

import numpy as np

from benchmarks.recursive_sets.records import record
from benchmarks.recursive_sets.rivals import Ellipsoid, Zonotope
from benchmarks.recursive_sets.section import section


def timing() -> str:
    """Return what one update takes."""
    began = time.perf_counter()
    rows = []
    for title, error, options in (
        ("output error and drift", "output", {"drift": 1e-4}),
        ("errors in variables", "output", {"input_noise_bound": 0.01}),
        ("errors in variables and drift", "output", {"input_noise_bound": 0.01, "drift": 1e-4}),
        ("output error", "output", {}),
        ("equation error", "equation", {}),
    ):
        case = record(5, 3, 2, 3000, error)
        samples = list(zip(case.u.tolist(), case.y.tolist(), strict=True))
        rows.append([f"smid, {title}", *times([clocked(case.estimator(**options).update, samples) for _ in range(3)])])
    # The rivals are given the regressors, ready-made.
    bound, first = case.noise_bound, case.estimator()
    equations = list(
        zip(case.arx.matrix(case.u, case.y), case.y[case.arx.max_lag :].tolist(), [bound] * len(case.y), strict=False)
    )
    for rival in (Ellipsoid, Zonotope):
        runs = [clocked(rival(first.lower, first.upper).update, equations) for _ in range(3)]
        rows.append([rival.__name__.lower(), *times(runs)])
    if find_spec("padasip") is not None:
        from padasip.filters import FilterRLS

        pairs = [(value, row) for row, value, _ in equations]
        runs = [clocked(FilterRLS(n=6, mu=0.995, w="zeros").adapt, pairs) for _ in range(3)]
        rows.append(["padasip RLS", *times(runs)])
    head = ["one update, 6 parameters", "median ms", "mean ms", "99 % below ms", "largest ms"]
    return section("Time of one update, 6 parameters; the fastest of three runs, sample by sample", head, rows, began)


def clocked(update: Callable[..., object], samples: Sequence[tuple[object, ...]]) -> list[float]:
    """Return the milliseconds of each update."""
    result = []
    for sample in samples:
        began = time.thread_time()
        update(*sample)
        result.append(1e3 * (time.thread_time() - began))
    return result


def times(runs: Sequence[Sequence[float]]) -> list[str]:
    """Summarise the fastest run at each sample: the rest is other load."""
    best = np.min(runs, axis=0)
    figures = (np.median(best), best.mean(), np.quantile(best, 0.99), best.max())
    return [f"{figure:.3f}" for figure in figures]
