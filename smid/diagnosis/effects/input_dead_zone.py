"""Dead zone: the input has no effect below a threshold, ``u' = max(0, u - upper) + min(0, u - lower)``.

Overlapping valve edges, static friction of a lever, a diode.  lower <= 0 <= upper; both are zero without the effect.
Reference: Tao and Kokotovic, Adaptive Control of Systems with Actuator and Sensor Nonlinearities (1996), chapter 2.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.extremes import larger, smaller
from smid.diagnosis.effects.parts.naming import find, free_name, fresh, quantity
from smid.models import Model

__all__ = ["EFFECT"]

_SHARES = (0.1, 0.3, 0.5)
_VISITED = 0.01


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Put it before the input: on the side, or both sides, that the data visit."""
    low, high = site.span(site.input)
    unit = site.unit(site.input)
    # A dead zone that no more than single samples enter is a bias.
    least, most = np.quantile(site.values(site.input), (_VISITED, 1 - _VISITED)).tolist()
    name = free_name(model, f"{site.input}_effective")
    if high > 0:
        upper = fresh(model, "dead_zone_upper", (0, high), unit, 0.0)
    if low < 0:
        lower = fresh(model, "dead_zone_lower", (low, 0), unit, 0.0)
    if high > 0:
        yield Extension(
            model.insert_before(
                site.input,
                lambda u: larger(0, u - upper.symbol) + smaller(0, u),
                [upper],
                new_name=name,
            ),
            tuple({upper.name: share * high} for share in _SHARES),
            "above zero",
            {upper.name: (least, np.inf)},
        )
    if low < 0:
        yield Extension(
            model.insert_before(
                site.input,
                lambda u: larger(0, u) + smaller(0, u - lower.symbol),
                [lower],
                new_name=name,
            ),
            tuple({lower.name: share * low} for share in _SHARES),
            "below zero",
            {lower.name: (-np.inf, most)},
        )
    if low < 0 < high:
        half = fresh(model, "dead_zone_half", (0, max(high, -low)), unit, 0.0)
        yield Extension(
            model.insert_before(
                site.input,
                lambda u: larger(0, u - half.symbol) + smaller(0, u + half.symbol),
                [half],
                new_name=name,
            ),
            tuple({half.name: share * min(high, -low)} for share in _SHARES),
            "symmetric",
        )
        yield Extension(
            model.insert_before(
                site.input,
                lambda u: larger(0, u - upper.symbol) + smaller(0, u - lower.symbol),
                [upper, lower],
                new_name=name,
            ),
            tuple({upper.name: share * high, lower.name: share * low} for share in _SHARES),
            "two sides",
        )


def describe(values: Mapping[str, float], site: Site) -> str:
    """Say between which levels the input does nothing."""
    unit, half = site.unit(site.input), find(values, "dead_zone_half")
    upper, lower = find(values, "dead_zone_upper"), find(values, "dead_zone_lower")
    if half is not None:
        upper, lower = half, -half
    if upper is not None and lower is not None:
        return f"Between {quantity(lower, unit)} and {quantity(upper, unit)} {site.input} has no effect."
    if upper is not None:
        return f"Up to {quantity(upper, unit)} {site.input} has no effect."
    return f"From zero down to {quantity(lower or 0.0, unit)} {site.input} has no effect."


EFFECT = Effect(
    "input_dead_zone",
    "the input has no effect until it passes a threshold",
    extend,
    describe,
    needs="an input that leaves zero",
)
