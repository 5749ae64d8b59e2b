"""Seeded first-order problems with a piecewise effect, simulated by hand; the truth is known."""

from dataclasses import dataclass

import numpy as np
import sympy

from smid import Dataset, Model, OutputError, Parameter
from smid.models import Line, Measurement
from smid.models.symbols import signal, t

KINDS = ("dead zone", "two-sided dead zone", "saturation", "soft threshold", "delay", "coulomb", "gap and limit")


@dataclass(frozen=True)
class Piecewise:
    """A model, data that a member of it made, the noise bound, that member, its output without noise."""

    kind: str
    model: Model
    data: Dataset
    noise_bound: float
    truth: dict[str, float]
    clean: np.ndarray


def _positive(x: np.ndarray) -> np.ndarray:
    return 0.5 * (x + np.abs(x))


def held_to(u: np.ndarray, levels: int) -> np.ndarray:
    """Round an input within [-1, 1] to a few levels."""
    return (np.clip(np.floor(0.5 * (u + 1) * levels), 0, levels - 1) + 0.5) * 2 / levels - 1


def piecewise_problem(
    kind: str, seed: int, n: int, on_bound: bool = False, share: float = 0.04, levels: int = 0
) -> Piecewise:
    """Draw a problem; the noise bound is a ``share`` of the output's size. ``levels``: the input takes so many only."""
    rng = np.random.default_rng(seed)
    a, b = -float(rng.uniform(0.3, 0.85)), float(rng.uniform(0.7, 1.5) * rng.choice([-1, 1]))
    u = rng.uniform(-1, 1, n) if seed % 3 else np.repeat(rng.uniform(-1, 1, n), 3)[:n]
    if levels:
        u = held_to(u, levels)
    truth = {"a1": a, "b0": b}
    base = OutputError(1, 0, stable=True, bounds={"b0": (-3, 3)})
    threshold = float(rng.uniform(0.1, 0.5))
    force = np.zeros(n)
    v = u
    if kind == "dead zone":
        v = _positive(u - threshold)
        truth["d"], d = threshold, Parameter("d", 0, 1, null=0.0)
        model = base.insert_before("u", lambda x: sympy.Max(0, x - d.symbol), parameters=[d])
    elif kind == "two-sided dead zone":
        other = float(rng.uniform(0.1, 0.5))
        v = _positive(u - threshold) - _positive(-u - other)
        truth |= {"d": threshold, "e": other}
        d, e = Parameter("d", 0, 1, null=0.0), Parameter("e", 0, 1, null=0.0)
        model = base.insert_before(
            "u", lambda x: sympy.Max(0, x - d.symbol) + sympy.Min(0, x + e.symbol), parameters=[d, e]
        )
    elif kind == "saturation":
        threshold = 1 - threshold
        v = np.clip(u, -threshold, threshold)
        truth["s"], s = threshold, Parameter("s", 0.1, 1)
        model = base.insert_before("u", lambda x: sympy.Max(-s.symbol, sympy.Min(x, s.symbol)), parameters=[s])
    elif kind == "gap and limit":
        limit = float(rng.uniform(0.3, 0.6))
        v = np.minimum(_positive(np.abs(u) - threshold) * np.sign(u), limit)
        truth |= {"d": threshold, "s": limit}
        d, s = Parameter("d", 0, 1), Parameter("s", 0.1, 1)

        def shape(x: sympy.Expr) -> sympy.Expr:
            return sympy.Min(s.symbol, x - (sympy.Abs(x + d.symbol) - sympy.Abs(x - d.symbol)) / 2)

        model = base.insert_before("u", shape, parameters=[d, s])
    elif kind == "delay":
        late = float(rng.uniform(0.2, 2.8))
        whole = int(late)
        padded = np.concatenate([np.zeros(3), u])
        v = (1 - late + whole) * padded[3 - whole : 3 - whole + n] + (late - whole) * padded[2 - whole : 2 - whole + n]
        truth["tau"], tau = late, Parameter("tau", 0, 3)
        model = base.insert_before(
            "u",
            lambda x: sum(sympy.Max(0, 1 - sympy.Abs(tau.symbol - k)) * x.xreplace({t: t - k}) for k in range(4)),
            parameters=[tau],
        )
    else:
        w, x = signal("w"), signal("u")
        size = 0.3 * threshold * abs(b)
        alpha, beta = Parameter("a1", -1, 1), Parameter("b0", -3, 3)
        F = Parameter("F", 0, 1, null=0.0)
        free = -alpha.symbol * w[t - 1] + beta.symbol * x[t - 1]
        truth["F"] = size
        if kind == "coulomb":
            lines = (Line(w[t], free - F.symbol * sympy.sign(w[t - 1])),)
        else:
            raw = signal("raw")
            lines = (Line(raw[t], free), Line(w[t], raw[t] - sympy.Max(-F.symbol, sympy.Min(F.symbol, raw[t]))))
        model = Model(kind, (alpha, beta, F), lines, (Measurement("y", "w", "eta"),))
        force[:] = size
    w = np.zeros(n)
    w[0] = float(rng.uniform(-0.5, 0.5))
    for k in range(1, n):
        w[k] = -a * w[k - 1] + b * v[k - 1]
        if kind == "coulomb":
            w[k] -= force[k] * np.sign(w[k - 1])
        elif kind == "soft threshold":
            w[k] = np.sign(w[k]) * max(abs(w[k]) - force[k], 0.0)
    bound = share * max(float(np.std(w)), 0.02)
    noise = bound * (1 - 1e-9) * rng.choice([-1.0, 1.0], n) if on_bound else rng.uniform(-bound, bound, n)
    data = Dataset.from_arrays(input={"u": u}, output={"y": w + noise}, sampling_time=1.0)
    return Piecewise(kind, model, data, bound, truth, w)
