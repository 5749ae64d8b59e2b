"""A periodic staircase over the range of the input, which shows the static curve.

Reference: hybrid thesis, section 2.4.2 and listing K.1: steps of 20 samples, 0.2 apart.
"""

from __future__ import annotations

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data import DataError
from smid.signals.generators import check_samples, clock_samples

__all__ = ["staircase"]


def staircase(
    n: int,
    *,
    sampling_time: float = 1.0,
    period: float = 20.0,
    steps: int = 5,
    amplitude: float = 1.0,
    offset: float = 0.0,
) -> Array:
    """Return a staircase, shape (n,), that starts at the offset and goes up first.

    Parameters
    ----------
    period
        Length of a step in seconds, a multiple of the sampling time; long enough for the plant to settle.
    steps
        Levels between the offset and the top: there are ``2 steps + 1`` levels.
    amplitude, offset
        Half the range, and its centre, in the input's unit.

    Raises
    ------
    DataError
        If the period is not a multiple of the sampling time, or there is no level.

    Examples
    --------
    >>> staircase(8, period=1, steps=2)
    array([ 0. ,  0.5,  1. ,  0.5,  0. , -0.5, -1. , -0.5])
    """
    check_samples(n, sampling_time)
    if steps < 1:
        raise DataError(f"steps = {steps} leave no level: give at least 1")
    stair = np.arange(n) // clock_samples(period, sampling_time, "period")
    place = (stair + steps) % (4 * steps)
    level = steps - np.abs(place - 2 * steps)
    return offset + amplitude * level / steps
