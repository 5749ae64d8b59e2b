"""One update of a recursive estimator, beside padasip's RLS and filterpy's Kalman filter on the same samples.

    python -m benchmarks.recursive

smid's figure is for ``update(u, y)``: it builds the regressors, checks the sample, keeps the history and applies the
stability rule.  The rivals are given the regressors, ready-made, and keep no history; what smid needs for just that is
its correction.  All give the same parameters, and the table says how closely.  Runs alternate, and the fastest of each
counts: the rest is other load.

Last, a constant input without end: what becomes of the covariance where the data say nothing.
"""

from __future__ import annotations

import os

from relaxations.algebra.arrays import Array

# Before NumPy is imported: matrices this small gain nothing from threads, and threads make timings useless.
os.environ["OMP_NUM_THREADS"] = "1"
os.environ["OPENBLAS_NUM_THREADS"] = "1"
os.environ["MKL_NUM_THREADS"] = "1"

import time
from collections.abc import Callable, Sequence

import numpy as np

from smid.recursive import Arx, ForgettingFactor, KalmanFilter, Method, RecursiveEstimator, free_run
from smid.signals import noise

try:
    from filterpy.kalman import KalmanFilter as Filterpy
    from padasip.filters import FilterRLS
except ImportError as missing:
    raise SystemExit(f"no {missing.name}; install the rivals with: pip install padasip filterpy") from None

Run = Callable[[], Array]

REPEATS = 7
SAMPLES, CALM = 4000, 200_000
FACTOR, SPREAD = 0.995, 1000.0
DRIFT, NOISE = 0.01, 0.1
PLANTS = (
    (Arx(), (-0.8, 0.5)),
    (Arx(powers=(5, 4, 3)), (-0.8, 0.3, -0.5, 1.0)),
    (Arx(na=3, nb=2), (-1.1, 0.6, -0.2, 1.0, 0.5, 0.3)),
    (Arx(na=6, nb=5), (-1.1, 0.6, -0.2, 0.1, 0.05, -0.02, 1.0, 0.5, 0.3, -0.2, 0.1, 0.4)),
)


def smid_run(arx: Arx, method: Method, u: Sequence[float], y: Sequence[float]) -> Array:
    estimator = RecursiveEstimator(arx, method)
    for sample in zip(u, y, strict=True):
        estimator.update(*sample)
    return estimator.parameters


def correction_run(method: Method, regressors: Array, outputs: Sequence[float]) -> Array:
    theta, memory = np.zeros(regressors.shape[1]), method.start(regressors.shape[1])
    for phi, y in zip(regressors, outputs, strict=True):
        gain, memory = method.correct(memory, phi)
        theta = theta + gain * (y - phi.dot(theta))
    return theta


def padasip_run(regressors: Array, outputs: Sequence[float]) -> Array:
    rival = FilterRLS(regressors.shape[1], mu=FACTOR, eps=1 / SPREAD**2, w="zeros")
    for phi, y in zip(regressors, outputs, strict=True):
        rival.adapt(y, phi)
    return np.array(rival.w)


def filterpy_run(regressors: Array, outputs: Sequence[float]) -> Array:
    n = regressors.shape[1]
    rival = Filterpy(dim_x=n, dim_z=1)
    rival.F, rival.P, rival.Q, rival.R = np.eye(n), SPREAD**2 * np.eye(n), DRIFT**2 * np.eye(n), np.array([[NOISE**2]])
    for phi, y in zip(regressors, outputs, strict=True):
        rival.update(np.array([[y]]), H=phi[None, :])
        rival.predict()
    return np.asarray(rival.x[:, 0])


def fastest(runs: Sequence[Run]) -> list[float]:
    """Return the least time of each run, in microseconds per sample; they take turns."""
    least = [np.inf] * len(runs)
    for _ in range(REPEATS):
        for k, run in enumerate(runs):
            began = time.perf_counter()
            run()
            least[k] = min(least[k], (time.perf_counter() - began) / SAMPLES * 1e6)
    return least


def record(arx: Arx, parameters: Sequence[float]) -> tuple[Array, Array]:
    """Return input and output of a plant of that structure, with noise on the output."""
    u = noise(SAMPLES, seed=1, amplitude=1.5)
    return u, free_run(arx, parameters, u, np.zeros(SAMPLES)).output + noise(SAMPLES, seed=2, amplitude=NOISE)


def rows(arx: Arx, u: Array, y: Array) -> list[str]:
    """Return the lines of one model."""
    regressors, later = arx.matrix(u, y), y[arx.max_lag :].tolist()
    inputs, outputs = u.tolist(), y.tolist()
    methods: list[tuple[Method, str, Run]] = [
        (ForgettingFactor(FACTOR, spread=SPREAD), "padasip RLS", lambda: padasip_run(regressors, later)),
        (KalmanFilter(DRIFT, NOISE, spread=SPREAD), "filterpy KalmanFilter", lambda: filterpy_run(regressors, later)),
    ]
    lines = []
    for method, rival, theirs in methods:

        def ours(method: Method = method) -> Array:
            return smid_run(arx, method, inputs, outputs)

        def bare(method: Method = method) -> Array:
            return correction_run(method, regressors, later)

        mine, alone, others = fastest([ours, bare, theirs])
        apart = float(np.abs(ours() - theirs()).max() / np.abs(ours()).max())
        lines.append(
            f"| {arx} | {len(arx.names)} | {method} | {mine:.1f} | {alone:.1f} | {rival} | {others:.1f} "
            f"| {others / mine:.2f} | {others / alone:.2f} | {apart:.0e} |"
        )
    return lines


def run() -> str:
    """Return the comparison as Markdown."""
    lines = [
        f"## One update of a recursive estimator, {SAMPLES} samples",
        "",
        "| model | parameters | smid | update, us | correction, us | rival | us | rival / update | rival / correction "
        "| parameters apart |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for arx, parameters in PLANTS:
        lines += rows(arx, *record(arx, parameters))
    return "\n".join([*lines, "", wind_up()])


def wind_up() -> str:
    """Return what a constant input does to the covariance, as a sentence."""
    phi, method = np.ones(2), ForgettingFactor(FACTOR, spread=SPREAD)
    rival, memory = FilterRLS(2, mu=FACTOR, eps=1 / SPREAD**2, w="zeros"), method.start(2)
    with np.errstate(all="ignore"):
        for _ in range(CALM):
            rival.adapt(1.0, phi)
            _, memory = method.correct(memory, phi)
        theirs = float(np.abs(rival.R).max())
    mine = float(np.linalg.inv(memory.T @ memory).max())
    return (
        f"The largest entry of the covariance is {SPREAD**2:g} at the start. After {CALM} samples of a constant "
        f"input it is {mine:.3g} with smid and {theirs:.3g} with padasip."
    )


if __name__ == "__main__":
    print(run())
