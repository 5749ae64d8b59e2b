"""Change: a parameter of the plant jumps at a time, ``p -> p + dp step(t - t0)``.

The step is a ramp over one sample, so that t0 has a derivative: ``max(0, min(1, (time - t0) / Ts))``.
Reference: Basseville and Nikiforov, Detection of Abrupt Changes (1993), chapter 1.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import sympy

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.clock import with_clock
from smid.diagnosis.effects.parts.naming import find, free_name, fresh, quantity
from smid.diagnosis.effects.parts.varying import extensions, told
from smid.models import Model, signal, t
from smid.models.symbols import number

__all__ = ["EFFECT"]

_TIMES = 9


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Let each parameter of the plant jump."""
    moment = fresh(model, "change_time", (0, site.duration), "s")
    timed, now = with_clock(model, site.sampling_time)
    name = free_name(timed, "change_step")
    ramp = sympy.Max(0, sympy.Min(1, (now - moment.symbol) / number(site.sampling_time)))
    times = tuple(site.duration * k / (_TIMES + 1) for k in range(1, _TIMES + 1))
    # The line needs its parameter before `extensions` adds it beside each amount.
    stepped = timed.with_line(name, ramp, [moment])
    for extension in extensions(stepped, "change", lambda lag: signal(name)[t - lag]):
        amounts = extension.starts[0]
        yield Extension(extension.model, tuple({**amounts, moment.name: at} for at in times), extension.label)


def describe(values: Mapping[str, float], site: Site) -> str:  # noqa: ARG001  (every effect is called alike)
    """Say what changes, when and by how much."""
    moment = find(values, "change_time")
    name, amount = next((name, value) for name, value in values.items() if not name.startswith("change_time"))
    what, much = told(name.rsplit("_change", 1)[0], amount)
    return f"At {quantity(moment or 0.0, 's')} {what} changes {much}."


EFFECT = Effect(
    "parameter_change",
    "a parameter jumps at a time",
    extend,
    describe,
    rivals=("parameter_drift", "scheduled_parameter", "missing_input", "sensor_drift"),
    needs="a model with parameters",
)
