"""Change: a parameter of the plant jumps at a time, ``p -> p + dp step(t - t0)``.

The step is a ramp over one sample, so that t0 has a derivative: ``max(0, min(1, (time - t0) / Ts))``. t0 is a
time of the record, which may begin later than zero; where experiments begin at different times, t0 counts from the
start of each.
Reference: Basseville and Nikiforov, Detection of Abrupt Changes (1993), chapter 1.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.clock import with_clock
from smid.diagnosis.effects.parts.extremes import larger, smaller
from smid.diagnosis.effects.parts.naming import free_name, fresh, quantity
from smid.diagnosis.effects.parts.varying import Varied, extensions
from smid.models import Model, signal, t
from smid.models.symbols import number

__all__ = ["EFFECT"]

_TIMES = 9


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Let each parameter of the plant jump."""
    starts = {run.start_time for run in site.data.experiments}
    start = starts.pop() if len(starts) == 1 else 0.0
    moment = fresh(model, "change_time", (start, start + site.duration), "s")
    timed, now = with_clock(model, site.sampling_time)
    name = free_name(timed, "change_step")
    ramp = larger(0, smaller(1, (now + number(start) - moment.symbol) / number(site.sampling_time)))
    times = tuple(start + site.duration * k / (_TIMES + 1) for k in range(1, _TIMES + 1))
    # The line needs its parameter before `extensions` adds it beside each amount.
    stepped = timed.with_line(name, ramp, [moment])
    described = partial(_describe, moment.name)
    for extension in extensions(stepped, "change", lambda lag: signal(name)[t - lag], described):
        amounts = extension.starts[0]
        yield replace(extension, starts=tuple({**amounts, moment.name: at} for at in times))


def _describe(moment: str, varied: Varied, values: Mapping[str, float], _site: Site) -> str:
    what = varied.what[0].lower() + varied.what[1:] if varied.kind != "parameter" else varied.what
    return f"At {quantity(values[moment], 's')} {what} changes {varied.much(values)}."


EFFECT = Effect(
    "parameter_change",
    "a parameter jumps at a time",
    extend,
    needs="a model with parameters",
)
