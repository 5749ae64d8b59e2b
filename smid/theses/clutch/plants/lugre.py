"""The piston with friction that depends on speed: the LuGre model with the Stribeck effect.

    dz/dt = v - stiffness |v| z / g(v),    g(v) = coulomb + (stiction - coulomb) exp(-(v / v_s)^2)
    r_1 v + r_2 v |v| = p - stiffness z - load(x, T)

z is the deflection of the bristles. Slow motion meets more than twice the friction of fast motion, so the loop of slow
ramps is wider than that of fast ones, while the resistance of the oil widens the loop of fast ones. The motion is that
of `piston`.

Reference: Canudas de Wit, Olsson, Astrom, Lischinsky, "A new model for control of systems with friction", IEEE Trans.
Automatic Control 40 (1995).
"""

from __future__ import annotations

import math

import numpy as np

from relaxations.algebra.arrays import Array
from smid.theses.clutch.plants.piston import Piston

__all__ = ["lugre"]

COULOMB, STICTION = 0.5, 1.2  # bar
STRIBECK = 20.0  # mm/s
STIFFNESS = 12.0  # bar/mm


def lugre(piston: Piston, pressure: Array, interval: float) -> Array:
    """Return the positions in mm, shape (n,), under pressures in bar every interval in s, from rest.

    Examples
    --------
    >>> def loop(n):
    ...     up = np.linspace(0.0, 30.0, n)
    ...     x = lugre(Piston(20.0), np.concatenate([up, up[::-1]]), 1e-4)
    ...     return float(np.interp(5.0, x[:n], up) - np.interp(5.0, x[: n - 1 : -1], up))
    >>> [round(loop(n), 1) for n in (30000, 3000, 1500)]  # bar wide, at 5 mm, for ramps of 3, 0.3 and 0.15 s
    [2.4, 1.5, 2.1]
    """
    x, z = piston.at_rest(float(pressure[0])), 0.0
    result = [x]
    for p in pressure[:-1].tolist():
        before = x
        x = piston.step(x, p - STIFFNESS * z - piston.load(x), STIFFNESS + piston.stiffness(x), interval)
        moved = x - before
        g = COULOMB + (STICTION - COULOMB) * math.exp(-((moved / interval / STRIBECK) ** 2))
        # Exact for a constant speed; z tends to g / stiffness in the direction of motion.
        end = math.copysign(g / STIFFNESS, moved)
        z = end + (z - end) * math.exp(-STIFFNESS * abs(moved) / g)
        result.append(x)
    return np.array(result)
