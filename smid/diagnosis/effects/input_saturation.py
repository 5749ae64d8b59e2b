"""Saturation: the input acts only up to a level, ``u' = min(u, upper)``, ``max(u, lower)`` or both.

The null value is the extreme of the data: a limit the input never reaches does nothing.
Reference: Tao and Kokotovic, Adaptive Control of Systems with Actuator and Sensor Nonlinearities (1996).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.extremes import larger, smaller
from smid.diagnosis.effects.parts.naming import find, free_name, fresh, quantity
from smid.models import Model

__all__ = ["EFFECT"]

_SHARES = (0.15, 0.3, 0.5)


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Put it before the input: above, below, and on both sides."""
    low, high = site.span(site.input)
    span = high - low
    if not span:
        return
    unit, name = site.unit(site.input), free_name(model, f"{site.input}_limited")
    upper = fresh(model, "input_limit_upper", (low, high), unit, high)
    lower = fresh(model, "input_limit_lower", (low, high), unit, low)
    yield Extension(
        model.insert_before(site.input, lambda u: smaller(u, upper.symbol), [upper], new_name=name),
        tuple({upper.name: high - share * span} for share in _SHARES),
        "above",
    )
    yield Extension(
        model.insert_before(site.input, lambda u: larger(u, lower.symbol), [lower], new_name=name),
        tuple({lower.name: low + share * span} for share in _SHARES),
        "below",
    )
    yield Extension(
        model.insert_before(
            site.input,
            lambda u: larger(lower.symbol, smaller(u, upper.symbol)),
            [upper, lower],
            new_name=name,
        ),
        tuple({upper.name: high - share * span, lower.name: low + share * span} for share in (0.1, 0.2, 0.35)),
        "both sides",
    )


def describe(values: Mapping[str, float], site: Site) -> str:
    """Say at which level the input stops to act."""
    unit = site.unit(site.input)
    upper, lower = find(values, "input_limit_upper"), find(values, "input_limit_lower")
    limits = [f"above {quantity(upper, unit)}"] if upper is not None else []
    limits += [f"below {quantity(lower, unit)}"] if lower is not None else []
    return f"A change of {site.input} {' or '.join(limits)} has no effect."


EFFECT = Effect(
    "input_saturation",
    "the input acts only up to a level",
    extend,
    describe,
    needs="an input that moves",
)
