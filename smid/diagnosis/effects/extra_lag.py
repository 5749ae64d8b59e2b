"""Extra lag: a further pole, two processes in succession, before the input or at the sensor.

Where the model has several outputs a pole at the sensor of one of them is another cause, `sensor_lag`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.lag import lagged, time_constant
from smid.diagnosis.effects.parts.naming import find, quantity
from smid.models import Model

__all__ = ["EFFECT"]


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Put it at the only sensor, and before the input."""
    if len(model.output_channels) == 1:
        yield lagged(model, site.output, "sensor", model.insert_sensor, "at the sensor")
    yield lagged(model, site.input, "input", model.insert_before, "at the input")


def describe(values: Mapping[str, float], site: Site) -> str:
    """Say the time constant and the place."""
    sensor = find(values, "sensor_pole")
    pole = sensor if sensor is not None else find(values, "input_pole") or 0.0
    place = f"{site.output} follows" if sensor is not None else f"the effect of {site.input} comes"
    return (
        f"A second process in succession: {place} with a time constant of {quantity(time_constant(pole, site), 's')}."
    )


EFFECT = Effect(
    "extra_lag",
    "a further pole follows or precedes the process",
    extend,
    describe,
)
