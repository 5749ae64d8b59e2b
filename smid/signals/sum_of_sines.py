"""A sum of sines with given frequencies and amplitudes, and the sums of the hybrid thesis.

n sines are persistently exciting of order 2n (Ljung, "System Identification", section 13.2). `multisine` has a grid of
frequencies and random phases instead.

Table F.1 is read with listing K.13: where the table prints a fraction at every sine, the fraction is multiplied by half
the range, 0.5 V; one factor before the whole sum is that factor. Two of the sums then exceed the +-1 V of section 5.3.

Reference: hybrid thesis, table F.1 and listing K.13.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from relaxations.algebra.arrays import Array
from smid.data import DataError
from smid.signals.generators import check_samples

__all__ = ["TABLE_F1", "Sines", "sum_of_sines"]


@dataclass(frozen=True)
class Sines:
    """Frequencies in rad/s and amplitudes in V of one row of table F.1."""

    frequencies: tuple[float, ...]
    amplitudes: tuple[float, ...]

    def signal(self, n: int, sampling_time: float) -> Array:
        """Return n samples of the sum; the sampling time is in seconds."""
        return sum_of_sines(n, frequencies=self.frequencies, amplitudes=self.amplitudes, sampling_time=sampling_time)


def sum_of_sines(
    n: int,
    *,
    frequencies: Sequence[float] = (0.4, 0.9, 1.4, 1.9, 2.4, 2.9),
    amplitudes: Sequence[float] | float = 1.0,
    sampling_time: float = 1.0,
    offset: float = 0.0,
) -> Array:
    """Return ``offset + sum_i amplitude_i sin(frequency_i t)``, shape (n,).

    Parameters
    ----------
    frequencies
        In rad/s; by default the six of the thesis.
    amplitudes
        In the input's unit, one for all or one for each.

    Raises
    ------
    DataError
        If a frequency is beyond half the sampling rate, or the amplitudes differ in number.

    Examples
    --------
    >>> sum_of_sines(3, frequencies=(0.5, 1.5), amplitudes=(1, -1), sampling_time=1.0).round(4)
    array([ 0.    , -0.5181,  0.7004])
    """
    check_samples(n, sampling_time)
    speeds = np.asarray(frequencies, dtype=np.float64)
    if speeds.ndim != 1 or not speeds.size or not ((speeds > 0) & (speeds * sampling_time < np.pi)).all():
        raise DataError(
            f"frequencies = {tuple(frequencies)} cannot be sampled every {sampling_time:g} s: give one or more, above "
            f"0 and below {np.pi / sampling_time:g} rad/s"
        )
    sizes = _sizes(amplitudes, speeds.size)
    return np.asarray(offset + np.sin(np.outer(sampling_time * np.arange(n), speeds)) @ sizes)


def _sizes(amplitudes: ArrayLike, count: int) -> Array:
    sizes = np.asarray(amplitudes, dtype=np.float64)
    if sizes.ndim == 0:
        return np.full(count, float(sizes))
    if sizes.shape != (count,):
        raise DataError(f"{sizes.size} amplitudes for {count} frequencies: give one for all, or one for each")
    return sizes


SIX = (0.4, 0.9, 1.4, 1.9, 2.4, 2.9)
ELEVEN = (0.3, 0.5, 0.7, 1.0, 1.2, 1.5, 1.7, 2.0, 2.2, 2.5, 2.8)
HALF_RANGE = 0.5  # V, "hulp" of listing K.13


def _six(*divisors: float) -> Sines:
    return Sines(SIX, tuple(HALF_RANGE / d for d in divisors))


TABLE_F1: dict[str, Sines] = {
    "one_sine": Sines((1.5,), (1.0,)),
    "six_equal": _six(6, 6, 6, 6, 6, 6),
    "six_one_negative": _six(2, 2.1, 1.9, 2.2, -1.8, 2.3),
    "six_two_negative": _six(2, 2.1, -1.9, 2.2, -1.8, 2.3),
    "eleven_equal": Sines(ELEVEN, (HALF_RANGE,) * len(ELEVEN)),
    "six_signs": _six(1, 1, -1, -1, -1, 1),
    "six_unequal": _six(2, 2.1, 5, 2.2, 4, 1.8),
}
"""The sums of table F.1, from top to bottom; the table has the single sine three times."""
