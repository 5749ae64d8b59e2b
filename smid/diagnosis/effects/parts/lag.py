"""A lag of order one with unit gain: ``l[t] = p l[t-1] + (1 - p) ((1 - f) x[t] + f x[t-1])``; p = 0 = f passes x on.

x moves between samples, so the lag acts on a mean of the last two samples. A continuous lag that is slow against the
sampling time has f near 1/2 (first-order hold); f is fitted. Reference: Franklin, Powell and Workman, Digital Control
of Dynamic Systems, 3rd ed. (1998), section 6.3 (hold equivalents).
"""

from __future__ import annotations

import math

import sympy

from smid.diagnosis.effects.parts.naming import fresh
from smid.models import Model, Parameter, signal, t

__all__ = ["lag_parameters", "lagged", "time_constant"]


def lag_parameters(model: Model, stem: str) -> tuple[Parameter, Parameter]:
    """Return the pole p and the share f, which switch a lag off at zero."""
    return fresh(model, f"{stem}_pole", (0, 0.999), "", 0.0), fresh(model, f"{stem}_share", (0, 1), "", 0.0)


def lagged(pole: Parameter, share: Parameter, name: str, x: str) -> sympy.Expr:
    """Return the line of the signal `name`, which follows the signal `x`."""
    p, f = pole.symbol, share.symbol
    return p * signal(name)[t - 1] + (1 - p) * ((1 - f) * signal(x)[t] + f * signal(x)[t - 1])


def time_constant(pole: float, sampling_time: float) -> float:
    """Return the time constant of a pole, in seconds."""
    return -sampling_time / math.log(pole) if 0 < pole < 1 else 0.0
