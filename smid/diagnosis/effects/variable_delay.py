"""Variable delay: what flows through a pipe of volume V arrives later where the flow q is smaller, ``V = int q dt``.

With the volume ``Q[t] = Q[t-1] + Ts q[t-1]`` that has passed, what enters at the sample t - k leaves once V more has
passed. In samples, with ``clip(x) = (1 + |x| - |x - 1|) / 2``, x within [0, 1]:

    x'[t] = x[t] + sum_k clip((V - Q[t] + Q[t-k+1]) / (Ts q[t])) (x[t-k] - x[t-k+1])    of an input, held, on average
    x'[t] = x[t] + sum_k clip((V - Q[t] + Q[t-k+1]) / (Ts q[t-k])) (x[t-k] - x[t-k+1])  of an output, between samples

V is zero without the delay. The flow is a further channel, or the input; what is delayed is the input, or what the
sensor sees. Reference: Zenger and Niemi, Journal of Process Control 19 (2009) 1044-1051 (plug flow, varying delay).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial

import numpy as np
import sympy

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.channels import further
from smid.diagnosis.effects.parts.extremes import larger
from smid.diagnosis.effects.parts.naming import free_name, fresh, quantity, read_channel
from smid.diagnosis.effects.parts.plant import static_end
from smid.models import Model, signal, t
from smid.models.symbols import number

__all__ = ["EFFECT"]

_LONGEST = 16  # samples, at the usual flow: the time of a fit grows with it
_STARTS = (1.0, 2.5, 5.0, 8.0, 12.0)  # samples, at the mean flow
_VARIES = 1.2  # largest over least flow: below it the delay is constant


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Delay the input with the flow in each further channel, and the output with these or with the input."""
    if min(run.n_samples for run in site.data.experiments) <= 4 * _LONGEST:
        return
    for flow, *_ in further(model, site):
        if _is_flow(site, flow):
            yield _late(model, site, flow, at_sensor=False)
            yield _late(model, site, flow, at_sensor=True)
    if _is_flow(site, site.input):
        yield _late(model, site, site.input, at_sensor=True)


def _is_flow(site: Site, channel: str) -> bool:
    low, high = site.span(channel)
    return low > 0 and high > _VARIES * low


def _late(base: Model, site: Site, flow: str, *, at_sensor: bool) -> Extension:
    step, usual = site.sampling_time, float(np.mean(site.values(flow)))
    model, read = read_channel(base, flow)
    unit = f"{site.unit(flow)} s".lstrip()
    volume = fresh(model, "pipe_volume", (0, _LONGEST * usual * step), unit, 0.0)
    q, passed = signal(read), signal(free_name(model, "passed"))
    least = number(site.span(flow)[0] / 2)  # the flow in other data may be none

    def late(x: sympy.Indexed) -> sympy.Expr:
        x, total = x.base, x
        for k in range(1, _LONGEST + 1):
            width = number(step) * larger(least, q[t - k * at_sensor])
            share = (volume.symbol - passed[t] + passed[t - k + 1]) / width
            # sympy takes long to build as many nested maxima and minima.
            total += (1 + sympy.Abs(share) - sympy.Abs(share - 1)) / 2 * (x[t - k] - x[t - k + 1])
        return total

    name = site.output if at_sensor else static_end(model, site.input)
    insert = model.insert_sensor if at_sensor else model.insert_before
    delayed = insert(name, late, [volume], new_name=free_name(model, f"{name}_delayed"))
    return Extension(
        delayed.with_line(str(passed.label), passed[t - 1] + number(step) * q[t - 1]),
        tuple({volume.name: samples * usual * step} for samples in _STARTS),
        f"{'sensor' if at_sensor else 'input'} with the flow {flow}",
        describe=partial(_describe, flow, name if at_sensor else site.input),
    )


def _describe(flow: str, late: str, values: Mapping[str, float], site: Site) -> str:
    """Say the law, and the range of the delay."""
    (volume,) = values.values()
    low, high = site.span(flow)
    size = quantity(volume, f"{site.unit(flow)} s".lstrip())
    span = f"{volume / high:.3g} to {quantity(volume / low, 's')}"
    return f"{late} is transported with the flow {flow}: its delay is {size} / {flow}, {span}."


EFFECT = Effect(
    "variable_delay",
    "a transport delay shrinks with the flow",
    extend,
    needs="a flow: a further channel, or the input, that is positive and varies",
)
