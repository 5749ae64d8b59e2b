"""Sensor drift: the output is shown with an offset that moves, ``y = w + b1 (time / T) + b2 (time / T)^2``.

T is the length of the record.  An offset at the start is `sensor_bias`.  Where a linear plant integrates, a straight
drift is an `input_bias` under another name, and is not offered.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import sympy

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.clock import with_clock
from smid.diagnosis.effects.parts.naming import free_name, fresh, quantity
from smid.diagnosis.effects.parts.plant import is_linear, state_lines
from smid.models import Model
from smid.models.symbols import number

__all__ = ["EFFECT"]


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Put a straight and a bent drift at the sensor."""
    size = 2 * site.scale(site.output)
    unit = site.unit(site.output)
    linear = fresh(model, "sensor_drift_linear", (-size, size), unit, 0.0)
    bent = fresh(model, "sensor_drift_bent", (-size, size), unit, 0.0)
    timed, now = with_clock(model, site.sampling_time)
    share: sympy.Expr = now / number(site.duration)
    name = free_name(timed, f"{site.output}_joined")
    straight = linear.symbol * share
    if not (is_linear(model) and any(state.leak == 0 for state in state_lines(model))):
        yield Extension(
            timed.insert_sensor(site.output, lambda w: w + straight, [linear], new_name=name),
            ({linear.name: 0.05 * size}, {linear.name: -0.05 * size}),
            "straight",
        )
    curved = straight + bent.symbol * share**2
    yield Extension(
        timed.insert_sensor(site.output, lambda w: w + curved, [linear, bent], new_name=name),
        ({linear.name: 0.05 * size, bent.name: 0.05 * size}, {linear.name: 0.05 * size, bent.name: -0.1 * size}),
        "bent",
    )


def describe(values: Mapping[str, float], site: Site) -> str:
    """Say how far it goes over the record."""
    end = quantity(sum(values.values()), site.unit(site.output))
    return f"The sensor of {site.output} drifts by {end} over {quantity(site.duration, 's')}."


EFFECT = Effect(
    "sensor_drift",
    "the sensor shows an offset that moves",
    extend,
    describe,
)
