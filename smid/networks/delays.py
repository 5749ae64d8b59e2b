"""Delay lines: past samples of signals as columns (clutch thesis, (5.1); hybrid thesis, figures 3.5 and 6.5)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from relaxations.algebra.arrays import Array
from smid.data import DataError

__all__ = ["delayed"]


def delayed(signals: Sequence[ArrayLike], delays: Sequence[Sequence[int]]) -> Array:
    """Return delayed samples of signals side by side, shape (n, k).

    Row t holds ``signal[t - delay]``. Before the first sample a signal has its first value.

    Parameters
    ----------
    signals
        Shape (n,) each, over the same instants.
    delays
        For each signal, the delays of its columns in samples.

    Raises
    ------
    DataError
        If the signals are of different lengths or empty, or a delay is negative.

    Examples
    --------
    >>> delayed([[1, 2, 3], [7, 8, 9]], [(1, 2), (0,)])
    array([[1., 1., 7.],
           [1., 1., 8.],
           [2., 1., 9.]])
    """
    columns = [np.asarray(signal, dtype=np.float64) for signal in signals]
    shapes = {column.shape for column in columns}
    if len(shapes) != 1 or len(next(iter(shapes))) != 1 or not columns[0].size:
        raise DataError(f"signals of shapes {sorted(shapes)}: give vectors of samples over the same instants")
    if any(delay < 0 for group in delays for delay in group):
        raise DataError(f"delays = {delays}: a network cannot read future samples, give 0 or more")
    instants = np.arange(columns[0].size)
    return np.stack(
        [
            column[np.maximum(instants - delay, 0)]
            for column, group in zip(columns, delays, strict=True)
            for delay in group
        ],
        axis=1,
    )
