"""Seeded records of any length whose true parameters are known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from smid import Dataset, ErrorsInVariables, Hammerstein, Model, OutputError
from smid.signals import ramp

SCALE = 0.01  # 1/mA, of the clutch's current
CLUTCH = (-0.65142, -0.00272, 0.03903, -0.08172)
"""Pole and gammas of the clutch thesis's model, (3.14)."""


@dataclass(frozen=True)
class Known:
    """A model, a record of it, the bounds of its noise, and the true parameters in the model's order."""

    name: str
    model: Model
    data: Dataset
    noise_bound: dict[str, float]
    truth: tuple[float, ...]


def _held(rng: np.random.Generator, n_samples: int) -> np.ndarray:
    return np.repeat(rng.uniform(-1, 1, n_samples), 3)[:n_samples]


def output_error(n_samples: int, seed: int = 0) -> Known:
    """Make a record of ``w[t] = 0.8 w[t-1] + 0.5 u[t-1]``, noise within 0.05."""
    rng = np.random.default_rng(seed)
    u = _held(rng, n_samples)
    w = lfilter([0.0, 0.5], [1.0, -0.8], u)
    data = _dataset(u, w + rng.uniform(-0.05, 0.05, n_samples))
    return Known("output error, one pole", OutputError(1, 0, stable=True), data, {"y": 0.05}, (-0.8, 0.5))


def hammerstein(n_samples: int, seed: int = 0) -> Known:
    """Make a record of the clutch thesis's model (3.5), (3.14): repeated ramps of current, 0.3 bar of noise."""
    rng = np.random.default_rng(seed)
    pole, *gammas = CLUTCH
    u = np.resize(ramp(min(600, n_samples), amplitude=620.0, offset=200.0), n_samples)
    v = SCALE * u
    w = lfilter([0.0, 1 + pole], [1.0, pole], np.polyval([*gammas, 0, 0, 0], v))
    data = _dataset(u, w + rng.uniform(-0.3, 0.3, n_samples))
    model = Hammerstein(poles=1, powers=(5, 4, 3), input_scale=SCALE, stable=True)
    return Known("Hammerstein of the clutch", model, data, {"y": 0.3}, CLUTCH)


def errors_in_variables(n_samples: int, poles: int = 2, seed: int = 0) -> Known:
    """Make a record of a plant with two poles (or one), both channels with noise within 0.05."""
    rng = np.random.default_rng(seed)
    a, b = ((-1.2, 0.5), (0.8, 0.4)) if poles == 2 else ((-0.9,), (0.5, -0.1))
    u = _held(rng, n_samples)
    w = lfilter(b, [1.0, *a], u)
    noise = rng.uniform(-0.05, 0.05, (2, n_samples))
    data = _dataset(u + noise[0], w + noise[1])
    name = f"errors in variables, na = {len(a)}, nb = 1"
    return Known(name, ErrorsInVariables(len(a), 1, stable=True), data, {"u": 0.05, "y": 0.05}, (*a, *b))


def _dataset(u: np.ndarray, y: np.ndarray) -> Dataset:
    return Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
