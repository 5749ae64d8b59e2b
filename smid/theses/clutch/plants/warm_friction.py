"""Friction that falls with temperature: Dahl's model with the exponent 2.

    d f = |1 - f sign(d p) / limit(T)|^2 d p,    q = p - f,    limit(T) = limit viscosity(T)^0.4

At 20 degC the limit is 0.8 bar, at -20 degC it is 2.1 bar, and at 60 degC 0.48 bar. With ``g = 1 - f s / limit`` and s
the direction, ``g -> g / (1 + g |d p| / limit)`` is exact for a pressure that is linear between samples.

Reference: Dahl, "Solid friction damping of mechanical vibrations", AIAA Journal 14 (1976).
"""

from __future__ import annotations

import math

import numpy as np

from relaxations.algebra.arrays import Array
from smid.theses.clutch.plants.piston import viscosity

__all__ = ["warm_friction"]

LIMIT = 0.8  # bar, at 20 degC
EXPONENT = 0.4


def warm_friction(pressure: Array, temperature: float) -> Array:
    """Return the pressure less the friction in bar, shape (n,); there is no friction at the first sample.

    Examples
    --------
    >>> [round(float(warm_friction(np.array([0.0, 30.0]), t)[1]), 2) for t in (-20.0, 20.0, 60.0)]
    [28.05, 29.22, 29.53]
    """
    limit = LIMIT * viscosity(temperature) ** EXPONENT
    force, result = 0.0, [float(pressure[0])]
    for p, change in zip(pressure[1:].tolist(), np.diff(pressure).tolist(), strict=True):
        side = math.copysign(1.0, change)
        g = 1.0 - force * side / limit
        force = side * limit * (1.0 - g / (1.0 + g * abs(change) / limit))
        result.append(p - force)
    return np.array(result)
