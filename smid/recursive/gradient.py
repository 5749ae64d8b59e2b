"""Shared parts of the two gradient methods: a check of the gain, and the correction with fixed poles."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from relaxations.algebra.arrays import Array
from smid.models import ModelError

__all__ = ["check_gain", "retake"]


def check_gain(gain: float) -> None:
    """Raise a `ModelError` if the adaptation gain is not a positive number."""
    if not (gain > 0 and math.isfinite(gain)):
        raise ModelError(f"gain = {gain} is not an adaptation gain: give a positive number")


def retake(gain: Callable[[Array], Array], phi: Array, error: float, held: Array) -> Array:
    """Return the change of all parameters, shape (n,), when the change of the first m is given.

    The other parameters correct the remaining error with their own gain. `held` has shape (m,), `phi` has shape (n,).

    Examples
    --------
    >>> retake(lambda phi: phi / (phi @ phi), np.array([1.0, 2.0]), 5.0, np.array([1.0]))
    array([1., 2.])
    """
    m = held.size
    rest = np.concatenate([np.zeros(m), phi[m:]])
    return np.concatenate([held, (gain(rest) * (error - phi[:m] @ held))[m:]])
