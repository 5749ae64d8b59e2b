"""The quantised pseudo-random trinary signal: a sum of three random staircases of three levels each.

The long stairs show the static curve, the short ones the dynamics. Reference: hybrid thesis, section 2.4.2 and listing
K.1: stairs of 20, 5 and 1 s, with levels 0.2, 0.1 and 0.05 apart, around 0.5.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data import DataError
from smid.signals.generators import Seed, check_samples, clock_samples, generator

__all__ = ["qprts"]


def qprts(
    n: int,
    *,
    seed: Seed,
    sampling_time: float = 1.0,
    periods: Sequence[float] = (20.0, 5.0, 1.0),
    spacings: Sequence[float] = (0.2, 0.1, 0.05),
    offset: float = 0.5,
) -> Array:
    """Return a sum of random staircases, shape (n,), with levels -spacing, 0 and +spacing of equal probability.

    Parameters
    ----------
    periods
        Length of the stairs of each staircase, in seconds.
    spacings
        Distance of the levels of each staircase, in the input's unit.
    offset
        The middle level, in the input's unit.

    Raises
    ------
    DataError
        If periods and spacings differ in number, or a period is not a multiple of the sampling time.

    Examples
    --------
    >>> u = qprts(500, seed=1)
    >>> len(np.unique(u.round(9))), bool((abs(u - 0.5) < 0.351).all())
    (15, True)
    """
    check_samples(n, sampling_time)
    if len(periods) != len(spacings) or not periods:
        raise DataError(f"{len(periods)} periods and {len(spacings)} spacings: give one spacing per period")
    random = generator(seed)
    total = np.full(n, float(offset))
    for period, spacing in zip(periods, spacings, strict=True):
        held = clock_samples(period, sampling_time, "a period")
        total += spacing * np.repeat(random.integers(-1, 2, -(-n // held)), held)[:n]
    return total
