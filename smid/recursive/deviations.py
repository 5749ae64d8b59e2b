"""Standard deviations of parameters: one for all, or one for each."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from relaxations.algebra.arrays import Array
from smid.models import ModelError

__all__ = ["Deviation", "check_deviation", "deviations"]

Deviation = float | tuple[float, ...]
"""A standard deviation of all parameters, or one for each."""


def check_deviation(option: str, value: float | Sequence[float], *, zero: bool = False) -> Deviation:
    """Return one standard deviation, or one for each parameter, as floats; raise `ModelError` if they are not valid."""
    try:
        found: Deviation = tuple(map(float, value)) if isinstance(value, Sequence | np.ndarray) else float(value)
    except (TypeError, ValueError):
        found = math.nan
    several = np.atleast_1d(found)
    if not (several.size and np.isfinite(several).all() and (several >= 0).all() and (zero or several.all())):
        least = "not negative" if zero else "positive"
        raise ModelError(f"{option} = {value!r} is refused: give a number that is {least}, or one for each parameter")
    return found


def deviations(option: str, value: Deviation, n: int) -> Array:
    """Return n standard deviations, shape (n,); raise `ModelError` if a tuple has another length."""
    if not isinstance(value, float) and len(value) != n:
        raise ModelError(f"{option} has {len(value)} numbers for {n} parameters: give one for each, or one for all")
    return np.broadcast_to(np.asarray(value), n)
