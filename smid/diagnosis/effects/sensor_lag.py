"""Sensor lag: one sensor follows what it measures with a pole of its own, ``T s' = w - s``.

A further output, of the same state or of another one, does not have the pole: this tells a slow sensor from a slow
process. With one output the same equation is `extra_lag` at the sensor, so nothing is offered.
Reference: Doebelin, Measurement Systems, 5th ed. (2003), section 3.3 (first-order instruments).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.lag import lagged, time_constant
from smid.diagnosis.effects.parts.naming import find, quantity
from smid.models import Model

__all__ = ["EFFECT"]


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Put it at the sensor of one of several outputs."""
    if len(model.output_channels) > 1:
        yield lagged(model, site.output, "own", model.insert_sensor, "")


def describe(values: Mapping[str, float], site: Site) -> str:
    """Say the time constant."""
    time = quantity(time_constant(find(values, "own_pole") or 0.0, site), "s")
    return f"The sensor of {site.output} is slow: it follows what it measures with a time constant of {time}."


EFFECT = Effect(
    "sensor_lag",
    "one of several sensors has a pole of its own",
    extend,
    describe,
    needs="a model of several outputs",
)
