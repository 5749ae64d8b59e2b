"""The play operator: a part that is pushed by another with slack between them.

    h_t = max(s_t - r, min(s_t + r, h_{t-1})),     g_t = (s_t - h_t) / r  in [-1, 1]

h stays where it is until s has moved by the slack, so g tells on which side of the slack s is: a memory of the last
turn that does not depend on speed.  Sums of plays of several thresholds r make any loop of Prandtl and Ishlinskii.

Where s was last in contact at sample l, on the side c = +1 (from above, ``h = s + r``) or -1, ``h_t = s_l + c r``; so
with a derivative s' of s, ``h_t' = s_l'``, and ``d h_t / d r = c``.

A sample clips h to an interval, and two clips one after the other are again one: ``[a, b]`` then ``[c, d]`` clip to
``[clip(a), clip(b)]``, clipped to ``[c, d]``.  So all samples are done at once by recursive doubling, as in `lag`, and
since clipping only chooses among numbers, what comes out does not depend on how samples are grouped.

Reference: Brokate, Sprekels, "Hysteresis and Phase Transitions" (1996), chapter 2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from smid.networks import Array

__all__ = ["Play", "play"]


@dataclass(frozen=True, eq=False)
class Play:
    """What a play operator did with a signal.

    Parameters
    ----------
    position
        Shape (n,). Of the part that is pushed, h.
    contact
        Shape (n,). The sample at which it was last pushed; 0 before.
    side
        Shape (n,). From which side: 1 from above, -1 from below, 0 before the first push.
    """

    position: Array
    contact: NDArray[np.intp]
    side: Array


def play(signal: Array, threshold: float, before: float) -> Play:
    """Push a part with slack.

    Parameters
    ----------
    signal
        Shape (n,). Of the part that pushes.
    threshold
        Half the slack, in the unit of the signal.
    before
        Where the pushed part was before the first sample.

    Examples
    --------
    >>> play(np.array([0.0, 3.0, 2.5, 0.0]), 1.0, 0.0).position
    array([0., 2., 2., 1.])
    """
    low, high, shift = signal - threshold, signal + threshold, 1
    while shift < signal.size:
        ends = (np.clip(end[:-shift], low[shift:], high[shift:]) for end in (low, high))
        low, high = (np.concatenate([end[:shift], later]) for end, later in zip((low, high), ends, strict=True))
        shift *= 2
    position = np.clip(before, low, high)
    side = np.where(position == signal + threshold, 1.0, np.where(position == signal - threshold, -1.0, 0.0))
    contact = np.maximum.accumulate(np.where(side != 0.0, np.arange(signal.size), 0))
    return Play(position, contact, side[contact])
