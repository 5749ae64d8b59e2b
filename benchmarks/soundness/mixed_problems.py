"""Seeded problems where a piecewise effect meets noise in its argument, a polynomial, or jumps; the truth is known."""

from __future__ import annotations

import numpy as np
import sympy

from benchmarks.soundness.piecewise_problems import Piecewise, held_to
from smid import Dataset, ErrorsInVariables, Hammerstein, OutputError, Parameter
from smid.models.symbols import signal, t

KINDS = ("errors in variables, dead zone", "hammerstein, hinge", "relay")
INPUT_SHARE = 0.03  # bound of the input's noise


def mixed_problem(
    kind: str, seed: int, n: int, on_bound: bool = False, share: float = 0.04, levels: int = 0
) -> Piecewise:
    """Draw a problem; see :func:`benchmarks.soundness.piecewise_problems.piecewise_problem`."""
    rng = np.random.default_rng(seed)
    a, b = -float(rng.uniform(0.3, 0.85)), float(rng.uniform(0.7, 1.5) * rng.choice([-1, 1]))
    u = rng.uniform(-1, 1, n)
    if levels:
        u = held_to(u, levels)
    threshold = float(rng.uniform(0.1, 0.5))
    d = Parameter("d", 0, 1, null=0.0)
    truth = {"a1": a, "b0": b, "d": threshold}
    gain, late = b, 1
    if kind == "relay":
        v = np.where(u > threshold, 1.0, -1.0)
        model = OutputError(1, 0, stable=True, bounds={"b0": (-3, 3)}).insert_before(
            "u", lambda x: sympy.sign(x - d.symbol), parameters=[d]
        )
    elif kind == "hammerstein, hinge":
        cubic, linear, slope = float(rng.uniform(-1, 1)), float(rng.uniform(0.5, 1.5)), float(rng.uniform(-1, 1))
        v = cubic * u**3 + linear * u + slope * np.maximum(0.0, u - threshold)
        gain = 1 + a
        truth = {"alpha": a, "gamma1": cubic, "gamma2": linear, "h": slope, "d": threshold}
        h = Parameter("h", -2, 2, null=0.0)
        base = Hammerstein(1, (3, 1), stable=True, bounds={"gamma1": (-3, 3), "gamma2": (-3, 3)})
        model = base.add_term("x", h.symbol * sympy.Max(0, signal("u")[t] - d.symbol), parameters=[h, d])
    else:
        v, late = np.maximum(0.0, u - threshold), 0
        model = ErrorsInVariables(1, 0, stable=True, bounds={"b0": (-3, 3)}).insert_before(
            "u", lambda x: sympy.Max(0, x - d.symbol), parameters=[d]
        )
    w = np.zeros(n)
    w[0] = float(rng.uniform(-0.5, 0.5))
    for k in range(1, n):
        w[k] = -a * w[k - 1] + gain * v[k - late]
    bound = share * max(float(np.std(w)), 0.02)

    def noise(size: float) -> np.ndarray:
        return size * (1 - 1e-9) * rng.choice([-1.0, 1.0], n) if on_bound else rng.uniform(-size, size, n)

    measured = u + noise(INPUT_SHARE) if late == 0 else u
    data = Dataset.from_arrays(input={"u": measured}, output={"y": w + noise(bound)}, sampling_time=1.0)
    return Piecewise(kind, model, data, bound, truth, w)
