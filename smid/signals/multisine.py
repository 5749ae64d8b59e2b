"""A multisine: sines of equal amplitude at chosen harmonics, with random phases.

The record is one period, so the spectrum is flat at the chosen harmonics and zero elsewhere. Random phases keep the
peaks low: the range grows with the square root of the number of sines.

Reference: Pintelon, Schoukens, "System Identification: A Frequency Domain Approach", section 5.3.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data import DataError
from smid.signals.generators import Seed, check_samples, generator

__all__ = ["multisine"]


def multisine(
    n: int,
    *,
    seed: Seed,
    lines: Sequence[int] = tuple(range(1, 11)),
    amplitude: float = 1.0,
    offset: float = 0.0,
) -> Array:
    """Return one period of a sum of sines with random phases, shape (n,).

    Parameters
    ----------
    lines
        Frequencies in periods per record, from 1 to below n/2.
    amplitude
        Largest deviation from the offset, in the input's unit.
    offset
        The mean, in the input's unit.

    Raises
    ------
    DataError
        If there is no frequency, or one is out of range.

    Examples
    --------
    >>> u = multisine(64, seed=1, lines=(1, 3))
    >>> np.flatnonzero(np.abs(np.fft.rfft(u)) > 1e-9)
    array([1, 3])
    """
    check_samples(n)
    harmonics = np.array(sorted(set(lines)))
    if not harmonics.size or harmonics[0] < 1 or 2 * harmonics[-1] >= n:
        raise DataError(f"lines = {tuple(lines)} do not fit {n} samples: give numbers from 1 to {(n - 1) // 2}")
    phases = generator(seed).uniform(0, 2 * np.pi, harmonics.size)
    total = np.sin(2 * np.pi * np.outer(np.arange(n), harmonics) / n + phases).sum(axis=1)
    return np.asarray(offset + amplitude * total / np.abs(total).max())
