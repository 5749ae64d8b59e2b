"""Seeded random problems in which a noise passes a curve, or multiplies another noise, with a known truth."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import sympy

from benchmarks.soundness.random_problems import RandomProblem
from smid import Dataset, Hammerstein, Model, Parameter, Wiener
from smid.models import Line, Measurement, signal, t
from smid.models.symbols import VALUE

BOX = 3.0
SHARE = 0.05  # largest noise bound over the size of a signal
SLOPE = 0.86  # least slope of a sensor curve, over all of the box of its parameters
CURVE = {"s2": (-0.2, 0.2), "s3": (0.1, 0.5)}


def curve_problem(
    seed: int, kind: str | None = None, n_samples: int | None = None, inside: bool = False
) -> RandomProblem:
    """Draw a problem; its length, parameters, input and noises all come from the seed.

    Noise is uniform, or sits on its bound, where a long record determines the parameters; ``inside`` it is uniform.
    """
    rng = np.random.default_rng([seed, 4])
    kind = kind or KINDS[seed % len(KINDS)]
    return _MAKERS[kind](rng, n_samples or int(rng.integers(8, 15)), inside)


def farthest(problem: RandomProblem, at: int) -> float:
    """Return a size that no output of this sample has for any parameters in their boxes."""
    y, bounds = problem.data.values("y"), problem.noise_bound
    top = float(np.abs(problem.data.values("u")).max()) + bounds.get("u", 0.0)
    past = abs(y[at - 1]) + bounds["y"]
    if problem.kind == "lpv, noisy schedule":
        rho = float(np.abs(problem.data.values("r")).max()) + bounds["r"]
        return (1 + rho) * (past + BOX * top) + bounds["y"]
    if problem.kind == "hammerstein, noisy input":
        return past + 2 * BOX * (top + top**2) + bounds["y"]
    before = past + CURVE["s2"][1] * past**2 + CURVE["s3"][1] * past**3
    gain = BOX * (top + top**3) if problem.kind == "hammerstein-wiener" else BOX * top
    return (before + gain) / SLOPE + bounds["y"]


def _recursion(pole: np.ndarray | float, added: np.ndarray) -> np.ndarray:
    """Return ``w_t = pole_{t-1} w_{t-1} + added_{t-1}`` from zero."""
    w = np.zeros(len(added))
    for k, own in enumerate(np.broadcast_to(pole, len(w))[:-1]):
        w[k + 1] = own * w[k] + added[k]
    return w


def _noisy(rng: np.random.Generator, values: np.ndarray, inside: bool) -> tuple[np.ndarray, float]:
    """Return measured values and a noise bound."""
    bound = float(rng.uniform(0.1, 1) * SHARE * max(np.abs(values).max(), 0.1))
    n = len(values)
    noise = rng.uniform(-1, 1, n) if inside or rng.random() < 0.5 else (1 - 1e-9) * rng.choice([-1.0, 1.0], n)
    return values + bound * noise, bound


def _behind(x: np.ndarray, s2: float, s3: float) -> np.ndarray:
    """Return the z with ``z + s2 z^2 + s3 z^3 = x``."""
    roots = (np.roots([s3, s2, 1.0, -value]) for value in x)
    return np.array([float(r[np.argmin(np.abs(r.imag))].real) for r in roots])


def _sensor(rng: np.random.Generator) -> dict[str, float]:
    return {name: float(rng.uniform(*box)) for name, box in CURVE.items()}


def _problem(
    kind: str, model: Model, truth: dict[str, float], measured: dict[str, tuple[np.ndarray, float | None]]
) -> RandomProblem:
    inputs = {name: values for name, (values, _) in measured.items() if name != "y"}
    data = Dataset.from_arrays(input=inputs, output={"y": measured["y"][0]}, sampling_time=1.0)
    bounds = {name: bound for name, (_, bound) in measured.items() if bound is not None}
    return RandomProblem(kind, model, data, bounds, truth)


def _wiener(rng: np.random.Generator, n: int, inside: bool) -> RandomProblem:
    u, pole, gain, curve = rng.uniform(-1, 1, n), rng.uniform(-0.5, 0.9), rng.uniform(0.5, 2), _sensor(rng)
    z = _behind(_recursion(pole, gain * u), **curve)
    model = Wiener(1, (2, 3), stable=True, bounds={"beta": (-BOX, BOX), **CURVE})
    return _problem(
        "wiener", model, {"alpha": -pole, "beta": gain, **curve}, {"u": (u, None), "y": _noisy(rng, z, inside)}
    )


def _hammerstein(rng: np.random.Generator, n: int, inside: bool) -> RandomProblem:
    u, pole = rng.uniform(-1, 1, n), float(rng.uniform(-0.5, 0.9))
    gammas = {"gamma1": float(rng.uniform(0.5, 1.5)), "gamma2": float(rng.uniform(-1.5, 1.5))}  # may turn inside
    w = _recursion(pole, (1 - pole) * (gammas["gamma1"] * u + gammas["gamma2"] * u**2))
    boxes = dict.fromkeys(gammas, (-BOX, BOX))
    model = Hammerstein(1, (1, 2), stable=True, input_noise=True, bounds=boxes)
    measured = {"u": _noisy(rng, u, inside), "y": _noisy(rng, w, inside)}
    return _problem("hammerstein, noisy input", model, {"alpha": -pole, **gammas}, measured)


def _hammerstein_wiener(rng: np.random.Generator, n: int, inside: bool) -> RandomProblem:
    u, pole, curve = rng.uniform(-1, 1, n), float(rng.uniform(-0.5, 0.9)), _sensor(rng)
    gains = {"c1": float(rng.uniform(0.5, 1.5)), "c3": float(rng.uniform(-0.5, 1.5))}
    z = _behind(_recursion(pole, gains["c1"] * u + gains["c3"] * u**3), **curve)
    boxes = {"a": (-1.0, 1.0), "c1": (-BOX, BOX), "c3": (-BOX, BOX), **CURVE}
    parameters = {name: Parameter(name, *box) for name, box in boxes.items()}
    a, c1, c3, s2, s3 = (p.symbol for p in parameters.values())
    x, w, source = signal("x"), signal("w"), signal("u")
    lines = (Line(x[t], c1 * source[t] + c3 * source[t] ** 3), Line(w[t], -a * w[t - 1] + x[t - 1]))
    inverse: sympy.Expr = VALUE + s2 * VALUE**2 + s3 * VALUE**3
    model = Model("Hammerstein-Wiener", tuple(parameters.values()), lines, (Measurement("y", "w", "eta", inverse),))
    measured = {"u": _noisy(rng, u, inside), "y": _noisy(rng, z, inside)}
    return _problem("hammerstein-wiener", model.with_input_noise("u"), {"a": -pole, **gains, **curve}, measured)


def _lpv(rng: np.random.Generator, n: int, inside: bool) -> RandomProblem:
    u, rho = rng.uniform(-1, 1, n), 0.7 * np.sin(np.arange(n) * rng.uniform(0.1, 1)) + rng.uniform(-0.2, 0.2, n)
    truth = {"a0": float(rng.uniform(-0.7, 0.3)), "a1": float(rng.uniform(-0.25, 0.25))}
    truth |= {"b0": float(rng.uniform(0.5, 1.5)), "b1": float(rng.uniform(-1, 1))}
    w = _recursion(-(truth["a0"] + truth["a1"] * rho), (truth["b0"] + truth["b1"] * rho) * u)
    boxes = {"a0": (-1.0, 1.0), "a1": (-1.0, 1.0), "b0": (-BOX, BOX), "b1": (-BOX, BOX)}
    parameters = {name: Parameter(name, *box) for name, box in boxes.items()}
    a0, a1, b0, b1 = (p.symbol for p in parameters.values())
    y, r, source = signal("w"), signal("r"), signal("u")
    line = Line(y[t], -(a0 + a1 * r[t - 1]) * y[t - 1] + (b0 + b1 * r[t - 1]) * source[t - 1])
    model = Model("LPV", tuple(parameters.values()), (line,), (Measurement("y", "w", "eta"),)).with_input_noise("r")
    measured = {"u": (u, None), "r": _noisy(rng, rho, inside), "y": _noisy(rng, w, inside)}
    return _problem("lpv, noisy schedule", model, truth, measured)


_MAKERS: dict[str, Callable[[np.random.Generator, int, bool], RandomProblem]] = {
    "wiener": _wiener,
    "hammerstein, noisy input": _hammerstein,
    "hammerstein-wiener": _hammerstein_wiener,
    "lpv, noisy schedule": _lpv,
}
KINDS = tuple(_MAKERS)
