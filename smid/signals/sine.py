"""A sine: one frequency, with much energy.  Reference: hybrid thesis, section 2.4.2 and listing K.1."""

from __future__ import annotations

import numpy as np

from smid.signals.generators import Array, check_samples

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
    """Give ``offset + amplitude sin(2 pi frequency t + phase)``.

    Parameters
    ----------
    n
        Number of samples.
    sampling_time
        In seconds.
    frequency
        In Hz; by default 0.2 rad/s, as in the thesis.
    amplitude, offset
        Half the range, and its centre, in the input's unit.
    phase
        At time zero, in rad.

    Returns
    -------
    ndarray, shape (n,)
        In the input's unit.

    Raises
    ------
    DataError
        If n or the sampling time make no record.

    Examples
    --------
    >>> sine(5, frequency=0.25).round(12)
    array([ 0.,  1.,  0., -1., -0.])
    """
    check_samples(n, sampling_time)
    return np.asarray(offset + amplitude * np.sin(2 * np.pi * frequency * sampling_time * np.arange(n) + phase))
