"""Missing input: another measured channel v drives the output too, in a state, at the sensor or through the input.

A channel that never comes near zero acts by its deviation from the mean: the rest is a bias.
Reference: Ljung, System Identification, 2nd ed. (1999), section 1.2 (measured disturbances).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

import sympy

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.channels import usable
from smid.diagnosis.effects.parts.naming import free_name, fresh, quantity
from smid.diagnosis.effects.parts.plant import state_lines
from smid.models import Model
from smid.models.symbols import number

__all__ = ["EFFECT"]

_START = 0.05


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Add each other channel to each state, to the sensor and to the input."""
    high, full = number(site.scale(site.output)), number(site.scale(site.input))
    for channel, middle, half, deviation in usable(model, site):
        shift = number(middle / half if abs(middle) < half else 0.0)
        for state in state_lines(model):
            # A rate is per second: what moves the state by b in a sample.
            per = number(site.sampling_time if state.line.rate else 1.0)
            weight = fresh(model, f"{channel}_missing_{state.own}", (-10, 10), "", 0.0)
            term = weight.symbol * high / per * (deviation(state.lag) + shift)
            extended = model.add_term(state.line.signal, term, [weight])
            yield Extension(extended, ({weight.name: 0.1 * _START},), f"{channel} in {state.own}")
        sensor = fresh(model, f"{channel}_missing_sensor", (-10, 10), "", 0.0)
        seen = deviation(0) + shift
        yield Extension(
            model.insert_sensor(
                site.output,
                _adding(sensor.symbol * high * seen),
                [sensor],
                new_name=free_name(model, f"{site.output}_joined"),
            ),
            ({sensor.name: _START},),
            f"{channel} at the sensor",
        )
        drive = fresh(model, f"{channel}_missing_input", (-10, 10), "", 0.0)
        yield Extension(
            model.insert_before(
                site.input,
                _adding(drive.symbol * full * seen),
                [drive],
                new_name=free_name(model, f"{site.input}_joined"),
            ),
            ({drive.name: _START},),
            f"{channel} with the input",
        )


def _adding(term: sympy.Expr) -> Callable[[sympy.Expr], sympy.Expr]:
    return lambda x: x + term


def describe(values: Mapping[str, float], site: Site) -> str:
    """Say which channel acts, where, and how much a half span of it does."""
    name, weight = next(iter(values.items()))
    channel, place = name.split("_missing_", 1)
    low, high = site.span(channel)
    change = quantity((high - low) / 2, site.unit(channel))
    if place.startswith("input"):
        effect = f"like {quantity(weight * site.scale(site.input), site.unit(site.input))} of {site.input}"
    else:
        effect = quantity(weight * site.scale(site.output), site.unit(site.output))
        effect += f" on {site.output}" if place.startswith("sensor") else f" per sample on {place}"
    return f"{channel} drives {site.output} too: {change} of it act {effect}."


EFFECT = Effect(
    "missing_input",
    "another measured channel drives the output",
    extend,
    describe,
    rivals=("scheduled_parameter", "sensor_drift", "periodic_disturbance", "parameter_change"),
    needs="a further measured channel that moves",
)
