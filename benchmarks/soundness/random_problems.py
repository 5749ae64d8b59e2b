"""Seeded random identification problems whose true parameters are known."""

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from smid import Dataset, ErrorsInVariables, Hammerstein, Model, OutputError

KINDS = ("output error 1", "output error 2", "errors in variables", "hammerstein")


@dataclass(frozen=True)
class RandomProblem:
    """A model, data that a member of it made, the bounds of the noise in them, and that member."""

    kind: str
    model: Model
    data: Dataset
    noise_bound: dict[str, float]
    truth: dict[str, float]


def random_problem(seed: int, kind: str | None = None, n_samples: int | None = None) -> RandomProblem:
    """Draw a problem: the plant, its length, the input and the kind of noise all come from the seed."""
    rng = np.random.default_rng(seed)
    kind = kind or KINDS[seed % len(KINDS)]
    n = n_samples or int(rng.integers(15, 121))
    if kind == "errors in variables":
        n = min(n, 60)
    u = _input(rng, n)
    if kind == "output error 2":
        radius, angle = rng.uniform(0.3, 0.95), rng.uniform(0.1, 3.0)
        poles = [-2 * radius * np.cos(angle), radius**2]
        if rng.random() < 0.4:  # two real poles
            p, q = rng.uniform(-0.9, 0.9, 2)
            poles = [-(p + q), p * q]
    else:
        poles = [-rng.uniform(-0.5, 0.95)]
    gains = [float(rng.uniform(0.5, 2) * rng.choice([-1, 1]))]
    if kind == "output error 2":
        gains.append(float(rng.uniform(-1, 1)))
    truth = {f"a{k + 1}": float(a) for k, a in enumerate(poles)} | {f"b{k}": b for k, b in enumerate(gains)}
    x = u
    if kind == "hammerstein":
        gammas = [float(rng.uniform(-1, 1)), float(rng.uniform(0.5, 1.5))]
        x = gammas[0] * u**3 + gammas[1] * u
        gains = [1 + poles[0]]
        truth = {"alpha": float(poles[0]), "gamma1": gammas[0], "gamma2": gammas[1]}
    delay = 0 if kind == "errors in variables" else 1
    state = lfilter(gains, [1.0, *poles], x)
    w = state if delay == 0 else np.concatenate([[0.0], state[:-1]])
    w += float(rng.normal()) * lfilter([1.0], [1.0, *poles], np.eye(n)[0])  # an initial state that is not zero
    bound = float(rng.uniform(0.02, 0.2) * max(np.std(w), 0.1))
    y = w + _noise(rng, bound, n)
    measured, bounds = u, {"y": bound}
    if kind == "errors in variables":
        input_bound = float(rng.uniform(0.01, 0.08))
        measured = u + _noise(rng, input_bound, n)
        bounds["u"] = input_bound
    model = {
        "output error 1": lambda: OutputError(1, 0, stable=True),
        "output error 2": lambda: OutputError(2, 1, stable=True),
        "errors in variables": lambda: ErrorsInVariables(1, 0, stable=True),
        "hammerstein": lambda: Hammerstein(1, (3, 1), stable=True),
    }[kind]()
    data = Dataset.from_arrays(input={"u": measured}, output={"y": y}, sampling_time=1.0)
    return RandomProblem(kind, model, data, bounds, truth)


def _input(rng: np.random.Generator, n: int) -> np.ndarray:
    shape = rng.integers(3)
    if shape == 0:
        return rng.uniform(-1, 1, n)
    if shape == 1:  # held levels
        return np.repeat(rng.uniform(-1, 1, n), 4)[:n]
    return np.sin(np.arange(n) * rng.uniform(0.1, 0.6)) + 0.5 * np.sin(np.arange(n) * rng.uniform(0.7, 2.0))


def _noise(rng: np.random.Generator, bound: float, n: int) -> np.ndarray:
    """Uniform noise, or noise that sits on its bound: then the truth lies on the edge of the feasible set."""
    if rng.random() < 0.5:
        return rng.uniform(-bound, bound, n)
    return bound * (1 - 1e-9) * rng.choice([-1.0, 1.0], n)
