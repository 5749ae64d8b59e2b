"""Backlash behind the curve: the position follows the piston through a gap, by a contact that yields.

    dx/dt = D(y - x) / tau,    D(e) = e - gap for e > gap, e + gap for e < -gap, else 0

y is the position of the piston. Inside the gap nothing moves; in contact the distance to the gap's end falls with the
time constant tau. This is the dead-zone model of backlash, with a massless load on a damper and a spring as contact.

Reference: Nordin, Galic, Gutman, "New models for backlash and gear play", Int. J. Adaptive Control and Signal
Processing 11 (1997).
"""

from __future__ import annotations

import numpy as np

from relaxations.algebra.arrays import Array

__all__ = ["backlash"]

GAP = 0.25  # mm, half the backlash
CONTACT = 3e-3  # s


def backlash(piston: Array, interval: float) -> Array:
    """Return the positions in mm, shape (n,), from the middle of the gap.

    Examples
    --------
    >>> backlash(np.repeat([0.0, 2.0, 0.0], 1000), 1e-4)[[0, 1999, 2999]].round(2)
    array([0.  , 1.75, 0.25])
    """
    x, share = float(piston[0]), interval / CONTACT
    result = [x]
    for y in piston[:-1].tolist():
        e = y - x
        x += share * (max(0.0, e - GAP) + min(0.0, e + GAP))
        result.append(x)
    return np.array(result)
