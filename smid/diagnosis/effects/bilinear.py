"""Bilinear: a channel multiplies a state, ``d/dt w = ... + c v w``, or the input, ``u -> u + c v u``.

The flow through an exchanger carries heat in proportion to a temperature; a flow times a temperature difference is a
product of both kinds. The channel v is the input itself, another input, or another channel of the record. c is zero
without the effect.

In a difference equation of order one the product acts along the step: ``w[t] = e f(e w[t-1])`` with ``e = exp(c v /
2)``, half the growth before and half after the rest (Strang's splitting). In one of order two the product is a force
that is held as the input is, ``u[t-k] -> u[t-k] + c v[t-k] m``, with m the mean of the state over that step.
References: Mohler, Bilinear Control Processes (1973); Strang, SIAM Journal on Numerical Analysis 5 (1968) 506-517.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial

import sympy

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.channels import further
from smid.diagnosis.effects.parts.naming import free_name, fresh, quantity, read_channel, signal_of
from smid.diagnosis.effects.parts.plant import StateLine, entries, shown_at, state_lines
from smid.models import Model, Parameter, signal, t
from smid.models.symbols import swapped

__all__ = ["EFFECT"]

_MOST = 2.0  # of the state per sample, or of the input, at the channel's largest
_SHARES = (0.02, -0.02)


def extend(base: Model, site: Site) -> Iterator[Extension]:
    """Multiply each state by each channel, and the input by each other channel."""
    low, high = site.span(site.input)
    own = [site.input] if low < high else []
    for channel in (*own, *(name for name, *_ in further(base, site))):
        model, name = read_channel(base, channel)
        most = _MOST / site.scale(channel)
        for state in state_lines(model):
            if isinstance(state.line.expression, sympy.Indexed):
                continue  # a position, whose rate is its speed
            label = f"{channel} times {state.own}"
            # An input multiplies as it acts on the state: behind a delay or a dead zone of it, if there is one.
            acting = next(iter(entries(model, state, name)), name)
            if force := _force(model, site, state, acting):
                size = most * site.scale(site.input) / site.scale(shown_at(model, site, state))
                factor = fresh(model, f"{state.own}_{site.input}_bilinear", (-size, size), "", 0.0)
                yield Extension(
                    model.add_term(state.line.signal, factor.symbol * force, [factor]),
                    tuple({factor.name: share * size} for share in _SHARES),
                    label,
                    describe=partial(_as_force, channel, state.own),
                )
                continue
            if any(_force(model, replace(site, input=other), state, acting) for other in model.input_channels):
                continue  # offered there
            per, time = (site.sampling_time, "s") if state.line.rate else (1.0, "sample")
            factor = fresh(model, f"{state.own}_bilinear", (-most / per, most / per), "", 0.0)
            yield Extension(
                _multiplied(model, state, factor, signal(acting)[t - state.lag]),
                tuple({factor.name: share * most / per} for share in _SHARES),
                label,
                describe=partial(_of_state, channel, state.own, time),
            )
        if channel != site.input:
            factor = fresh(model, "input_bilinear", (-most, most), "", 0.0)
            yield Extension(
                _with_input(model, site, name, factor),
                tuple({factor.name: share * most} for share in _SHARES),
                f"{channel} times {site.input}",
                describe=partial(_of_input, channel),
            )


def _multiplied(model: Model, state: StateLine, factor: Parameter, v: sympy.Expr) -> Model:
    """Add a channel times the state to the state's line."""
    line = state.line
    if line.rate or state.order > 1:
        return model.add_term(line.signal, factor.symbol * v * state.level, [factor])
    grown = sympy.exp(factor.symbol * v / 2)
    early = swapped(line.expression, {state.level: grown * state.level})
    return model.replace_line(line.signal, early, [factor]).insert_after(line.signal, lambda w: grown * w)


def _force(model: Model, site: Site, state: StateLine, name: str) -> sympy.Expr | None:
    """Return what the product of a channel and a state of order two adds, where it enters as the input does."""
    if state.line.rate or state.order != 2:
        return None
    w, v, force = signal(state.own), signal(name), sympy.S.Zero
    for read in entries(model, state, signal_of(model, site.input)):
        u = signal(read)
        for lag in sorted({lag for other, lag in state.line.reads if other == read and lag > 0}):
            mean = (3 * w[t - 1] - w[t - 2]) / 2 if lag == 1 else (w[t - lag] + w[t - lag + 1]) / 2
            force += state.coefficient(u[t - lag]) * v[t - lag] * mean
    return force or None


def _with_input(model: Model, site: Site, name: str, factor: Parameter) -> Model:
    joined = free_name(model, f"{site.input}_joined")
    v = signal(name)[t]
    return model.insert_before(site.input, lambda u: u * (1 + factor.symbol * v), [factor], new_name=joined)


def _of_state(channel: str, state: str, time: str, values: Mapping[str, float], site: Site) -> str:
    (factor,) = values.values()
    per = f" per {site.unit(channel)}" if site.unit(channel) else ""
    size = f"{quantity(factor, f'1/{time}')}{per}"
    return f"{channel} multiplies {state}, which grows at the rate of {channel} times {size}."


def _as_force(channel: str, state: str, values: Mapping[str, float], site: Site) -> str:
    (factor,) = values.values()
    return f"{channel} multiplies {state}: the product of both acts along with {site.input}, times {factor:.3g}."


def _of_input(channel: str, values: Mapping[str, float], site: Site) -> str:
    (factor,) = values.values()
    size = quantity(factor, f"per {site.unit(channel)}" if site.unit(channel) else "")
    return f"{channel} multiplies {site.input}: the product of both acts along with {site.input}, times {size}."


EFFECT = Effect(
    "bilinear",
    "an input or another channel multiplies a state, or the input",
    extend,
    needs="a state, and a channel that moves",
)
