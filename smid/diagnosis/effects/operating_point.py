"""Operating point: a parameter, time constant or gain depends on the level, as in ``p -> p + p1 s``.

s is the output over its scale, or its square; for the time constant also the input over its scale. Or s grows from 0 to
1 between two levels of the output and is constant beyond.
Reference: Toth, Modeling and Identification of Linear Parameter-Varying Systems (2010), chapter 1 (quasi-LPV).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial

import numpy as np

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.extremes import larger, smaller
from smid.diagnosis.effects.parts.naming import fresh, quantity, signal_of
from smid.diagnosis.effects.parts.plant import output_signal
from smid.diagnosis.effects.parts.varying import Varied, extensions
from smid.models import Model, signal, t
from smid.models.symbols import number

__all__ = ["EFFECT"]

_NARROW = 0.02  # the least width, a share of the range
_PLACES = ((0.0, 1.0), (0.0, 0.5), (0.25, 0.5), (0.5, 0.5))  # where it starts and how wide, shares of the range


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Let each parameter, time constant and gain of the states' lines depend on the level."""
    w, u = signal(output_signal(model, site)), signal(signal_of(model, site.input))
    high, full = number(site.scale(site.output)), number(site.scale(site.input))
    for suffix, label, way, vary in (
        ("with_output", "with the output", "with", lambda lag: w[t - lag] / high),
        ("with_square", "with the output squared", "with the square of", lambda lag: (w[t - lag] / high) ** 2),
    ):
        yield from extensions(
            model, suffix, vary, partial(_with_channel, site.output, way), label=label, states_only=True
        )
    # Often only a part of the range matters: a slack that is taken up, a pipe that is full.
    low, high = np.quantile(site.values(site.output), (0.01, 0.99)).tolist()
    unit, span = site.unit(site.output), (high - low) or 1.0
    start = fresh(model, "level_from", (low, low + span), unit)
    width = fresh(model, "level_width", (_NARROW * span, span), unit)
    yield from extensions(
        model,
        "with_level",
        lambda lag: larger(0, smaller(1, (w[t - lag] - start.symbol) / width.symbol)),
        partial(_between_levels, start.name, width.name),
        label="between two levels",
        shape=(start, width),
        places=tuple({start.name: low + a * span, width.name: b * span} for a, b in _PLACES),
        parameters=False,
    )
    # A gain that depends on the input is another effect, an input curve: only the time constant varies.
    yield from extensions(
        model,
        "with_input",
        lambda lag: u[t - lag] / full,
        partial(_with_channel, site.input, "with"),
        label="with the input",
        states_only=True,
        parameters=False,
        kinds=("pace",),
    )


def _with_channel(channel: str, way: str, varied: Varied, values: Mapping[str, float], site: Site) -> str:
    full = quantity(site.scale(channel), site.unit(channel))
    return f"{varied.what} depends on the level: {way} {channel} it changes {varied.much(values)} from zero to {full}."


def _between_levels(start: str, width: str, varied: Varied, values: Mapping[str, float], site: Site) -> str:
    end = quantity(values[start] + values[width], site.unit(site.output))
    levels = f"from {values[start]:.3g} to {end}"
    much = varied.much(values)
    return f"{varied.what} depends on the level: with {site.output} {levels} it changes {much}, and no further."


EFFECT = Effect(
    "operating_point",
    "a parameter of the dynamics depends on the level",
    extend,
    needs="parameters in the lines of the states",
)
