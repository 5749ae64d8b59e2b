"""Resonance: a swing of frequency omega and damping ratio zeta, in series before or after the process, or beside it.

With rho = exp(-zeta omega Ts) and c = cos(omega Ts sqrt(1 - zeta^2)),

    r[t] = 2 rho c r[t-1] - rho^2 r[t-2] + (1 - 2 rho c + rho^2) ((1 - f) x[t] + f x[t-1])

has unit gain at rest. In series ``x + k (r - x)`` takes the place of the input or of the output x; beside the process
the pair is driven by the input, and its last two samples are added with weights. Weights are null at 0. The damping
stays below 0.7: beyond it nothing swings, and a pair of real poles is another effect. Searches start at the strongest
peaks of the residual's spectrum. Reference: Oppenheim and Schafer, Discrete-Time Signal Processing, 3rd ed. (2010),
section 5.3.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping

import sympy

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.naming import find, free_name, fresh, quantity, signal_of
from smid.diagnosis.effects.parts.spectrum import peaks
from smid.models import Model, Parameter, signal, t
from smid.models.symbols import number

__all__ = ["EFFECT"]

_DAMPING = (0.002, 0.6)
_TRIED = (0.05, 0.3)


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Put it before the input, at the sensor, and beside the process."""
    frequencies = peaks(site, 3)
    if frequencies:
        yield _in_series(model, site, frequencies, site.input, model.insert_before, "at the input")
        yield _in_series(model, site, frequencies, site.output, model.insert_sensor, "at the sensor")
        yield _beside(model, site, frequencies)


def _shape(model: Model, site: Site, stem: str) -> tuple[Parameter, Parameter]:
    """Return frequency, two periods within the record at least, and damping ratio."""
    box = (4 * math.pi / site.duration, 0.9 * math.pi / site.sampling_time)
    return fresh(model, f"{stem}_frequency", box, "rad/s"), fresh(model, f"{stem}_damping", _DAMPING)


def _pair(frequency: Parameter, damping: Parameter, name: str, step: float, x: sympy.Expr) -> sympy.Expr:
    """Return the right side of the pair with unit gain, driven by x."""
    angle = frequency.symbol * number(step)
    rho = sympy.exp(-damping.symbol * angle)
    turn = 2 * rho * sympy.cos(angle * sympy.sqrt(1 - damping.symbol**2))
    r = signal(name)
    return turn * r[t - 1] - rho**2 * r[t - 2] + (1 - turn + rho**2) * x


def _starts(frequencies: tuple[float, ...], shape: tuple[Parameter, Parameter]) -> list[dict[str, float]]:
    low, high = shape[0].lower, shape[0].upper
    return [
        {shape[0].name: min(max(omega, low), high), shape[1].name: zeta} for omega in frequencies for zeta in _TRIED
    ]


def _ringing(damping: Parameter) -> dict[str, tuple[float, float]]:
    """Refuse the upper end of the damping: a pair that does not ring is two lags."""
    return {damping.name: (0.0, damping.upper - 0.02 * (damping.upper - damping.lower))}


def _in_series(
    model: Model, site: Site, frequencies: tuple[float, ...], channel: str, insert: Callable[..., Model], label: str
) -> Extension:
    shape = _shape(model, site, "pair")
    weight, share = fresh(model, "pair_weight", (0, 2), "", 0.0), fresh(model, "pair_share", (0, 1))
    pair = free_name(model, f"{channel}_pair")
    raw = signal(signal_of(model, channel))
    f = share.symbol
    driven = _pair(*shape, pair, site.sampling_time, (1 - f) * raw[t] + f * raw[t - 1])
    joined = insert(
        channel,
        lambda x: x + weight.symbol * (signal(pair)[t] - x),
        [weight],
        new_name=free_name(model, f"{channel}_joined"),
    )
    starts = tuple({**s, weight.name: 1.0, share.name: 0.5} for s in _starts(frequencies, shape))
    return Extension(joined.with_line(pair, driven, [*shape, share]), starts, label, _ringing(shape[1]))


def _beside(model: Model, site: Site, frequencies: tuple[float, ...]) -> Extension:
    shape = _shape(model, site, "mode")
    weights = [fresh(model, f"mode_weight_{which}", (-10, 10), "", 0.0) for which in ("late", "later")]
    mode = free_name(model, f"{site.input}_mode")
    u = signal(signal_of(model, site.input))[t]
    scale = number(site.scale(site.output) / site.scale(site.input))
    x = signal(mode)
    extended = model.with_line(mode, _pair(*shape, mode, site.sampling_time, u), list(shape)).insert_sensor(
        site.output,
        lambda w: w + scale * (weights[0].symbol * x[t - 1] + weights[1].symbol * x[t - 2]),
        weights,
        new_name=free_name(model, f"{site.output}_joined"),
    )
    first, second = (weight.name for weight in weights)
    starts = tuple({**s, first: 0.1, second: -0.1} for s in _starts(frequencies, shape))
    return Extension(extended, starts, "beside the process", _ringing(shape[1]))


def describe(values: Mapping[str, float], site: Site) -> str:
    """Say the frequency and the damping ratio."""
    kind = "pair" if find(values, "pair_frequency") is not None else "mode"
    hertz = (find(values, f"{kind}_frequency") or 0.0) / (2 * math.pi)
    damping = find(values, f"{kind}_damping") or 0.0
    return f"{site.output} swings at {quantity(hertz, 'Hz')} with a damping ratio of {damping:.2g}."


EFFECT = Effect(
    "resonance",
    "a complex pole pair swings with the process",
    extend,
    describe,
)
