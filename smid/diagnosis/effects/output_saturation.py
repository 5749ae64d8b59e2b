"""Output saturation: the sensor is at its end, or a vessel is full.

At the sensor ``min(w, upper)`` and ``max(w, lower)``; in the state the same, and the dynamics go on from the limit. A
rate is turned into the difference equation that integrates it for that: what overflows must not wind up.
The null values lie one span beyond the data, so that no limit touches the base model.
Reference: Schoukens and Noel, Three benchmarks addressing open challenges in nonlinear system identification, IFAC
(2017) (cascaded tanks, which overflow).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

import sympy

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.naming import find, free_name, fresh, quantity
from smid.diagnosis.effects.plant import output_signal, state_lines
from smid.models import Model, Parameter

__all__ = ["EFFECT"]

_SHARES = (0.1, 0.3)


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Put limits at the sensor, and in the output's own state."""
    low, high = site.span(site.output)
    span = (high - low) or 1.0
    unit = site.unit(site.output)
    highs = tuple(high - share * span for share in _SHARES)
    lows = tuple(low + share * span for share in _SHARES)
    own = output_signal(model, site)
    stepped = model.discretised()
    state = next((item for item in state_lines(stepped) if item.own == own), None)
    for place, stem in (("at the sensor", "sensor_limit"), ("in the state", "overflow")):
        if place == "in the state" and state is None:
            continue
        upper = fresh(model, f"{stem}_upper", (low, high + span), unit, high + span)
        lower = fresh(model, f"{stem}_lower", (low - span, high), unit, low - span)
        full = tuple({upper.name: value} for value in highs)
        empty = tuple({lower.name: value} for value in lows)
        both = tuple({**a, **b} for a, b in zip(full, empty, strict=True))
        for label, limits, starts in (
            ("above", (None, upper), full),
            ("below", (lower, None), empty),
            ("both sides", (lower, upper), both),
        ):
            change, parameters = _limited(*limits), [item for item in limits if item is not None]
            if place == "in the state" and state is not None:
                extended = stepped.insert_after(state.line.signal, change, parameters)
            else:
                name = free_name(model, f"{site.output}_limited")
                extended = model.insert_sensor(site.output, change, parameters, new_name=name)
            yield Extension(extended, starts, f"{label}, {place}")


def _limited(lower: Parameter | None, upper: Parameter | None) -> Callable[[sympy.Expr], sympy.Expr]:
    def limited(w: sympy.Expr) -> sympy.Expr:
        below = w if upper is None else sympy.Min(w, upper.symbol)
        return below if lower is None else sympy.Max(lower.symbol, below)

    return limited


def describe(values: Mapping[str, float], site: Site) -> str:
    """Say where the end is."""
    unit = site.unit(site.output)
    upper, lower = find(values, "upper"), find(values, "lower")
    limits = [f"rises no further than {quantity(upper, unit)}"] if upper is not None else []
    limits += [f"falls no further than {quantity(lower, unit)}"] if lower is not None else []
    what = "The vessel is full:" if any("overflow" in name for name in values) else "The sensor is at its end:"
    return f"{what} {site.output} {' and '.join(limits)}."


EFFECT = Effect(
    "output_saturation",
    "the sensor or a vessel is full",
    extend,
    describe,
    rivals=("input_saturation", "output_curve", "input_curve"),
)
