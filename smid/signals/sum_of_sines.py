r"""A sum of sines with given frequencies and amplitudes, and the exact sums that the hybrid thesis tried on its arm.

n sines excite order 2n and not one more (Ljung, "System Identification", section 13.2), so a sum is the leanest signal
for a linear model of known order; `multisine` is the same on a grid of frequencies, with random phases.

Table F.1 came to us by OCR.  Listing K.13 settles it: what is printed with a fraction at every sine stands there
multiplied by half the range, 0.5 V (figure F.2 has the same axis); where one factor stands before the whole sum it is
that factor.  So read, the sum of eleven sines and the one with changed signs leave the +-1 V of section 5.3.

Reference: hybrid thesis, table F.1 and listing K.13.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from smid.data import DataError
from smid.signals.generators import Array, check_samples

__all__ = ["TABLE_F1", "Sines", "sum_of_sines"]


@dataclass(frozen=True)
class Sines:
    """Frequencies in rad/s and amplitudes in V of one row of table F.1.

    Parameters
    ----------
    frequencies, amplitudes
        As above, one of each for every sine.
    """

    frequencies: tuple[float, ...]
    amplitudes: tuple[float, ...]

    def signal(self, n: int, sampling_time: float) -> Array:
        """Return n samples of the sum, the sampling time in seconds."""
        return sum_of_sines(n, frequencies=self.frequencies, amplitudes=self.amplitudes, sampling_time=sampling_time)


def sum_of_sines(
    n: int,
    *,
    frequencies: Sequence[float] = (0.4, 0.9, 1.4, 1.9, 2.4, 2.9),
    amplitudes: Sequence[float] | float = 1.0,
    sampling_time: float = 1.0,
    offset: float = 0.0,
) -> Array:
    r"""Give ``offset + sum_i amplitude_i sin(frequency_i t)``.

    Parameters
    ----------
    n
        Number of samples.
    frequencies
        In rad/s; by default the thesis's six.
    amplitudes
        In the input's unit, one for all or one for each; negative ones start downwards.
    sampling_time
        In seconds.
    offset
        Added, in the input's unit.

    Returns
    -------
    ndarray, shape (n,)
        In the input's unit.

    Raises
    ------
    DataError
        If a frequency is beyond half the sampling rate, or the numbers of both differ.

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
"""The sums of table F.1, from top to bottom; the single sine stands there three times."""
