"""What the random signals share: one generator per call, and a checked number of samples."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from smid.data import DataError

__all__ = ["Array", "Seed", "check_samples", "clock_samples", "generator"]

Array = NDArray[np.float64]
Seed = int | np.random.Generator


def generator(seed: Seed) -> np.random.Generator:
    """Give the generator itself, or the one of that seed."""
    return seed if isinstance(seed, np.random.Generator) else np.random.default_rng(seed)


def check_samples(n: int, sampling_time: float = 1.0) -> None:
    """Refuse a number of samples or a sampling time that makes no record, with a `DataError`."""
    if isinstance(n, bool) or not isinstance(n, int | np.integer) or n < 1:
        raise DataError(f"n = {n!r} is no number of samples: give a whole number of at least 1")
    if not (np.isfinite(sampling_time) and sampling_time > 0):
        raise DataError(f"sampling_time = {sampling_time} is refused: give a positive number of seconds")


def clock_samples(period: float, sampling_time: float, what: str) -> int:
    """Give a duration in samples, at least one, with a `DataError` where it is not close to a whole number."""
    samples = period / sampling_time
    whole = round(samples) if np.isfinite(samples) else 0
    if whole < 1 or abs(samples - whole) > 1e-6 * samples:
        raise DataError(
            f"{what} = {period:g} s is no whole number of samples of {sampling_time:g} s: give a multiple of it"
        )
    return whole
