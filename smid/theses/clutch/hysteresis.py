"""Rate-independent hysteresis of the Duhem class, in the linear form of Coleman and Hodgdon.

    z = u - e,   d e = (limit d u - e |d u|) / width

The output z trails the input u. After a travel of several widths it trails by the limit, in both directions and at any
speed. If u is linear between samples, the step ``e -> s limit + (e - s limit) exp(-|d u| / width)`` is exact, with s
the direction.

With ``width = 2 limit`` this is Dahl's model of dry friction: z sticks where u turns, and never moves against u. With
a smaller width z overshoots at the turn.

Reference: Coleman, Hodgdon, "A constitutive relation for rate-independent hysteresis in ferromagnetically soft
materials", Int. J. Engng Sci. 24 (1986); Dahl, "A solid friction model", Aerospace Corporation (1968).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

__all__ = ["trailing"]


def trailing(u: NDArray[np.float64], limit: float, width: float) -> NDArray[np.float64]:
    """Return the output z, in the unit of u, shape (n,); its first value is u[0].

    Parameters
    ----------
    u
        Shape (n,). Linear between samples.
    limit
        Final distance between z and u, in the unit of u; zero for no hysteresis.
    width
        Travel, in the unit of u, after which the distance to the limit falls to ``exp(-1)``.

    Examples
    --------
    >>> trailing(np.array([0.0, 9.0, 8.0, 0.0]), limit=0.5, width=1.0).round(3)
    array([0.   , 8.5  , 8.132, 0.5  ])
    """
    if limit == 0:
        return u
    result = np.empty_like(u)
    behind = 0.0
    result[0] = u[0]
    for k, change in enumerate(np.diff(u).tolist(), start=1):
        end = math.copysign(limit, change)
        behind = end + (behind - end) * math.exp(-abs(change) / width)
        result[k] = u[k] - behind
    return result
