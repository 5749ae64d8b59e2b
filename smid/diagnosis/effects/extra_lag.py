"""Extra lag: a further pole, two processes in succession.

``l[t] = p l[t-1] + (1 - p) ((1 - f) x[t] + f x[t-1])``, of unit gain, before the input or at the sensor; p = 0 = f
passes x on. x moves between samples, so the lag acts on a mean of the last two samples. A continuous lag that is slow
against the sampling time has f near 1/2 (first-order hold); f is fitted. Reference: Ljung, System Identification, 2nd
ed. (1999), section 4.2; Franklin, Powell and Workman, Digital Control of Dynamic Systems, 3rd ed. (1998), section 6.3
(hold equivalents).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import sympy

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.naming import find, free_name, fresh, quantity, signal_of
from smid.models import Model, Parameter, signal, t

__all__ = ["EFFECT"]

_POLES = (0.5, 0.8, 0.95)
_PARTS = (("pole", 0.999), ("share", 1.0))


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Put it at the sensor, and before the input."""
    sensor, share = (fresh(model, f"sensor_{part}", (0, most), "", 0.0) for part, most in _PARTS)
    name, raw = free_name(model, f"{site.output}_lag"), signal_of(model, site.output)
    yield Extension(
        model.insert_sensor(site.output, lambda _: _lag(sensor, share, name, raw), [sensor, share], new_name=name),
        tuple({sensor.name: pole, share.name: 0.5} for pole in _POLES),
        "at the sensor",
    )
    actuator, blend = (fresh(model, f"input_{part}", (0, most), "", 0.0) for part, most in _PARTS)
    drive = free_name(model, f"{site.input}_lag")
    read = signal_of(model, site.input)
    yield Extension(
        model.insert_before(
            site.input, lambda _: _lag(actuator, blend, drive, read), [actuator, blend], new_name=drive
        ),
        tuple({actuator.name: pole, blend.name: 0.5} for pole in _POLES),
        "at the input",
    )


def _lag(pole: Parameter, share: Parameter, name: str, x: str) -> sympy.Expr:
    p, f = pole.symbol, share.symbol
    return p * signal(name)[t - 1] + (1 - p) * ((1 - f) * signal(x)[t] + f * signal(x)[t - 1])


def describe(values: Mapping[str, float], site: Site) -> str:
    """Say the time constant and the place."""
    sensor = find(values, "sensor_pole")
    pole = sensor if sensor is not None else find(values, "input_pole") or 0.0
    time = -site.sampling_time / math.log(pole) if 0 < pole < 1 else 0.0
    place = f"{site.output} follows" if sensor is not None else f"the effect of {site.input} comes"
    return f"A second process in succession: {place} with a time constant of {quantity(time, 's')}."


EFFECT = Effect(
    "extra_lag",
    "a further pole follows or precedes the process",
    extend,
    describe,
)
