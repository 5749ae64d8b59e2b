"""A constant input, which excites the static gain alone."""

from __future__ import annotations

import numpy as np

from relaxations.algebra.arrays import Array
from smid.signals.generators import check_samples

__all__ = ["constant"]


def constant(n: int, *, offset: float = 1.0) -> Array:
    """Return a constant signal, shape (n,).

    Parameters
    ----------
    offset
        Its value, in the input's unit.

    Raises
    ------
    DataError
        If n is not a number of samples.

    Examples
    --------
    >>> constant(3, offset=0.5)
    array([0.5, 0.5, 0.5])
    """
    check_samples(n)
    return np.full(n, float(offset))
