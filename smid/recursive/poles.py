"""The stability rule of the clutch thesis, section 3.3.2.1, for any number of poles.

The thesis moves a single pole with ``|alpha| >= 1`` to 0.99 with its sign. Here, if a pole lies on or outside the unit
circle, every pole beyond the radius 0.99 is moved to 0.99 with its angle. For one pole both rules are equal. A limit of
1 would be sensitive to rounding: the computed root of a pole on the circle may lie inside.

The stability test runs at every sample, so it uses the step-down recursion instead of root finding. All poles lie
inside the circle if and only if all reflection coefficients are below one in magnitude.

Reference: Jury, Theory and Application of the z-Transform Method, 1964, chapter 3; Markel, Gray, Linear Prediction of
Speech, 1976, section 5.1.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from relaxations.algebra.arrays import Array

__all__ = ["RADIUS", "largest_pole", "put_inside", "stable"]

RADIUS = 0.99
"""Radius to which the thesis moves an unstable pole."""


def stable(denominator: Sequence[float]) -> bool:
    """Return whether all poles of ``1, a_1, ..., a_n`` lie strictly inside the unit circle.

    Examples
    --------
    >>> stable([-0.5]), stable([-1.0]), stable([0.2, 0.99]), stable([2.1, 1.1])
    (True, False, True, False)
    """
    a = list(denominator)
    while a:
        k = a.pop()
        if not abs(k) < 1:
            return False
        # 1 - k^2 is zero in floating point if k is very close to one.
        rest = (1 - k) * (1 + k)
        a = [(x - k * y) / rest for x, y in zip(a, reversed(a), strict=True)]
    return True


def put_inside(denominator: Sequence[float]) -> Array:
    """Return the coefficients after every pole beyond the radius 0.99 is moved to it, with its angle."""
    poles = np.roots([1.0, *denominator])
    beyond = np.abs(poles) > RADIUS
    poles[beyond] *= RADIUS / np.abs(poles[beyond])
    return np.asarray(np.poly(poles)[1:].real)


def largest_pole(denominator: Sequence[float]) -> float:
    """Return the largest magnitude of a pole of ``1, a_1, ..., a_n``; zero without poles."""
    return float(np.abs(np.roots([1.0, *denominator])).max(initial=0.0))
