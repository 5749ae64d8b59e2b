"""A staircase plus noise: the stairs show the static curve, the noise excites the dynamics.

Reference: hybrid thesis, section 2.4.2 and listing K.1: noise of +-0.05 on steps of 0.1.
"""

from __future__ import annotations

from relaxations.algebra.arrays import Array
from smid.signals.generators import Seed
from smid.signals.noise import noise
from smid.signals.staircase import staircase

__all__ = ["noisy_staircase"]


def noisy_staircase(
    n: int,
    *,
    seed: Seed,
    sampling_time: float = 1.0,
    period: float = 20.0,
    steps: int = 5,
    amplitude: float = 1.0,
    offset: float = 0.0,
    noise_amplitude: float = 0.1,
) -> Array:
    """Return a staircase plus uniform noise, shape (n,).

    Parameters
    ----------
    sampling_time, period, steps, amplitude, offset
        Of the staircase, see `staircase`.
    noise_amplitude
        Largest deviation from the staircase, in the input's unit.

    Raises
    ------
    DataError
        As `staircase`.

    Examples
    --------
    >>> noisy_staircase(3, seed=1, noise_amplitude=0.0, period=1)
    array([0. , 0.2, 0.4])
    """
    stairs = staircase(n, sampling_time=sampling_time, period=period, steps=steps, amplitude=amplitude, offset=offset)
    return stairs + noise(n, seed=seed, amplitude=noise_amplitude)
