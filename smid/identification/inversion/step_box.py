"""A box that the states do not leave during a step, found by trial.

While x stays in a box X, its rates lie in f(X), so x lies in x0 + [0, h] f(X). Where that lies inside X, x does not
leave X.
"""

from __future__ import annotations

import math

import numpy as np

from relaxations.algebra.affine_arithmetic import HIGH, LOW, copy, linear
from relaxations.algebra.arrays import Array, Index, Mask
from relaxations.algebra.ball_arithmetic import EPSILON, TINY
from relaxations.algebra.compiled import compiling
from smid.identification.inversion import operations, stages
from smid.identification.inversion import phi as functions
from smid.identification.inversion.phi import STEEPEST, UP, phi
from smid.identification.inversion.stages import evaluate

BEGIN, RATE, OWN, FIRST, OTHERS, SECOND = range(6)
"""Forms of a state: its start, f_i, J_ii, f'_i, r_i and s_i."""

_TRIALS = 8  # of a box for a step
_WIDER = 0.2  # share by which each is widened

compiled = compiling(operations.__file__, functions.__file__, stages.__file__)


@compiled
def away(begin: Array, stage: Array, i: int, low: float, high: float, w: Array, spare: int) -> None:
    """Write the form of a state that is between two distances away from its begin."""
    middle = 0.5 * low + 0.5 * high
    copy(w, spare, begin, i)
    linear(w, spare + 1, spare, 1.0, middle, max(high - middle, middle - low) * UP + TINY)
    copy(stage, i, w, spare + 1)


@compiled
def _reach(forms: Array, places: Index, jumps: Mask, at_begin: Array, i: int, h: float, sign: float) -> float:
    """Return an upper bound of how far a state rises (sign 1) or falls (-1) within a step, if its box holds."""
    end = HIGH if sign > 0.0 else LOW
    most = max(0.0, h * sign * forms[places[i, RATE], end])
    if not jumps[places[i, RATE]]:
        slope, q = h * forms[places[i, OWN], HIGH], sign * forms[places[i, OTHERS], end]
        first, other = max(0.0, sign * at_begin[i, end]), max(0.0, q)
        if slope <= STEEPEST and math.isfinite(first + other):
            most = min(most, h * phi(slope, 1) * first + h * h * phi(slope, 2) * other)
    return float(most * UP + TINY)


@compiled
def stay(
    program: tuple[Index, Array, int, int],
    until: int,
    places: Index,
    forms: Array,
    jumps: Mask,
    stage: Array,
    known: tuple[Array, Array, Array, Array, int, bool],
    states: Array,
    at_begin: Array,
    given: Mask,
    low: Array,
    high: Array,
    h: float,
) -> bool:
    """Find how far the states fall and rise within a step at most, and return whether that is known.

    The stage then holds the box, and the forms hold the rates over it.

    Parameters
    ----------
    states, at_begin
        Forms of the states, and of their rates, where the step begins; there the rates are evaluated.
    given
        Whether the stage holds a box of a state that is known otherwise.
    low, high
        Written: how far each state falls, not positive, and rises.
    """
    n, width = stage.shape
    w, falls, rises = np.zeros((2, width)), np.zeros(n), np.zeros(n)
    for i in range(n):
        for sign in (-1.0, 1.0):
            most = (1.0 + _WIDER) * _reach(forms, places, jumps, at_begin, i, h, sign)
            most += _WIDER * h * abs(at_begin[i, HIGH] - at_begin[i, LOW])
            most += 16.0 * EPSILON * max(abs(states[i, LOW]), abs(states[i, HIGH])) + TINY
            if sign > 0.0:
                high[i] = most
            else:
                low[i] = -most
    for _ in range(_TRIALS):
        for i in range(n):
            if not given[i]:
                away(states, stage, i, low[i], high[i], w, 0)
        evaluate(program, until, forms, jumps, stage, known)
        inside, bounded = True, True
        for i in range(n):
            if not given[i]:
                falls[i] = -_reach(forms, places, jumps, at_begin, i, h, -1.0)
                rises[i] = _reach(forms, places, jumps, at_begin, i, h, 1.0)
                inside = inside and low[i] < falls[i] and rises[i] < high[i]
                bounded = bounded and math.isfinite(rises[i] - falls[i])
        if inside:
            low[:], high[:] = falls, rises
            return True
        if not bounded:
            return False
        for i in range(n):
            low[i], high[i] = min(low[i], falls[i]), max(high[i], rises[i])
            wider = _WIDER * (high[i] - low[i])
            low[i], high[i] = low[i] - wider, high[i] + wider
    return False
