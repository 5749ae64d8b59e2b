"""Inner curve: a static nonlinearity between two dynamic blocks (Wiener-Hammerstein).

A lag of order one and a curve come on top of the model: the lag, then the curve, before the input; or the curve, then
the lag, at the sensor. The lag is that of `smid.diagnosis.effects.parts.lag`. The curve is a *saturation*; a *dead
zone* about zero; or that of a *diode*, which blocks the share c of what is beyond a knee q: for c > 0 below it, for c <
0 above, ``x + min(c, 0) max(0, x - q) - max(c, 0) min(0, x - q)``, moved so that zero stays zero. Without the effect
the limits lie one span beyond the signal, and thresholds, share and pole are zero. A knee near an end of the span is
none: the diode would be a gain.
References: Billings and Fakhouri, Automatica 18 (1982) 15-26; Schoukens and Tiels, Automatica 85 (2017) 272-292;
Schoukens, Suykens and Ljung, 15th IFAC Symposium on System Identification (2009) (a diode between two filters).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial

import sympy

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.extremes import larger, smaller
from smid.diagnosis.effects.parts.lag import lag_line, lag_parameters, time_constant, with_memory
from smid.diagnosis.effects.parts.naming import find, free_name, fresh, quantity, signal_of
from smid.models import Model, Parameter

__all__ = ["EFFECT"]

_POLES = (0.6, 0.9)
_SHARES = (0.15, 0.3)  # of the span
_END = 0.1  # of the span

_Map = Callable[[sympy.Expr], sympy.Expr]
_Lag = tuple[Parameter, Parameter]


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Put each curve behind a lag of the input, and before a lag at the sensor."""
    for channel, stem, put in ((site.input, "input", _behind_a_lag), (site.output, "sensor", _before_a_lag)):
        lag = lag_parameters(model, f"inner_{stem}")
        pole, share = lag
        for label, curve, parameters, starts, inside in _curves(model, site, channel):
            yield Extension(
                put(model, channel, curve, parameters, lag),
                tuple({**start, pole.name: p, share.name: 0.5} for start in starts for p in _POLES),
                f"{label} at the {stem}",
                {**inside, **with_memory(pole)},
                describe=partial(_describe, channel, stem),
            )


def _behind_a_lag(model: Model, channel: str, curve: _Map, parameters: list[Parameter], lag: _Lag) -> Model:
    raw, name, bent = signal_of(model, channel), free_name(model, f"{channel}_lag"), free_name(model, f"{channel}_bent")
    curved = model.insert_before(channel, curve, parameters, new_name=bent)
    return curved.insert_before(channel, lambda _: lag_line(*lag, name, raw), lag, new_name=name)


def _before_a_lag(model: Model, channel: str, curve: _Map, parameters: list[Parameter], lag: _Lag) -> Model:
    name, bent = free_name(model, f"{channel}_lag"), free_name(model, f"{channel}_bent")
    curved = model.insert_sensor(channel, curve, parameters, new_name=bent)
    return curved.insert_sensor(channel, lambda _: lag_line(*lag, name, bent), lag, new_name=name)


def _curves(
    model: Model, site: Site, channel: str
) -> Iterator[tuple[str, _Map, list[Parameter], list[dict[str, float]], dict[str, tuple[float, float]]]]:
    """Yield each curve: label, map, parameters, where a fit may begin, and where it must end."""
    low, high = site.span(channel)
    unit, span = site.unit(channel), high - low
    if not span:
        return
    bottom = fresh(model, "inner_limit_lower", (low - span, high), unit, low - span)
    top = fresh(model, "inner_limit_upper", (low, high + span), unit, high + span)
    yield (
        "saturation",
        lambda x: larger(bottom.symbol, smaller(top.symbol, x)),
        [bottom, top],
        [{bottom.name: low + share * span, top.name: high - share * span} for share in _SHARES],
        {},
    )
    knee = fresh(model, "inner_knee", (low, high), unit)
    blocked = fresh(model, "inner_blocked", (-1, 1), "", 0.0)
    q, above, below = knee.symbol, smaller(blocked.symbol, 0), larger(blocked.symbol, 0)

    def diode(x: sympy.Expr) -> sympy.Expr:
        up, down = (f(0, x - q) - f(0, -q) for f in (sympy.Max, sympy.Min))
        return x + above * up - below * down

    middle = (low + high) / 2
    yield (
        "diode",
        diode,
        [blocked, knee],
        [{blocked.name: c, knee.name: middle} for c in (0.6, -0.6)],
        {knee.name: (low + _END * span, high - _END * span)},
    )
    ends = {"upper": high, "lower": low}
    zone = {
        end: fresh(model, f"inner_zone_{end}", (min(0, value), max(0, value)), unit, 0.0)
        for end, value in ends.items()
        if (value > 0) == (end == "upper") and value
    }
    upper, lower = (zone[end].symbol if end in zone else sympy.S.Zero for end in ends)
    yield (
        "dead zone",
        lambda x: larger(0, x - upper) + smaller(0, x - lower),
        list(zone.values()),
        [{p.name: share * ends[end] for end, p in zone.items()} for share in _SHARES],
        {},
    )


def _describe(channel: str, stem: str, values: Mapping[str, float], site: Site) -> str:
    unit = site.unit(channel)
    time = quantity(time_constant(find(values, f"inner_{stem}_pole") or 0.0, site), "s")
    where = f"behind a lag of {channel}" if stem == "input" else f"before a lag of the sensor of {channel}"
    return f"A curve lies {where} of {time}: {_law(values, unit)}."


def _law(values: Mapping[str, float], unit: str) -> str:
    bottom, top = find(values, "inner_limit_lower"), find(values, "inner_limit_upper")
    blocked, knee = find(values, "inner_blocked"), find(values, "inner_knee")
    if bottom is not None and top is not None:
        return f"a saturation at {bottom:.3g} and {quantity(top, unit)}"
    if blocked is not None and knee is not None:
        side = "below" if blocked > 0 else "above"
        return f"a diode blocks {abs(blocked):.0%} of what is {side} {quantity(knee, unit)}"
    ends = [find(values, f"inner_zone_{end}") or 0.0 for end in ("lower", "upper")]
    return f"a dead zone from {ends[0]:.3g} to {quantity(ends[1], unit)}"


EFFECT = Effect(
    "inner_curve",
    "a saturation, dead zone or diode between two lags",
    extend,
    needs="an input or an output that moves",
)
