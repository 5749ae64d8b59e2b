"""Ramps: straight lines between corners (clutch thesis, section 3.1)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from relaxations.algebra.arrays import Array
from smid.data import DataError
from smid.signals.generators import check_samples

__all__ = ["ramp"]


def ramp(
    n: int,
    *,
    corners: Sequence[tuple[float, float]] | None = None,
    sampling_time: float = 1.0,
    amplitude: float = 1.0,
    offset: float = 0.0,
) -> Array:
    """Return straight lines between corners, shape (n,); by default one ramp up and down.

    Parameters
    ----------
    corners
        Rising times in seconds, and values between 0 and 1; before the first and after the last the signal is constant.
    amplitude, offset
        Factor of the values, and what is added, in the input's unit.

    Raises
    ------
    DataError
        If the times do not rise.

    Examples
    --------
    >>> ramp(5, amplitude=10)
    array([ 0.,  5., 10.,  5.,  0.])
    >>> ramp(4, corners=[(1, 0), (2, 1)])
    array([0., 0., 1., 1.])
    """
    check_samples(n, sampling_time)
    end = sampling_time * (n - 1)
    points: ArrayLike = [(0.0, 0.0), (end / 2, 1.0), (end, 0.0)] if corners is None else list(corners)
    table = np.asarray(points, dtype=float)
    if n > 1 and (table.ndim != 2 or table.shape[1] != 2 or not (np.diff(table[:, 0]) > 0).all()):
        raise DataError("the corners of a ramp are pairs (time, value) with rising times: sort them, each time once")
    return np.asarray(offset + amplitude * np.interp(sampling_time * np.arange(n), table[:, 0], table[:, 1]))
