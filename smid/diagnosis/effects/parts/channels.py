"""Further measured channels as signals of order one."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import sympy

from smid.diagnosis.effects.effect import Site
from smid.diagnosis.effects.parts.naming import read_channel
from smid.models import Model, signal, t
from smid.models.simulated import SIMULATION
from smid.models.symbols import number

__all__ = ["further", "usable"]


def further(model: Model, site: Site) -> Iterator[tuple[str, float, float]]:
    """Yield each channel that moves, and that neither the model nor a simulator computes, with its span."""
    computed = {m.channel for m in model.measurements if model.origins.get(m.signal) == SIMULATION}
    computed.update(model.output_channels)
    for channel in site.other_channels:
        low, high = site.span(channel)
        if low < high and channel not in computed:
            yield channel, low, high


def usable(model: Model, site: Site) -> Iterator[tuple[Model, str, float, float, Callable[[int], sympy.Expr]]]:
    """Yield each channel that moves: the model that can read it, name, middle, half span and deviation.

    The deviation at a lag is ``(v[t - lag] - middle) / half``.
    """
    for channel, low, high in further(model, site):
        middle, half = float(site.values(channel).mean()), (high - low) / 2
        reading, name = read_channel(model, channel)
        v = signal(name)

        def deviation(lag: int, v: sympy.IndexedBase = v, middle: float = middle, half: float = half) -> sympy.Expr:
            return (v[t - lag] - number(middle)) / number(half)

        yield reading, channel, middle, half, deviation
