"""The check of a simulated plant's input."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from relaxations.algebra.arrays import Array
from smid.data import DataError
from smid.signals.generators import check_samples

__all__ = ["finite_series"]


def finite_series(samples: ArrayLike, sampling_time: float, name: str = "input", unit: str = "") -> Array:
    """Return samples as an array; DataError if they are not a finite series, or the sampling time is not positive."""
    series = np.asarray(samples, dtype=np.float64)
    if series.ndim != 1 or not series.size or not np.isfinite(series).all():
        wanted = f"a series of finite samples{unit and f', in {unit}'}"
        raise DataError(f"the {name} has shape {series.shape} or is not finite: give {wanted}")
    check_samples(series.size, sampling_time)
    return series
