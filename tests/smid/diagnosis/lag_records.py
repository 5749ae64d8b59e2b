"""Records of a first-order lag with something hidden in it, simulated by hand."""

import numpy as np
from scipy.optimize import linprog
from scipy.signal import lfilter

from smid import Dataset, Model, OutputError

POLE, GAIN, BOUND = 0.8, 0.5, 0.02
LAG = OutputError(stable=True)


def known_lag() -> Model:
    """The lag with its values, none of them free."""
    return OutputError(fixed={"a1": -POLE, "b0": GAIN})


def lag(v: np.ndarray, pole: float = POLE) -> np.ndarray:
    """w[t] = pole w[t-1] + GAIN v[t-1], from rest."""
    return lfilter([0.0, GAIN], [1.0, -pole], v)


def steps(seed: int, n: int = 300, hold: int = 6, low: float = -1.0) -> np.ndarray:
    return np.repeat(np.random.default_rng(seed).uniform(low, 1, -(-n // hold)), hold)[:n]


def dead_zone(u: np.ndarray, d: float) -> np.ndarray:
    return np.sign(u) * np.maximum(np.abs(u) - d, 0)


def late(u: np.ndarray, samples: int) -> np.ndarray:
    return np.concatenate([np.zeros(samples), u[:-samples]])


def record(
    u: np.ndarray, w: np.ndarray, seed: int = 0, bound: float = BOUND, name: str = "run", **others: np.ndarray
) -> Dataset:
    """Add noise within the bound to the output."""
    noise = np.random.default_rng([seed, 1]).uniform(-bound, bound, len(w))
    return Dataset.from_arrays(
        input={"u": u}, output={"y": w + noise}, sampling_time=0.1, units={"u": "V", "y": "bar"}, name=name, **others
    )


def autoregressive(random: np.random.Generator, n: int, pole: float) -> np.ndarray:
    """x[t] = pole x[t-1] + e[t] with white e of variance one, from its stationary state."""
    return lfilter([1.0], [1.0, -pole], random.standard_normal(n + 500))[500:]


def least_bound(u: np.ndarray, y: np.ndarray, pole: float) -> float:
    """Return the least noise bound at a fixed pole: a linear program in the gain and the first state."""
    g = np.zeros((len(u), 2))
    g[0, 1] = 1.0
    for k in range(1, len(u)):
        g[k] = pole * g[k - 1]
        g[k, 0] += u[k - 1]
    one = np.ones((len(u), 1))
    program = np.block([[g, -one], [-g, -one]]), np.r_[y, -y]
    return float(linprog([0, 0, 1], *program, bounds=[(None, None), (None, None), (0, None)]).fun)
