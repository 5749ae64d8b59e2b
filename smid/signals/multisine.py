"""A multisine: sines of equal amplitude on a grid of frequencies, with random phases.

With n samples as one period every line of the grid is met exactly, so the spectrum is flat on the chosen lines and zero
elsewhere.  Random phases keep the peaks low: the range grows with the root of the number of sines.
Reference: Pintelon, Schoukens, "System Identification: A Frequency Domain Approach", section 5.3.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from smid.data import DataError
from smid.signals.generators import Array, Seed, check_samples, generator

__all__ = ["multisine"]


def multisine(
    n: int,
    *,
    seed: Seed,
    lines: Sequence[int] = tuple(range(1, 11)),
    amplitude: float = 1.0,
    offset: float = 0.0,
) -> Array:
    """Give a sum of sines with random phases, one period long.

    Parameters
    ----------
    n
        Number of samples, which is the period.
    seed
        Of the phases.
    lines
        Frequencies in periods per record, 1 to below n/2.
    amplitude
        Half the range, in the input's unit: the sum is scaled so that its largest deviation from the offset is this.
    offset
        The mean, in the input's unit.

    Returns
    -------
    ndarray, shape (n,)
        In the input's unit.

    Raises
    ------
    DataError
        If a line is out of reach, or there is none.

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
