"""A Preisach operator whose loop widens with the level.

    q = step sum over levels c_j of the mean of three relays;
    a relay switches on at c_j + h, off at c_j - h,    h = (0.25, 0.75, 1.25) (narrow + growth c_j)

Each relay is on or off. A staircase of relays approximates a continuous Preisach operator: with 400 levels and three
relays each, a step is 0.035 bar. The loop is as wide as a relay is, so it depends on the level; in a Prandtl-Ishlinskii
operator it does not.

Reference: Mayergoyz, "Mathematical Models of Hysteresis" (1991), chapter 1.
"""

from __future__ import annotations

import numpy as np

from relaxations.algebra.arrays import Array

__all__ = ["preisach"]

LEVELS, TOP = 400, 42.0  # bar
NARROW, GROWTH = 0.35, 0.06  # bar, bar/bar
SPREAD = (0.25, 0.75, 1.25)


def preisach(pressure: Array) -> Array:
    """Return the output of the operator in bar, shape (n,), for pressures between 0 and 42 bar.

    Examples
    --------
    >>> preisach(np.array([0.0, 5.0, 30.0, 40.0, 30.0, 5.0])).round(1)
    array([ 0. ,  4.5, 28.5, 38. , 31.7,  5.5])
    """
    step = TOP / LEVELS
    total = np.zeros(pressure.size)
    places = np.arange(pressure.size)
    for level in step * (np.arange(LEVELS) + 0.5):
        for share in SPREAD:
            half = share * (NARROW + GROWTH * level)
            is_on, is_off = pressure >= level + half, pressure <= level - half
            # A relay holds the state of its last switching; before that it is on if the first sample exceeds its level.
            last = np.maximum.accumulate(np.where(is_on | is_off, places, -1))
            total += np.where(last < 0, pressure[0] >= level, is_on[last])
    return step / len(SPREAD) * total
