"""Scheduled parameter: a parameter of the plant depends on another measured channel, ``p -> p + dp (v - mean) / half``.

half is half the channel's span.
Reference: Toth, Modeling and Identification of Linear Parameter-Varying Systems (2010).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.channels import usable
from smid.diagnosis.effects.parts.naming import quantity
from smid.diagnosis.effects.parts.varying import Varied, extensions
from smid.models import Model

__all__ = ["EFFECT"]


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Let each parameter of the plant depend on each other channel."""
    for reading, channel, _, _, deviation in usable(model, site):
        label = f"with {channel}"
        yield from extensions(reading, f"with_{channel}", deviation, partial(_describe, channel), label=label)


def _describe(channel: str, varied: Varied, values: Mapping[str, float], site: Site) -> str:
    low, high = site.span(channel)
    much = varied.much(values, 2)
    return f"{varied.what} changes {much} as {channel} goes from {low:.3g} to {quantity(high, site.unit(channel))}."


EFFECT = Effect(
    "scheduled_parameter",
    "a parameter depends on a measured channel",
    extend,
    needs="a further measured channel that moves",
)
