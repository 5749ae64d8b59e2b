"""Hysteresis: a rate-independent memory, before the process or at the sensor.

*Bouc-Wen* with n = 1 and gamma = 0 (Dahl): dz = r (dx - |dx| z), solved over a sample,
``z[t] = s + (z[t-1] - s) exp(-r |dx|)`` with s = sign(dx), so that z stays in [-1, 1] however far x jumps;
``x' = x + k z``, k = 0 without the effect.

*Preisach*: relays that switch up at one level of x and down at a lower one, both between two ends. With a density that
depends on the distance of the two levels only, the mean of the relays is a mean of plays that the ends limit:

    xi  = (x - m) / h, kept in [-1, 1]            m, h: middle and half of the range between the ends
    w_i = play of xi with the gap 2 g_i, kept in [g_i - 1, 1 - g_i]
    x'  = x + sum_i c_i (m + h w_i - x)

The shares are ``c_i ~ c exp(-d g_i)`` for ten g_i in (0, 1), c in all, c = 0 without the effect; d = 0 is the
uniform density. The ends need not be those of the record: relays whose levels it does not reach stay as they were. At
first every play is in the middle of its gap, as far as the ends let it. The plays are written with stop operators.

Either loop keeps the ends of the recorded range: the part of the range that it removes is restored about the middle,
``x'' = m + (x' - m) / (1 - share of the range taken)``.

A *measured* third channel, the displacement where the input is a speed, may be what is remembered: then z follows it
and acts at the sensor, ``y = w + k z``, as dry friction with a spring in the contact does.

References: Wen, J. Eng. Mech. Div. ASCE 102 (1976) 249-263; Dahl, AIAA Journal 14 (1976) 1675-1682; Brokate and
Sprekels, Hysteresis and Phase Transitions (1996), sections 2.2 to 2.4, relays and plays; the density: Al Janaideh,
Rakheja and Su, IEEE/ASME Transactions on Mechatronics 16 (2011) 734-744.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from math import exp

import sympy

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.channels import further
from smid.diagnosis.effects.parts.extremes import larger, smaller
from smid.diagnosis.effects.parts.naming import find, free_name, fresh, quantity, read_channel, signal_of
from smid.models import Model, Parameter, signal, t
from smid.models.symbols import number

__all__ = ["EFFECT"]

_PLAYS = 10
_GAPS = tuple((k + 0.5) / _PLAYS for k in range(_PLAYS))


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Put each kind before the input and at the sensor."""
    for channel, stem in ((site.input, "input"), (site.output, "output")):
        low, high = site.span(channel)
        if low < high:
            yield _bouc_wen(model, channel, stem, low, high, site.unit(channel))
            yield _preisach(model, channel, stem, low, high, site.unit(channel))
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


def _preisach(model: Model, channel: str, stem: str, low: float, high: float, unit: str) -> Extension:
    span = high - low
    share = fresh(model, f"{stem}_relay_share", (-2.0, 0.98), "", 0.0)
    # If relays far apart weighed most, hardly any would switch: a bias.
    decay = fresh(model, f"{stem}_relay_decay", (-1.0, 6.0))
    bottom = fresh(model, f"{stem}_relay_bottom", (low - span, low + 0.25 * span), unit)
    top = fresh(model, f"{stem}_relay_top", (high - 0.25 * span, high + span), unit)
    middle, half = (top.symbol + bottom.symbol) / 2, (top.symbol - bottom.symbol) / 2
    place = free_name(model, f"{channel}_place")
    stops = [free_name(model, f"{channel}_stop_{k + 1}") for k in range(_PLAYS)]
    densities = [sympy.exp(-decay.symbol * number(gap)) for gap in _GAPS]
    back = sum(density * signal(name)[t] for density, name in zip(densities, stops, strict=True)) / sum(densities)
    taken = sum(density * number(gap) for density, gap in zip(densities, _GAPS, strict=True)) / sum(densities)
    extended = _put(
        model,
        channel,
        stem,
        lambda v: middle + (v - middle - share.symbol * half * back) / (1 - share.symbol * taken),
        [share, decay, bottom, top],
    )
    # Added after the insertion, the memories read the raw signal.
    x, xi = signal(signal_of(model, channel)), signal(place)
    extended = extended.with_line(place, larger(-1, smaller(1, (x[t] - middle) / half)))
    for name, gap in zip(stops, map(number, _GAPS), strict=True):
        limited = larger(xi[t] - 1 + gap, smaller(xi[t] + 1 - gap, signal(name)[t - 1] + xi[t] - xi[t - 1]))
        extended = extended.with_line(name, larger(-gap, smaller(gap, limited)))
    starts = tuple(
        {share.name: c, decay.name: 0.0, bottom.name: low - beyond * span, top.name: high + beyond * span}
        for beyond in (0.02, 0.15)
        for c in (0.3, 0.8, -0.5)
    )
    return Extension(extended, starts, f"Preisach at the {stem}")


def _describe_channel(channel: str, width: str, values: Mapping[str, float], site: Site) -> str:
    size = quantity(2 * abs(values[width]), site.unit(site.output))
    return f"{site.output} depends on the way that {channel} came: a loop {size} wide that does not depend on speed."


def describe(values: Mapping[str, float], site: Site) -> str:
    """Say how wide the loop is, and where."""
    at_input = any(name.startswith("input") for name in values)
    channel = site.input if at_input else site.output
    width = find(values, "loop_width")
    if width is None:
        share, decay, bottom, top = (
            find(values, f"relay_{what}") or 0.0 for what in ("share", "decay", "bottom", "top")
        )
        density = [exp(-decay * gap) / sum(exp(-decay * other) for other in _GAPS) for gap in _GAPS]
        taken = sum(d * gap for d, gap in zip(density, _GAPS, strict=True))
        apart = sum(d * min(gap, 1 - gap) for d, gap in zip(density, _GAPS, strict=True))  # of the branches, midway
        width = share * apart / (1 - share * taken) * (top - bottom) / 2
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
