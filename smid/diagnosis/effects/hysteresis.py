"""Hysteresis: a rate-independent memory, before the process or at the sensor.

*Bouc-Wen* with n = 1 and gamma = 0 (Dahl): dz = r (dx - |dx| z), solved over a sample,
``z[t] = s + (z[t-1] - s) exp(-r |dx|)`` with s = sign(dx), so that z stays in [-1, 1] however far x jumps;
``x' = x + k z``, k = 0 without the effect.

*Prandtl-Ishlinskii*: ``x' = x + sum_i c_i (play_i(x) - x)`` over plays of six gaps up to the span, written with
stop operators. Their shares follow a density, ``c_i ~ c exp(-d g_i)`` for a gap of the share g_i of the span and
c in all, c = 0 without it: two parameters for a loop that bends at every turn, however small the turn. At first every
play is in the middle of its gap.

Either loop keeps the ends of the recorded range: the part of the range that it removes is restored about the middle,
``x'' = m + (x' - m) / (1 - share of the range taken)``.

A *measured* third channel, the displacement where the input is a speed, may be what is remembered: then z follows it
and acts at the sensor, ``y = w + k z``, as dry friction with a spring in the contact does.

References: Wen, J. Eng. Mech. Div. ASCE 102 (1976) 249-263; Dahl, AIAA Journal 14 (1976) 1675-1682; Brokate and
Sprekels, Hysteresis and Phase Transitions (1996), sections 2.3 and 2.4; the density: Al Janaideh, Rakheja and Su,
IEEE/ASME Transactions on Mechatronics 16 (2011) 734-744.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from math import exp

import sympy

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.channels import further
from smid.diagnosis.effects.parts.naming import find, free_name, fresh, quantity, read_channel, signal_of
from smid.diagnosis.effects.parts.stop import stop
from smid.models import Model, Parameter, signal, t
from smid.models.symbols import number

__all__ = ["EFFECT"]

_GAPS = tuple((k + 0.5) / 6 for k in range(6))


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Put each kind before the input and at the sensor."""
    for channel, stem in ((site.input, "input"), (site.output, "output")):
        low, high = site.span(channel)
        if low < high:
            yield _bouc_wen(model, channel, stem, low, high, site.unit(channel))
            yield _prandtl_ishlinskii(model, channel, stem, low, high)
    for channel, low, high in further(model, site):
        yield _of_channel(model, site, channel, high - low)


def _put(
    model: Model, channel: str, stem: str, loop: Callable[[sympy.Expr], sympy.Expr], parameters: list[Parameter]
) -> Model:
    """Put a loop on the input before its readers, or on what the sensor sees."""
    name = free_name(model, f"{channel}_joined")
    insert = model.insert_before if stem == "input" else model.insert_sensor
    return insert(channel, loop, parameters, new_name=name)


def _bouc_wen(model: Model, channel: str, stem: str, low: float, high: float, unit: str) -> Extension:
    span, middle = high - low, number((low + high) / 2)
    width = fresh(model, f"{stem}_loop_width", (-0.45 * span, span), unit, 0.0)
    rate = fresh(model, f"{stem}_loop_rate", (0.5 / span, 200 / span))
    name = free_name(model, f"{channel}_memory")
    x, z = signal(signal_of(model, channel)), signal(name)
    kept = 1 + 2 * width.symbol / number(span)
    extended = _put(model, channel, stem, lambda v: middle + (v - middle + width.symbol * z[t]) / kept, [width, rate])
    # Added after the insertion, the memory reads the raw signal.
    extended = extended.with_line(name, _memory(x, z, rate))
    starts = tuple({width.name: k * span, rate.name: r / span} for k in (-0.1, 0.1) for r in (5.0, 20.0))
    return Extension(extended, starts, f"Bouc-Wen at the {stem}")


def _of_channel(base: Model, site: Site, channel: str, span: float) -> Extension:
    model, remembered = read_channel(base, channel)
    low, high = site.span(site.output)
    width = fresh(model, f"{channel}_loop_width", (low - high, high - low), site.unit(site.output), 0.0)
    rate = fresh(model, f"{channel}_loop_rate", (0.5 / span, 200 / span))
    name = free_name(model, f"{channel}_memory")
    extended = _put(model, site.output, "output", lambda w: w + width.symbol * signal(name)[t], [width, rate])
    extended = extended.with_line(name, _memory(signal(remembered), signal(name), rate))
    size = high - low
    starts = tuple({width.name: k * size, rate.name: r / span} for k in (0.2, -0.2) for r in (5.0, 20.0))
    described = partial(_describe_channel, channel, width.name)
    return Extension(extended, starts, f"Bouc-Wen of {channel}", describe=described)


def _memory(x: sympy.IndexedBase, z: sympy.IndexedBase, rate: Parameter) -> sympy.Expr:
    """Solve dz = r (dx - |dx| z) over a sample."""
    move = x[t] - x[t - 1]
    end = sympy.sign(move)
    return end + (z[t - 1] - end) * sympy.exp(-rate.symbol * sympy.Abs(move))


def _prandtl_ishlinskii(model: Model, channel: str, stem: str, low: float, high: float) -> Extension:
    span, middle = high - low, number((low + high) / 2)
    share = fresh(model, f"{stem}_play_share", (-2.0, 0.98), "", 0.0)
    decay = fresh(model, f"{stem}_play_decay", (-6.0, 6.0))
    x = signal(signal_of(model, channel))
    names = [free_name(model, f"{channel}_{letter}_stop") for letter in "abcdef"]
    densities = [sympy.exp(-decay.symbol * number(gap)) for gap in _GAPS]
    back = sum(density * signal(name)[t] for density, name in zip(densities, names, strict=True)) / sum(densities)
    taken = sum(density * number(gap) for density, gap in zip(densities, _GAPS, strict=True)) / sum(densities)
    extended = _put(
        model,
        channel,
        stem,
        lambda v: middle + (v - middle - share.symbol * back) / (1 - share.symbol * taken),
        [share, decay],
    )
    for name, gap in zip(names, _GAPS, strict=True):
        extended = extended.with_line(name, stop(x, signal(name), number(gap * span / 2)))
    starts = tuple({share.name: c, decay.name: 0.0} for c in (0.3, 0.7, -0.5))
    return Extension(extended, starts, f"Prandtl-Ishlinskii at the {stem}")


def _describe_channel(channel: str, width: str, values: Mapping[str, float], site: Site) -> str:
    size = quantity(2 * abs(values[width]), site.unit(site.output))
    return f"{site.output} depends on the way that {channel} came: a loop {size} wide that does not depend on speed."


def describe(values: Mapping[str, float], site: Site) -> str:
    """Say how wide the loop is, and where."""
    at_input = any(name.startswith("input") for name in values)
    channel = site.input if at_input else site.output
    low, high = site.span(channel)
    width = find(values, "loop_width")
    if width is None:
        share, decay = find(values, "play_share") or 0.0, find(values, "play_decay") or 0.0
        density = [exp(-decay * gap) for gap in _GAPS]
        width = share * (high - low) / 2 * sum(d * g for d, g in zip(density, _GAPS, strict=True)) / sum(density)
    size = quantity(2 * abs(width), site.unit(channel))
    way = "acts" if at_input else "shows"
    return f"{channel} {way} differently on the way up and down: a loop {size} wide that does not depend on speed."


EFFECT = Effect(
    "hysteresis",
    "a memory between input and output that does not depend on speed",
    extend,
    describe,
    needs="a signal that moves",
)
