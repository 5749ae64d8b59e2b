"""Rate limit: the input acts at a limited slope.

The command u is held over a sample while the actuator moves towards it, one unit in S seconds at most. With e = u[t] -
r[t-1] the remaining distance, it covers ``c = e / max(1, |e| S / Ts)`` and is at ``r[t] = r[t-1] + c`` at the end of
the sample. Its mean over the sample, which drives a slower plant, is ``r[t-1] + c (1 - |c| S / (2 Ts))``. S is zero
without a limit. Reference: Aastroem and Murray, Feedback Systems, 2nd ed. (2021), 10.2.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
import sympy

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.extremes import larger
from smid.diagnosis.effects.parts.naming import find, free_name, fresh, quantity
from smid.models import Model, Parameter, signal, t
from smid.models.symbols import number

__all__ = ["EFFECT"]

_SHARES = (0.3, 0.1, 0.03, 0.01)


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Put it before the input: one limit, and one each way."""
    steps = np.concatenate([np.abs(np.diff(run.values[site.input])) for run in site.data.experiments])
    steepest = float(steps.max(initial=0.0)) / site.sampling_time
    if not steepest:
        return
    box = (0.0, 1e4 / steepest)
    unit = f"s/{site.unit(site.input)}"
    name = free_name(model, f"{site.input}_slew")
    ways = {
        "both ways": [fresh(model, "slew_time", box, unit, 0.0)],
        "up and down apart": [fresh(model, f"slew_time_{way}", box, unit, 0.0) for way in ("up", "down")],
    }
    for label, slowness in ways.items():
        starts = tuple({s.name: 1 / (share * steepest) for s in slowness} for share in _SHARES)
        yield Extension(_limited(model, site, name, slowness), starts, label)


def _limited(model: Model, site: Site, name: str, slowness: list[Parameter]) -> Model:
    last, step = signal(name)[t - 1], number(site.sampling_time)

    def slow(gap: sympy.Expr) -> sympy.Expr:
        return sum((s.symbol * larger(0, way * gap) for s, way in zip(slowness, (1, -1), strict=True)), sympy.S.Zero)

    def time(gap: sympy.Expr) -> sympy.Expr:
        """Return the share of a sample that the way takes."""
        return (slowness[0].symbol * sympy.Abs(gap) if len(slowness) == 1 else slow(gap)) / step

    gone = free_name(model, f"{site.input}_gone")
    model = model.insert_before(site.input, lambda u: (u - last) / larger(1, time(u - last)), slowness, new_name=gone)
    model = model.insert_before(gone, lambda way: last + way * (1 - time(way) / 2), new_name=f"{name}_mean")
    return model.with_line(name, last + signal(gone)[t])


def describe(values: Mapping[str, float], site: Site) -> str:
    """Say how fast the input acts at most."""
    unit = f"{site.unit(site.input)}/s"
    rise, fall, both = (find(values, f"slew_time{way}") for way in ("_up", "_down", ""))
    if rise is not None and fall is not None:
        return f"{site.input} acts at most at {_speed(rise, unit)} upwards and {_speed(fall, unit)} downwards."
    return f"{site.input} acts at most at {_speed(both or 0.0, unit)}."


def _speed(slowness: float, unit: str) -> str:
    return quantity(1 / slowness, unit) if slowness > 0 else "any speed"


EFFECT = Effect(
    "rate_limit",
    "the input acts at a limited slope",
    extend,
    describe,
    needs="an input that moves",
)
