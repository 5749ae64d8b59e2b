"""Further measured channels as signals of order one."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import sympy

from smid.diagnosis.effects.effect import Site
from smid.diagnosis.effects.parts.naming import signal_of
from smid.models import Model, signal, t
from smid.models.symbols import number

__all__ = ["usable"]


def usable(model: Model, site: Site) -> Iterator[tuple[str, float, float, Callable[[int], sympy.Expr]]]:
    """Give name, middle, half span and deviation ``(v[t - lag] - middle) / half`` of each channel that moves.

    A channel whose name stands for a parameter or a computed signal of the model cannot be read by it.
    """
    taken = {p.name for p in model.parameters} | {line.signal for line in model.lines}
    taken |= {item.noise for item in model.measurements if item.noise}
    for channel in site.other_channels:
        low, high = site.span(channel)
        if low == high or channel in taken:
            continue
        middle, half = float(site.values(channel).mean()), (high - low) / 2
        v = signal(signal_of(model, channel))

        def deviation(lag: int, v: sympy.IndexedBase = v, middle: float = middle, half: float = half) -> sympy.Expr:
            return (v[t - lag] - number(middle)) / number(half)

        yield channel, middle, half, deviation
