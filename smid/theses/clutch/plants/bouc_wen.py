"""Friction of Bouc and Wen: its force does not depend on speed, and its loop has no corner.

    d f = d p - (beta |d p| |f| f + gamma d p f^2),    beta + gamma = 1 / limit^2
    q = p - f

The piston sticks where the pressure turns, and f tends to the limit. Each step is divided so that p changes by at most
a twentieth of the limit, and each part is a step of Heun's method.

Reference: Wen, "Method for random vibration of hysteretic systems", J. Engineering Mechanics Division 102 (1976).
"""

from __future__ import annotations

import math

import numpy as np

from relaxations.algebra.arrays import Array

__all__ = ["bouc_wen"]

LIMIT = 0.8  # bar
SHARE = 0.7  # of beta


def bouc_wen(pressure: Array, limit: float = LIMIT) -> Array:
    """Return the pressure less the friction in bar, shape (n,); there is no friction at the first sample.

    Examples
    --------
    >>> bouc_wen(np.array([0.0, 10.0, 10.0, 0.0])).round(2)
    array([0. , 9.2, 9.2, 0.8])
    """
    beta, gamma = SHARE / limit**2, (1.0 - SHARE) / limit**2
    force, result = 0.0, [float(pressure[0])]
    for p, change in zip(pressure[1:].tolist(), np.diff(pressure).tolist(), strict=True):
        parts = max(1, math.ceil(20.0 * abs(change) / limit))
        d = change / parts
        for _ in range(parts):
            slope = d - (beta * abs(d) * abs(force) + gamma * d * force) * force
            ahead = force + slope
            force += 0.5 * (slope + d - (beta * abs(d) * abs(ahead) + gamma * d * ahead) * ahead)
        result.append(p - force)
    return np.array(result)
