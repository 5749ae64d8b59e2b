"""A tailored signal: a sine, a constant and a switching part, each for parameters that it excites.

For the rotating arm: the acceleration under the sine shows the inertia, the constant speed the drag, and switching
around zero speed the friction. To show static friction, the torque of the switching level must stay below the friction,
and each half period must be long enough for a visible motion.

Reference: hybrid thesis, section 7.4.
"""

from __future__ import annotations

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data import DataError
from smid.signals.generators import check_samples, clock_samples

__all__ = ["tailored"]


def tailored(
    n: int,
    *,
    sampling_time: float = 1.0,
    frequency: float = 0.1 / np.pi,
    amplitude: float = 1.0,
    level: float = 0.5,
    switching: float = 0.2,
    half_period: float = 5.0,
    shares: tuple[float, float] = (1 / 3, 1 / 3),
    offset: float = 0.0,
) -> Array:
    """Return a sine, then a constant, then a square wave, shape (n,).

    Parameters
    ----------
    frequency, amplitude
        Of the sine, in Hz and in the input's unit.
    level
        Of the constant part.
    switching
        Half the distance of the levels of the square wave.
    half_period
        Seconds between switches, a multiple of the sampling time.
    shares
        Shares of the record for the sine and the constant; the square wave has the rest.
    offset
        Added to all samples.

    Raises
    ------
    DataError
        If the shares exceed the record, or the half period is not a multiple of the sampling time.

    Examples
    --------
    >>> tailored(9, frequency=0.25, level=0.5, switching=0.1, half_period=1.0).round(9)
    array([ 0. ,  1. ,  0. ,  0.5,  0.5,  0.5,  0.1, -0.1,  0.1])
    """
    check_samples(n, sampling_time)
    first, second = shares
    if not (first >= 0 and second >= 0 and first + second <= 1):
        raise DataError(f"shares = {shares} do not fit a record: give two numbers from 0, with a sum of at most 1")
    held = clock_samples(half_period, sampling_time, "half_period")
    begin, end = round(first * n), round((first + second) * n)
    k = np.arange(n)
    wave = np.where((k - end) // held % 2 == 0, switching, -switching)
    sine = amplitude * np.sin(2 * np.pi * frequency * sampling_time * k)
    return np.asarray(offset + np.where(k < begin, sine, np.where(k < end, level, wave)))
