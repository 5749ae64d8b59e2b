"""The clock that effects of time share: ``time[t] = time[t-1] + Ts``, zero at the start of every experiment."""

from __future__ import annotations

import sympy

from smid.diagnosis.effects.parts.naming import free_name
from smid.models import Model, signal, t
from smid.models.symbols import number

__all__ = ["with_clock"]


def with_clock(model: Model, sampling_time: float) -> tuple[Model, sympy.Expr]:
    """Return the model with a clock, the one it has or a new one, and the time now in seconds.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> model, now = with_clock(OutputError(), 0.5)
    >>> print(now, "=", model.lines[1].expression)
    time[t] = time[t - 1] + 1/2
    """
    step = number(sampling_time)
    for line in model.lines:
        if not line.rate and line.expression == signal(line.signal)[t - 1] + step:
            return model, signal(line.signal)[t]
    name = free_name(model, "time")
    return model.with_line(name, signal(name)[t - 1] + step), signal(name)[t]
