"""Do the present parameters stay inside while they drift."""

from __future__ import annotations

import time
from concurrent.futures import ProcessPoolExecutor

import numpy as np

from benchmarks.recursive_sets.records import INSIDE, Record, noise_of
from benchmarks.recursive_sets.section import section
from relaxations.algebra.arrays import Array
from smid.recursive import Arx

RUNS, SAMPLES = 200, 2000
DRIFTS: tuple[tuple[str, int, int, int, float], ...] = (
    ("1 pole", 1, 0, 1, 0.0),
    ("2 poles", 2, 1, 1, 0.0),
    ("1 pole, noisy input", 1, 0, 1, 0.02),
    ("1 pole, 2 inputs", 1, 0, 2, 0.0),
)
"""Title, poles, degree of the numerator, inputs, and the noise bound of the inputs, which are 1 or -1."""


def drifting(seed: int, na: int, nb: int, inputs: int, input_bound: float, n: int = SAMPLES) -> tuple[Record, Array]:
    """Simulate a plant whose poles and gains follow slow sines; return it with the largest change per sample."""
    generator, arx = np.random.default_rng(seed), Arx(na, nb, inputs=inputs)
    others = len(arx.names) - na

    def slow(count: int) -> Array:
        return np.sin(
            2 * np.pi * np.arange(n)[:, None] / generator.uniform(1500, 4000, count) + generator.uniform(0, 6, count)
        )

    poles = generator.uniform(0.2, 0.85, na) + generator.uniform(0.02, 0.1, na) * slow(na)
    theta = np.column_stack(
        [
            np.array([np.poly(own)[1:] for own in poles]),
            generator.uniform(0.5, 2, others) * (1 + 0.1 * slow(others)),
        ]
    )
    u, w, reach = generator.choice([-1.0, 1.0], (n, inputs)), np.zeros(n), arx.max_lag
    for k in range(reach, n):
        row = arx.row(w[k - na : k][::-1].tolist(), *(u[k - nb - 1 : k + 1, c][::-1].tolist() for c in range(inputs)))
        w[k] = np.dot(row, theta[k])
    bound = float(generator.uniform(0.01, 0.05)) * float(np.abs(w).max())
    y = w + bound * noise_of(generator, n, "uniform")
    measured = u + input_bound * INSIDE * generator.uniform(-1, 1, u.shape)
    return Record(arx, theta, measured, y, bound), np.abs(np.diff(theta, axis=0)).max(axis=0) * (1 + 1e-9)


def follows(seed: int) -> tuple[int, bool, bool, float, int]:
    """Return plant, whether it was always inside, false proofs, width of a1, and samples inside without a drift."""
    which = seed % len(DRIFTS)
    case, step = drifting(seed, *DRIFTS[which][1:])
    options = {"input_noise_bound": DRIFTS[which][4]}
    share, sets = (
        0,
        (
            case.estimator(drift=dict(zip(case.arx.names, step.tolist(), strict=True)), **options),
            case.estimator(**options),
        ),
    )
    inside = True
    for k, (u, y) in enumerate(zip(case.u.tolist(), case.y.tolist(), strict=True)):
        held = []
        for own in sets:
            own.update(u, y)
            held.append(bool((own.lower <= case.truth[k]).all() and (case.truth[k] <= own.upper).all()))
        inside &= held[0]
        share += held[1]
    history = sets[0].history
    width = float(np.median((history.upper - history.lower)[500:, 0]))
    return which, inside, bool(history.changes), width, share


def drift() -> str:
    """Return how often the present parameters stay inside while they drift."""
    began, rows = time.perf_counter(), []
    with ProcessPoolExecutor(2) as pool:
        results = list(pool.map(follows, range(RUNS), chunksize=5))
    for which, (title, *_) in enumerate(DRIFTS):
        own = [result for result in results if result[0] == which]
        rows.append(
            [
                title,
                f"{sum(inside for _, inside, *_ in own)} of {len(own)}",
                str(sum(changed for _, _, changed, *_ in own)),
                f"{np.median([width for *_, width, _ in own]):.2g}",
                f"{np.mean([share for *_, share in own]) / SAMPLES:.0%}",
            ]
        )
    head = [
        "plant",
        "present parameters inside at every sample",
        "runs with a false proof of a change",
        "width of a1, median",
        "samples inside without a drift bound",
    ]
    return section(f"Slow drift, {RUNS} runs of {SAMPLES} samples", head, rows, began)
