"""Hysteresis: a memory that does not depend on how fast, before the process or behind it.

*Bouc-Wen* with n = 1 and gamma = 0 (Dahl): dz = r (dx - |dx| z), solved over a sample,
``z[t] = s + (z[t-1] - s) exp(-r |dx|)`` with s = sign(dx), so that z stays in [-1, 1] however far x jumps;
``x' = x + k z``, k = 0 without the effect.

*Prandtl-Ishlinskii*: ``x' = x + sum_i c_i (play_i(x) - x)`` with gaps of 20, 50 and 90 % of the span, c_i = 0 without
it, written with what each play keeps back.

A *measured* third channel, the displacement where the input is a speed, may be what is remembered: then z follows it
and acts at the sensor, ``y = w + k z``, as dry friction with a spring in the contact does.

References: Wen, J. Eng. Mech. Div. ASCE 102 (1976) 249-263; Dahl, AIAA Journal 14 (1976) 1675-1682; Brokate and
Sprekels, Hysteresis and Phase Transitions (1996), sections 2.3 and 2.4.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import sympy

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.naming import find, free_name, fresh, quantity, signal_of
from smid.diagnosis.effects.stop import stop
from smid.models import Model, Parameter, signal, t
from smid.models.symbols import number

__all__ = ["EFFECT"]

_RADII = (0.10, 0.25, 0.45)


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Put each kind before the input and at the sensor."""
    for channel, stem in ((site.input, "input"), (site.output, "output")):
        low, high = site.span(channel)
        if low < high:
            yield _bouc_wen(model, site, channel, stem, high - low)
            yield _prandtl_ishlinskii(model, channel, stem, high - low)
    for channel in site.other_channels:
        low, high = site.span(channel)
        if low < high:
            yield _of_channel(model, site, channel, high - low)


def _put(model: Model, channel: str, stem: str, change: sympy.Expr, parameters: list[Parameter]) -> Model:
    """Add a change to the input before its readers, or to what the sensor sees."""
    name = free_name(model, f"{channel}_joined")
    if stem == "input":
        return model.insert_before(channel, lambda x: x + change, parameters, new_name=name)
    return model.insert_sensor(channel, lambda x: x + change, parameters, new_name=name)


def _bouc_wen(model: Model, site: Site, channel: str, stem: str, span: float) -> Extension:
    width = fresh(model, f"{stem}_loop_width", (-span, span), site.unit(channel), 0.0)
    rate = fresh(model, f"{stem}_loop_rate", (0.5 / span, 200 / span))
    name = free_name(model, f"{channel}_memory")
    x, z = signal(signal_of(model, channel)), signal(name)
    extended = _put(model, channel, stem, width.symbol * z[t], [width, rate])
    # Added behind, the memory follows the raw signal and not its own effect.
    extended = extended.with_line(name, _memory(x, z, rate))
    starts = tuple({width.name: k * span, rate.name: r / span} for k in (-0.1, 0.1) for r in (5.0, 20.0))
    return Extension(extended, starts, f"Bouc-Wen at the {stem}")


def _of_channel(model: Model, site: Site, channel: str, span: float) -> Extension:
    low, high = site.span(site.output)
    width = fresh(model, f"{channel}_loop_width", (low - high, high - low), site.unit(site.output), 0.0)
    rate = fresh(model, f"{channel}_loop_rate", (0.5 / span, 200 / span))
    name = free_name(model, f"{channel}_memory")
    extended = _put(model, site.output, "output", width.symbol * signal(name)[t], [width, rate])
    extended = extended.with_line(name, _memory(signal(signal_of(model, channel)), signal(name), rate))
    size = high - low
    starts = tuple({width.name: k * size, rate.name: r / span} for k in (0.2, -0.2) for r in (5.0, 20.0))
    return Extension(extended, starts, f"Bouc-Wen of {channel}")


def _memory(x: sympy.IndexedBase, z: sympy.IndexedBase, rate: Parameter) -> sympy.Expr:
    """Solve dz = r (dx - |dx| z) over a sample."""
    move = x[t] - x[t - 1]
    end = sympy.sign(move)
    return end + (z[t - 1] - end) * sympy.exp(-rate.symbol * sympy.Abs(move))


def _prandtl_ishlinskii(model: Model, channel: str, stem: str, span: float) -> Extension:
    x = signal(signal_of(model, channel))
    shares = [fresh(model, f"{stem}_play_share_{'abc'[k]}", (-2, 2), "", 0.0) for k in range(len(_RADII))]
    change: sympy.Expr = sympy.Integer(0)
    lines: list[tuple[str, sympy.Expr]] = []
    for share, radius in zip(shares, _RADII, strict=True):
        name = free_name(model, f"{channel}_{'abc'[len(lines)]}_stop")
        lines.append((name, stop(x, signal(name), number(radius * span))))
        change -= share.symbol * signal(name)[t]
    extended = _put(model, channel, stem, change, shares)
    for name, line in lines:
        extended = extended.with_line(name, line)
    starts = tuple(dict.fromkeys((share.name for share in shares), value) for value in (0.2, 0.4, -0.2))
    return Extension(extended, starts, f"Prandtl-Ishlinskii at the {stem}")


def describe(values: Mapping[str, float], site: Site) -> str:
    """Say how wide the loop is, and where."""
    other = next((c for c in site.other_channels if f"{c}_loop_width" in "".join(values)), None)
    if other is not None:
        size = quantity(2 * abs(find(values, "loop_width") or 0.0), site.unit(site.output))
        return f"{site.output} depends on the way that {other} came: a loop {size} wide that does not depend on speed."
    at_input = any(name.startswith("input") for name in values)
    channel = site.input if at_input else site.output
    width = find(values, "loop_width")
    if width is None:
        low, high = site.span(channel)
        width = abs(sum(values[name] * radius for name, radius in zip(sorted(values), _RADII, strict=False))) * (
            high - low
        )
    size = quantity(2 * abs(width), site.unit(channel))
    way = "acts" if at_input else "shows"
    return f"{channel} {way} differently on the way up and down: a loop {size} wide that does not depend on speed."


EFFECT = Effect(
    "hysteresis",
    "a memory between input and output that does not depend on speed",
    extend,
    describe,
    rivals=("input_backlash", "extra_lag", "direction_dependence", "coulomb_friction"),
    contains=("input_backlash",),
    needs="a signal that moves",
)
