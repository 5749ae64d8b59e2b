"""Stamping a template over N samples with NumPy, beside sympy once per sample."""

from __future__ import annotations

import time

import numpy as np
import sympy

from smid import Dataset, FeasibleSet, Hammerstein

SAMPLES, RIVAL_SAMPLES = 5000, 50


def run() -> str:
    """Return the comparison as Markdown."""
    rng = np.random.default_rng(0)
    data = Dataset.from_arrays(
        input={"u": rng.uniform(0, 900, SAMPLES)}, output={"y": rng.uniform(0, 30, SAMPLES)}, sampling_time=2e-3
    )
    model = Hammerstein(poles=1, powers=(5, 4, 3), input_scale=0.01, stable=True)
    started = time.perf_counter()
    feasible = FeasibleSet(model, data, 0.3)
    ours = time.perf_counter() - started

    alpha, g1, g2, g3, now, before = sympy.symbols("alpha g1 g2 g3 now before")
    u, y = data.experiments[0].values["u"], data.experiments[0].values["y"]
    started = time.perf_counter()
    for k in range(1, RIVAL_SAMPLES + 1):
        v = sympy.Float(0.01) * u[k - 1]
        x = g1 * v**5 + g2 * v**4 + g3 * v**3
        sympy.Poly(
            sympy.expand(y[k] - now + alpha * (y[k - 1] - before) - (1 + alpha) * x), alpha, g1, g2, g3, now, before
        )
    theirs = (time.perf_counter() - started) / RIVAL_SAMPLES * SAMPLES
    return (
        f"## Building the feasible set, N = {SAMPLES}\n\n"
        f"smid {ours:.3f} s ({feasible.n_equalities} equalities); sympy once per sample {theirs:.1f} s "
        f"(extrapolated from {RIVAL_SAMPLES} samples); sympy / smid = {theirs / ours:.0f}."
    )
