"""Helpers of all signals: the random generator, and checks of the number of samples and of durations."""

from __future__ import annotations

import numpy as np

from smid.data import DataError

__all__ = ["Seed", "check_samples", "clock_samples", "generator"]

Seed = int | np.random.Generator


def generator(seed: Seed) -> np.random.Generator:
    """Return the generator itself, or a new one with this seed."""
    return seed if isinstance(seed, np.random.Generator) else np.random.default_rng(seed)


def check_samples(n: int, sampling_time: float = 1.0) -> None:
    """Raise a `DataError` if the number of samples or the sampling time is not positive."""
    if isinstance(n, bool) or not isinstance(n, int | np.integer) or n < 1:
        raise DataError(f"n = {n!r} is not a number of samples: give a whole number of at least 1")
    if not (np.isfinite(sampling_time) and sampling_time > 0):
        raise DataError(f"sampling_time = {sampling_time} is refused: give a positive number of seconds")


def clock_samples(period: float, sampling_time: float, what: str) -> int:
    """Return a duration in samples; raise a `DataError` if it is not close to a whole number of at least 1."""
    samples = period / sampling_time
    whole = round(samples) if np.isfinite(samples) else 0
    if whole < 1 or abs(samples - whole) > 1e-6 * samples:
        raise DataError(
            f"{what} = {period:g} s is not a whole number of samples of {sampling_time:g} s: give a multiple of it"
        )
    return whole
