"""A sine (hybrid thesis, section 2.4.2 and listing K.1)."""

from __future__ import annotations

import numpy as np

from relaxations.algebra.arrays import Array
from smid.signals.generators import check_samples

__all__ = ["sine"]


def sine(
    n: int,
    *,
    sampling_time: float = 1.0,
    frequency: float = 0.1 / np.pi,
    amplitude: float = 1.0,
    offset: float = 0.0,
    phase: float = 0.0,
) -> Array:
    """Return ``offset + amplitude sin(2 pi frequency t + phase)``, shape (n,).

    Parameters
    ----------
    frequency
        In Hz; by default 0.2 rad/s, as in the thesis.
    phase
        At time zero, in rad.

    Raises
    ------
    DataError
        If n or the sampling time is not positive.

    Examples
    --------
    >>> sine(5, frequency=0.25).round(12)
    array([ 0.,  1.,  0., -1., -0.])
    """
    check_samples(n, sampling_time)
    return np.asarray(offset + amplitude * np.sin(2 * np.pi * frequency * sampling_time * np.arange(n) + phase))
