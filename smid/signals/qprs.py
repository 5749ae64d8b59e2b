"""The quantised pseudo-random signal: random levels, each held for a random number of samples.

A random `prbs` has two levels; `qprts` is a sum of three such signals of three levels each.
Reference: hybrid thesis, section 2.4.2.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data import DataError
from smid.signals.generators import Seed, check_samples, clock_samples, generator

__all__ = ["qprs"]


def qprs(
    n: int,
    *,
    seed: Seed,
    levels: Sequence[float] = (-1.0, 0.0, 1.0),
    sampling_time: float = 1.0,
    periods: Sequence[float] = (1.0,),
    offset: float = 0.0,
) -> Array:
    """Return a signal, shape (n,), whose levels and stair lengths are drawn with equal probability.

    Parameters
    ----------
    levels
        In the input's unit.
    periods
        Lengths of a stair in seconds, multiples of the sampling time; one length gives a regular clock.
    offset
        Added to all samples, in the input's unit.

    Raises
    ------
    DataError
        If there are no levels or no lengths, or a length is not a multiple of the sampling time.

    Examples
    --------
    >>> u = qprs(40, seed=1, levels=(0, 2, 3), periods=(4.0, 8.0))
    >>> sorted(set(u.tolist())), bool((np.flatnonzero(np.diff(u)) % 4 == 3).all())
    ([0.0, 2.0, 3.0], True)
    """
    check_samples(n, sampling_time)
    choices = np.asarray(levels, dtype=np.float64)
    if choices.ndim != 1 or not choices.size or not np.isfinite(choices).all() or not len(periods):
        raise DataError(f"levels = {tuple(levels)}, periods = {tuple(periods)}: give at least one finite one of each")
    held = np.array([clock_samples(period, sampling_time, "a period") for period in periods])
    random = generator(seed)
    stairs = -(-n // int(held.min()))
    lengths = held[random.integers(0, held.size, stairs)]
    return np.asarray(offset + np.repeat(random.choice(choices, stairs), lengths)[:n])
