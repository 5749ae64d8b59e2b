"""Steps to levels at given times (clutch thesis, section 3.1, second set)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data import DataError
from smid.signals.generators import check_samples

__all__ = ["step"]


def step(
    n: int,
    *,
    levels: Sequence[tuple[float, float]] | None = None,
    sampling_time: float = 1.0,
    amplitude: float = 1.0,
    offset: float = 0.0,
) -> Array:
    """Return steps to levels, shape (n,); by default one step up after a tenth of the record.

    Parameters
    ----------
    levels
        Rising times in seconds, and the value from each time on; before the first time the value is 0.
    amplitude, offset
        Factor of the values, and what is added, in the input's unit.

    Raises
    ------
    DataError
        If the times do not rise.

    Examples
    --------
    >>> step(5, levels=[(1, 1), (3, 0.5)], amplitude=10)
    array([ 0., 10., 10.,  5.,  5.])
    """
    check_samples(n, sampling_time)
    table = np.asarray([(sampling_time * (n // 10), 1.0)] if levels is None else list(levels), dtype=float)
    if table.ndim != 2 or table.shape[1] != 2 or not (np.diff(table[:, 0]) > 0).all():
        raise DataError("the levels of a step are pairs (time, value) with rising times: sort them, each time once")
    # A time that is a sample up to rounding begins at that sample.
    begun = np.searchsorted(table[:, 0], sampling_time * (np.arange(n) + 1e-6), side="right")
    return np.asarray(offset + amplitude * np.concatenate([[0.0], table[:, 1]])[begun])
