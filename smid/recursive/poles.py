"""The stability rule of the clutch thesis, section 3.3.2.1, for any number of poles.

The thesis puts a single pole with ``|alpha| >= 1`` back at 0.99 with its sign.  Here, where a pole lies on or outside
the unit circle, each pole beyond the radius 0.99 is put back to it with its angle, which is the same for one pole.  To
move only those from 1 on would be at the mercy of rounding: the computed root of a pole on the circle may lie inside.

That all roots of ``z^n + a_1 z^(n-1) + ... + a_n`` lie inside the circle is tested by the step-down recursion: all its
reflection coefficients are below one in magnitude.  It needs no root finding, for it runs at every sample.

Reference: Jury, Theory and Application of the z-Transform Method, 1964, chapter 3; Markel, Gray, Linear Prediction of
Speech, 1976, section 5.1.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from relaxations.algebra.arrays import Array

__all__ = ["RADIUS", "largest_pole", "put_inside", "stable"]

RADIUS = 0.99
"""Where the thesis puts a pole that has left the unit circle."""


def stable(denominator: Sequence[float]) -> bool:
    """Tell whether all poles lie strictly inside the unit circle.

    Parameters
    ----------
    denominator
        ``a_1, ..., a_n``.

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
        # 1 - k^2 would be zero in floating point for a k next to one.
        rest = (1 - k) * (1 + k)
        a = [(x - k * y) / rest for x, y in zip(a, reversed(a), strict=True)]
    return True


def put_inside(denominator: Sequence[float]) -> Array:
    """Put every pole beyond the radius 0.99 back to it, with its angle.

    Parameters
    ----------
    denominator
        ``a_1, ..., a_n``.

    Returns
    -------
    ndarray, shape (n,)

    Examples
    --------
    >>> put_inside([-1.3]), put_inside([1.0])
    (array([-0.99]), array([0.99]))
    """
    poles = np.roots([1.0, *denominator])
    beyond = np.abs(poles) > RADIUS
    poles[beyond] *= RADIUS / np.abs(poles[beyond])
    return np.asarray(np.poly(poles)[1:].real)


def largest_pole(denominator: Sequence[float]) -> float:
    """Give the largest magnitude of a pole; zero without poles.

    Parameters
    ----------
    denominator
        ``a_1, ..., a_n``.

    Examples
    --------
    >>> largest_pole([-1.25])
    1.25
    """
    return float(np.abs(np.roots([1.0, *denominator])).max(initial=0.0))
