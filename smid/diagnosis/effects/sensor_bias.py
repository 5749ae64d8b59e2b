"""Sensor bias: the output is shown with a constant offset, ``y = w + b``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.naming import find, free_name, fresh, quantity
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
    bias = quantity(find(values, "sensor_bias") or 0.0, site.unit(site.output))
    return f"The sensor of {site.output} shows {bias} where there is nothing."


EFFECT = Effect(
    "sensor_bias",
    "the sensor shows an offset",
    extend,
    describe,
    rivals=("sensor_drift", "missing_input", "input_curve", "output_curve"),
)
