"""Scheduled parameter: a parameter of the plant depends on another measured channel, ``p -> p + dp (v - mean) / half``.

half is half the channel's span.
Reference: Toth, Modeling and Identification of Linear Parameter-Varying Systems (2010).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.channels import usable
from smid.diagnosis.effects.parts.naming import quantity
from smid.diagnosis.effects.parts.varying import extensions, sentence, told
from smid.models import Model

__all__ = ["EFFECT"]


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Let each parameter of the plant follow each other channel."""
    for channel, _, _, deviation in usable(model, site):
        yield from extensions(model, f"with_{channel}", deviation, label=f"with {channel}")


def describe(values: Mapping[str, float], site: Site) -> str:
    """Say how much the parameter changes per unit of the channel."""
    name, amount = next(iter(values.items()))
    parameter, channel = name.split("_with_", 1)
    channel = next(item for item in sorted(site.other_channels, key=len, reverse=True) if channel.startswith(item))
    low, high = site.span(channel)
    unit = site.unit(channel)
    what, much = told(parameter, 2 * amount)
    return f"{sentence(what)} changes {much} as {channel} goes from {low:.3g} to {quantity(high, unit)}."


EFFECT = Effect(
    "scheduled_parameter",
    "a parameter depends on a measured channel",
    extend,
    describe,
    rivals=("parameter_drift", "parameter_change", "missing_input", "operating_point"),
    needs="a further measured channel that moves",
)
