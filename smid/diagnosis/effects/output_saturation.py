"""Output saturation: the sensor is at its limit, a vessel is full, or a stop is reached.

At the sensor ``min(w, upper)`` and ``max(w, lower)``; in the state the same, and the dynamics continue from the limit.
For this a rate becomes the difference equation that integrates it, so that the state does not wind up. Of vessels in
succession, where what leaves one enters the next, the first may overflow too, and a share of that enters the next.
The null values lie one span beyond the state, so that no limit acts in the base model.
Reference: Schoukens and Noel, Three benchmarks addressing open challenges in nonlinear system identification, IFAC
(2017) (cascaded tanks, which overflow).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from itertools import permutations

import numpy as np
import sympy

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.extremes import larger, smaller
from smid.diagnosis.effects.parts.hinges import Curve
from smid.diagnosis.effects.parts.naming import find, free_name, fresh, quantity, signal_of
from smid.diagnosis.effects.parts.plant import StateLine, output_signal, state_lines
from smid.models import Model, signal, t
from smid.models.simulate import simulate

__all__ = ["EFFECT"]

_SHARES = (0.1, 0.3)


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Put limits at the sensor, in the output's own state, and in the vessels before it."""
    unit = site.unit(site.output)
    for label, limited, parameters, starts in _ends(model, "sensor_limit", site.span(site.output), unit):
        name = free_name(model, f"{site.output}_limited")
        extended = model.insert_sensor(site.output, limited, parameters, new_name=name)
        yield Extension(extended, starts, f"{label}, at the sensor")
    own = output_signal(model, site)
    stepped = model.discretised()
    states = {state.own: state for state in state_lines(stepped)}
    if own in states:
        # A level behind a zero or a curve of the sensor is not what the sensor shows.
        said = describe if own == signal_of(model, site.output) else partial(_describe, own)
        for label, limited, parameters, starts in _ends(model, "overflow", _span(model, site, own), unit):
            extended = stepped.insert_after(states[own].line.signal, limited, parameters)
            yield Extension(extended, starts, f"{label}, in the state", describe=said)
    for vessel, below in permutations(states.values(), 2):
        if vessel.leak != 0 and below.inflow(vessel) != 0:
            yield _spilling(stepped, vessel, below, _span(model, site, vessel.own))


def _spilling(model: Model, vessel: StateLine, below: StateLine, span: tuple[float, float]) -> Extension:
    """Let a vessel overflow, and a share of that enter the next as all else that leaves it does."""
    _, limited, (upper,), starts = next(_ends(model, f"{vessel.own}_overflow", span))
    share = fresh(model, f"{vessel.own}_overflow_share", (0.0, 1.0))
    raw = free_name(model, f"{vessel.own}_raw")
    full = model.insert_after(vessel.line.signal, limited, [upper], raw_name=raw)
    ratio = sympy.cancel(below.inflow(vessel) / vessel.leak)
    spilt = share.symbol * ratio * (signal(raw)[t] - signal(vessel.own)[t])
    return Extension(
        full.add_term(below.line.signal, spilt, [share]),
        tuple({**start, share.name: 0.5} for start in starts),
        f"above, from {vessel.own} to {below.own}",
        describe=partial(_spills, vessel.own, upper.name, share.name),
    )


def _span(model: Model, site: Site, state: str) -> tuple[float, float]:
    """Return the range of a state: as measured, or where no sensor shows it as it is, as simulated."""
    if state == signal_of(model, site.output):
        return site.span(site.output)
    runs = [simulate(model, run.values, check=False)[state] for run in site.data.experiments]
    return float(min(map(np.min, runs))), float(max(map(np.max, runs)))


def _ends(model: Model, stem: str, span: tuple[float, float], unit: str = "") -> Iterator[Curve]:
    """Yield a limit above, one below, and both: label, map, parameters, and where a fit may begin."""
    low, high = span
    width = (high - low) or 1.0
    upper = fresh(model, f"{stem}_upper", (low, high + width), unit, high + width)
    lower = fresh(model, f"{stem}_lower", (low - width, high), unit, low - width)
    full = tuple({upper.name: high - share * width} for share in _SHARES)
    empty = tuple({lower.name: low + share * width} for share in _SHARES)
    both = tuple({**a, **b} for a, b in zip(full, empty, strict=True))
    yield "above", lambda w: smaller(w, upper.symbol), [upper], full
    yield "below", lambda w: larger(lower.symbol, w), [lower], empty
    yield "both sides", lambda w: larger(lower.symbol, smaller(w, upper.symbol)), [lower, upper], both


def _spills(vessel: str, upper: str, share: str, values: Mapping[str, float], site: Site) -> str:
    level = quantity(values[upper], site.unit(site.output))
    return f"The vessel {vessel} overflows at {level}; {values[share]:.0%} of what spills over enters the next."


def describe(values: Mapping[str, float], site: Site) -> str:
    """Say where the end is."""
    return _describe(site.output, values, site)


def _describe(what: str, values: Mapping[str, float], site: Site) -> str:
    unit = site.unit(site.output)
    upper, lower = find(values, "upper"), find(values, "lower")
    limits = [f"rises no further than {quantity(upper, unit)}"] if upper is not None else []
    limits += [f"falls no further than {quantity(lower, unit)}"] if lower is not None else []
    state = any("overflow" in name for name in values)
    end = "A vessel is full, or a stop is reached:" if state else "The sensor is at its end:"
    return f"{end} {what} {' and '.join(limits)}."


EFFECT = Effect(
    "output_saturation",
    "the sensor is at its end, a vessel is full, or a stop is reached",
    extend,
    describe,
)
