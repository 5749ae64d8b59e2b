"""A lag of unit gain, ``l[t] = p l[t-1] + (1 - p) ((1 - f) x[t] + f x[t-1])``; p = 0 = f passes x on.

A lag that is over within the sampling time is no lag but a delay, which is another effect.

x moves between samples, so the lag acts on a mean of the last two samples. A continuous lag that is slow against the
sampling time has f near 1/2 (first-order hold); f is fitted. Reference: Ljung, System Identification, 2nd ed. (1999),
section 4.2; Franklin, Powell and Workman, Digital Control of Dynamic Systems, 3rd ed. (1998), section 6.3 (hold
equivalents).
"""

from __future__ import annotations

import math
from collections.abc import Callable

import sympy

from smid.diagnosis.effects.effect import Extension, Site
from smid.diagnosis.effects.parts.naming import free_name, fresh, signal_of
from smid.models import Model, Parameter, signal, t

__all__ = ["POLES", "lag_line", "lag_parameters", "lagged", "time_constant", "with_memory"]

POLES = (0.5, 0.8, 0.95)
"""Starts of a pole."""

_SHORTEST = math.exp(-3.0)  # pole of a lag that is over within the sampling time


def lagged(model: Model, channel: str, stem: str, insert: Callable[..., Model], label: str) -> Extension:
    """Return the model with a lag behind a channel; `insert` puts a line there."""
    pole, share = lag_parameters(model, stem)
    name, raw = free_name(model, f"{channel}_lag"), signal_of(model, channel)
    return Extension(
        insert(channel, lambda _: lag_line(pole, share, name, raw), [pole, share], new_name=name),
        tuple({pole.name: start, share.name: 0.5} for start in POLES),
        label,
        inside=with_memory(pole),
    )


def with_memory(pole: Parameter) -> dict[str, tuple[float, float]]:
    """Return where the pole of a lag must lie, see `smid.diagnosis.effects.effect.Extension`."""
    return {pole.name: (_SHORTEST, 1.0)}


def lag_parameters(model: Model, stem: str) -> tuple[Parameter, Parameter]:
    """Return the pole p and the share f, which switch a lag off at zero."""
    return fresh(model, f"{stem}_pole", (0, 0.999), "", 0.0), fresh(model, f"{stem}_share", (0, 1), "", 0.0)


def lag_line(pole: Parameter, share: Parameter, name: str, x: str) -> sympy.Expr:
    """Return the line of the signal `name`, which follows the signal `x`."""
    p, f = pole.symbol, share.symbol
    return p * signal(name)[t - 1] + (1 - p) * ((1 - f) * signal(x)[t] + f * signal(x)[t - 1])


def time_constant(pole: float, site: Site) -> float:
    """Return the time constant of a pole, in seconds.

    Examples
    --------
    >>> from smid import Dataset
    >>> data = Dataset.from_arrays(input={"u": [0.0, 1]}, output={"y": [0.0, 1]}, sampling_time=0.5)
    >>> round(time_constant(math.exp(-0.25), Site(data, "u", "y")), 12)
    2.0
    """
    return -site.sampling_time / math.log(pole) if 0 < pole < 1 else 0.0
