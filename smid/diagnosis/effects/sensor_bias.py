"""Sensor bias: the output is shown with a constant offset, ``y = w + b``, or the input, ``u + b`` acts.

The bias at the input is offered only where the plant integrates; elsewhere the two are equivalent.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.naming import find, free_name, fresh, quantity
from smid.diagnosis.effects.parts.plant import state_lines
from smid.models import Model

__all__ = ["EFFECT"]


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Put it at the sensor, and before the input."""
    size = 2 * site.scale(site.output)
    bias = fresh(model, "sensor_bias", (-size, size), site.unit(site.output), 0.0)
    name = free_name(model, f"{site.output}_joined")
    yield Extension(
        model.insert_sensor(site.output, lambda w: w + bias.symbol, [bias], new_name=name),
        ({bias.name: 0.05 * size}, {bias.name: -0.05 * size}),
        "at the output",
    )
    if any(state.leak == 0 for state in state_lines(model)):
        full = site.scale(site.input)
        push = fresh(model, "input_bias", (-full, full), site.unit(site.input), 0.0)
        name = free_name(model, f"{site.input}_joined")
        yield Extension(
            model.insert_before(site.input, lambda u: u + push.symbol, [push], new_name=name),
            ({push.name: 0.05 * full}, {push.name: -0.05 * full}),
            "at the input",
        )


def describe(values: Mapping[str, float], site: Site) -> str:
    """Say how large it is."""
    push = find(values, "input_bias")
    if push is not None:
        return f"A constant {quantity(push, site.unit(site.input))} acts along with {site.input}."
    bias = quantity(find(values, "sensor_bias") or 0.0, site.unit(site.output))
    return f"The sensor of {site.output} shows {bias} where there is nothing."


EFFECT = Effect(
    "sensor_bias",
    "the sensor shows an offset, or a constant acts along with the input",
    extend,
    describe,
)
