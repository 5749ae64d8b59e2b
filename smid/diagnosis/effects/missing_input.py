"""Missing input: another measured channel v drives the output too, in a state, at the sensor or through the input.

At the sensor it may act through a lag of its own, as a disturbance does that takes another way through the process.

A channel that never comes near zero acts by its deviation from the mean: the rest is a bias. A channel in the unit of
the output may also exchange with the state: k (v - w), as a tank loses heat to its surroundings. Neither k v nor -k w
alone lowers the error as much, so the search would not find the two one after the other.
Reference: Ljung, System Identification, 2nd ed. (1999), sections 1.2 (measured disturbances) and 4.2 (Box-Jenkins).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial

import sympy

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.channels import usable
from smid.diagnosis.effects.parts.lag import POLES, lag_line, lag_parameters, time_constant
from smid.diagnosis.effects.parts.naming import free_name, fresh, quantity, signal_of
from smid.diagnosis.effects.parts.plant import output_signal, state_lines
from smid.models import Model, Parameter, signal, t
from smid.models.symbols import number

__all__ = ["EFFECT"]

_START = 0.05


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Add each other channel to each state, to the sensor and to the input."""
    high, full = number(site.scale(site.output)), number(site.scale(site.input))
    for reading, channel, middle, half, deviation in usable(model, site):
        shift = number(middle / half if abs(middle) < half else 0.0)
        for state in state_lines(reading):
            # A rate is per second: what moves the state by b in a sample.
            per = number(site.sampling_time if state.line.rate else 1.0)
            weight = fresh(reading, f"{channel}_missing_{state.own}", (-10, 10), "", 0.0)
            term = weight.symbol * high / per * (deviation(state.lag) + shift)
            extended = reading.add_term(state.line.signal, term, [weight])
            told = partial(_describe, channel, site.output, f"{{}} per sample on {state.own}")
            yield Extension(extended, ({weight.name: 0.1 * _START},), f"{channel} in {state.own}", describe=told)
            if site.unit(channel) == site.unit(site.output) and state.own == output_signal(reading, site):
                rate = fresh(reading, f"{channel}_exchange_{state.own}", (-1, 1), "", 0.0)
                difference = signal(signal_of(reading, channel))[t - state.lag] - signal(state.own)[t - state.lag]
                yield Extension(
                    reading.add_term(state.line.signal, rate.symbol / per * difference, [rate]),
                    ({rate.name: 0.1 * _START},),
                    f"{channel} minus {state.own}",
                    describe=partial(_describe_exchange, channel, site.output),
                )
        sensor, seen = fresh(reading, f"{channel}_missing_sensor", (-10, 10), "", 0.0), deviation(0) + shift
        joined = free_name(reading, f"{site.output}_joined")
        yield Extension(
            reading.insert_sensor(site.output, _adding(sensor.symbol * high * seen), [sensor], new_name=joined),
            ({sensor.name: _START},),
            f"{channel} at the sensor",
            describe=partial(_describe, channel, site.output, f"{{}} on {site.output}"),
        )
        lag, late = lag_parameters(reading, f"{channel}_missing"), free_name(reading, f"{channel}_late")
        behind = reading.with_line(late, lag_line(*lag, late, signal_of(reading, channel)), lag)
        reached = (signal(late)[t] - number(middle)) / number(half) + shift
        yield Extension(
            behind.insert_sensor(site.output, _adding(sensor.symbol * high * reached), [sensor], new_name=joined),
            tuple({sensor.name: _START, lag[0].name: pole, lag[1].name: 0.5} for pole in POLES),
            f"{channel} behind a lag at the sensor",
            describe=partial(_describe_late, channel, sensor, lag[0]),
        )
        drive = fresh(reading, f"{channel}_missing_input", (-10, 10), "", 0.0)
        yield Extension(
            reading.insert_before(
                site.input,
                _adding(drive.symbol * full * seen),
                [drive],
                new_name=free_name(reading, f"{site.input}_joined"),
            ),
            ({drive.name: _START},),
            f"{channel} with the input",
            describe=partial(_describe, channel, site.input, f"like {{}} of {site.input}"),
        )


def _adding(term: sympy.Expr) -> Callable[[sympy.Expr], sympy.Expr]:
    return lambda x: x + term


def _describe_late(channel: str, weight: Parameter, pole: Parameter, values: Mapping[str, float], site: Site) -> str:
    """Say the time constant too."""
    late = quantity(time_constant(values[pole.name], site), "s")
    where = f"{{}} on {site.output}, with a time constant of {late}"
    return _describe(channel, site.output, where, {weight.name: values[weight.name]}, site)


def _describe(channel: str, scaled: str, where: str, values: Mapping[str, float], site: Site) -> str:
    """Say how much half the span of the channel does, in the unit of the channel that the weight is scaled by."""
    (weight,) = values.values()
    low, high = site.span(channel)
    change = quantity((high - low) / 2, site.unit(channel))
    effect = quantity(weight * site.scale(scaled), site.unit(scaled))
    return f"{channel} drives {site.output} too: {change} of it act {where.format(effect)}."


def _describe_exchange(channel: str, output: str, values: Mapping[str, float], _site: Site) -> str:
    """Say how fast the output goes to the channel."""
    (rate,) = values.values()
    return f"{output} goes to {channel}: in each sample by {100 * rate:.3g} % of the difference."


EFFECT = Effect(
    "missing_input",
    "another measured channel drives the output",
    extend,
    needs="a further measured channel that moves",
)
