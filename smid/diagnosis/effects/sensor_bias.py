"""Sensor bias: the output is shown with a constant offset, ``y = w + b``. One of the input is `input_bias`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.naming import free_name, fresh, quantity
from smid.models import Model

__all__ = ["EFFECT"]


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Put it at the sensor."""
    size = 2 * site.scale(site.output)
    bias = fresh(model, "sensor_bias", (-size, size), site.unit(site.output), 0.0)
    name = free_name(model, f"{site.output}_joined")
    yield Extension(
        model.insert_sensor(site.output, lambda w: w + bias.symbol, [bias], new_name=name),
        ({bias.name: 0.05 * size}, {bias.name: -0.05 * size}),
    )


def describe(values: Mapping[str, float], site: Site) -> str:
    """Say how large it is."""
    (bias,) = values.values()
    return f"The sensor of {site.output} shows {quantity(bias, site.unit(site.output))} where there is nothing."


EFFECT = Effect(
    "sensor_bias",
    "the sensor shows an offset",
    extend,
    describe,
)
