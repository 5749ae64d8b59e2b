"""Extra lag: a further pole, two processes in succession.

The lag of `smid.diagnosis.effects.parts.lag`, before the input or at the sensor.
Reference: Ljung, System Identification, 2nd ed. (1999), section 4.2.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.lag import lag_parameters, lagged, time_constant
from smid.diagnosis.effects.parts.naming import find, free_name, quantity, signal_of
from smid.models import Model

__all__ = ["EFFECT"]

_POLES = (0.5, 0.8, 0.95)


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Put it at the sensor, and before the input."""
    sensor, share = lag_parameters(model, "sensor")
    name, raw = free_name(model, f"{site.output}_lag"), signal_of(model, site.output)
    yield Extension(
        model.insert_sensor(site.output, lambda _: lagged(sensor, share, name, raw), [sensor, share], new_name=name),
        tuple({sensor.name: pole, share.name: 0.5} for pole in _POLES),
        "at the sensor",
    )
    actuator, blend = lag_parameters(model, "input")
    drive = free_name(model, f"{site.input}_lag")
    read = signal_of(model, site.input)
    yield Extension(
        model.insert_before(
            site.input, lambda _: lagged(actuator, blend, drive, read), [actuator, blend], new_name=drive
        ),
        tuple({actuator.name: pole, blend.name: 0.5} for pole in _POLES),
        "at the input",
    )


def describe(values: Mapping[str, float], site: Site) -> str:
    """Say the time constant and the place."""
    sensor = find(values, "sensor_pole")
    pole = sensor if sensor is not None else find(values, "input_pole") or 0.0
    place = f"{site.output} follows" if sensor is not None else f"the effect of {site.input} comes"
    time = quantity(time_constant(pole, site.sampling_time), "s")
    return f"A second process in succession: {place} with a time constant of {time}."


EFFECT = Effect(
    "extra_lag",
    "a further pole follows or precedes the process",
    extend,
    describe,
)
