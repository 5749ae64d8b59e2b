"""Simulated plants whose parameters are known, and their noise."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.signal import lfilter

from relaxations.algebra.arrays import Array
from smid.recursive import Arx
from smid.recursive.set_membership import RecursiveSet

INSIDE = 1 - 1e-12
"""Share of the bound that the noise keeps to: the simulated output is rounded, so the truth is true up to that only."""
REACH = 20.0
"""First box of each numerator coefficient, both ways; the plants' are within 2."""


@dataclass(frozen=True, eq=False)
class Record:
    """A simulated record, and the parameters behind it: constant, or one row for each sample."""

    arx: Arx
    truth: Array
    u: Array
    y: Array
    noise_bound: float
    error: str = "output"

    @property
    def bounds(self) -> dict[str, tuple[float, float]]:
        """First box of the numerator."""
        return {name: (-REACH, REACH) for name in self.arx.names if name.startswith("b")}

    def estimator(self, **options: Any) -> RecursiveSet:
        """Return a set that has seen nothing."""
        return RecursiveSet(self.arx, self.noise_bound, self.bounds, error=self.error, **options)


def poles_of(generator: np.random.Generator, count: int) -> Array:
    """Draw poles: real ones, or one complex pair among them."""
    real = generator.uniform(-0.5, 0.95, count).astype(complex)
    if count >= 2 and generator.random() < 0.5:
        pole = generator.uniform(0.3, 0.9) * np.exp(1j * generator.uniform(0.2, 2.0))
        real[:2] = pole, np.conj(pole)
    return np.asarray(np.poly(real).real[1:])


def noise_of(generator: np.random.Generator, n: int, kind: str) -> Array:
    """Draw noise within one."""
    if kind == "uniform":
        return generator.uniform(-1, 1, n) * INSIDE
    held = 1 if kind == "extreme" else 25
    return np.repeat(generator.choice([-1.0, 1.0], -(-n // held)), held)[:n] * INSIDE


def record(seed: int, na: int, nb: int, n: int, error: str = "output", kind: str = "uniform") -> Record:
    """Simulate a random plant; the noise is 1 to 10 % of the output's largest magnitude."""
    generator = np.random.default_rng(seed)
    a, b = poles_of(generator, na), generator.uniform(-1, 1, nb + 1) + 1.0
    u = np.repeat(generator.choice([-1.0, 1.0], n), int(generator.integers(1, 4)))[:n]
    numerator, denominator = np.append(0.0, b), np.append(1.0, a)
    w = lfilter(numerator, denominator, u)
    bound = float(generator.uniform(0.01, 0.1) * np.abs(w).max())
    noise = bound * noise_of(generator, n, kind)
    y = w + noise if error == "output" else w + lfilter([1.0], denominator, noise)
    return Record(Arx(na, nb), np.concatenate([a, b]), u, y, bound, error)


def plant_record(a: Array, b: Array, n: int, seed: int = 0, error: str = "output") -> Record:
    """Simulate a plant with 3 % of noise."""
    generator = np.random.default_rng(seed)
    u = generator.choice([-1.0, 1.0], n)
    w = lfilter(np.append(0.0, b), np.append(1.0, a), u)
    bound = 0.03 * float(np.abs(w).max())
    noise = bound * noise_of(generator, n, "uniform")
    y = w + noise if error == "output" else w + lfilter([1.0], np.append(1.0, a), noise)
    return Record(Arx(len(a), len(b) - 1), np.concatenate([a, b]), u, y, bound, error)
