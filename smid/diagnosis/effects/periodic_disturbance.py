"""Periodic disturbance: an unmeasured sinusoid, ``y = w + A sin(omega time) + B cos(omega time)``.

The fit has a local minimum at every frequency, so it starts at the strongest peaks of the residual's spectrum, located
finer than one bin.
Reference: Stoica and Moses, Spectral Analysis of Signals (2005), chapter 4.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import sympy

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.clock import with_clock
from smid.diagnosis.effects.parts.naming import find, free_name, fresh, quantity
from smid.diagnosis.effects.parts.spectrum import amplitudes, peaks
from smid.models import Model

__all__ = ["EFFECT"]

_PEAKS = 3


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Put a sinusoid at the sensor, started at the strongest peaks."""
    size = 2 * site.scale(site.output)
    unit = site.unit(site.output)
    sine = fresh(model, "disturbance_sine", (-size, size), unit, 0.0)
    cosine = fresh(model, "disturbance_cosine", (-size, size), unit, 0.0)
    timed, now = with_clock(model, site.sampling_time)
    name = free_name(timed, f"{site.output}_joined")
    starts = []
    frequency = fresh(
        model, "disturbance_frequency", (2 * math.pi / site.duration, math.pi / site.sampling_time), "rad/s"
    )
    for peak in peaks(site, _PEAKS):
        a, b = (max(-size, min(size, value)) for value in amplitudes(site, peak))
        starts.append({sine.name: a, cosine.name: b, frequency.name: peak})
    if not starts:
        return
    angle = frequency.symbol * now
    wave = sine.symbol * sympy.sin(angle) + cosine.symbol * sympy.cos(angle)
    yield Extension(
        timed.insert_sensor(site.output, lambda w: w + wave, [sine, cosine, frequency], new_name=name), tuple(starts)
    )


def describe(values: Mapping[str, float], site: Site) -> str:
    """Say amplitude and frequency."""
    height = math.hypot(find(values, "disturbance_sine") or 0.0, find(values, "disturbance_cosine") or 0.0)
    hertz = (find(values, "disturbance_frequency") or 0.0) / (2 * math.pi)
    size = quantity(height, site.unit(site.output))
    return f"A disturbance of {size} at {quantity(hertz, 'Hz')}, which no channel shows, lies on {site.output}."


EFFECT = Effect(
    "periodic_disturbance",
    "an unmeasured sinusoid lies on the output",
    extend,
    describe,
    needs="a record long enough for a period",
)
