"""The one-step-ahead predictor of a model, as lines again."""

from __future__ import annotations

from functools import lru_cache

from smid.models.parts import Line
from smid.models.structure import causal_order
from smid.models.symbols import rename_signals, signal, swapped, t

__all__ = ["past_name", "predictor"]


def past_name(name: str) -> str:
    """Name the past version of a signal."""
    return f"{name}__past"


@lru_cache(maxsize=256)
def predictor(lines: tuple[Line, ...], measured: frozenset[str]) -> tuple[Line, ...]:
    """Return lines that read the past from the measured signals only.

    Each signal gets a second version for the past: the measurement where the signal is measured, else its line on past
    versions. Without it, a static line in a feedback would use the prediction instead of the measurement.

    Examples
    --------
    >>> w, u = signal("w"), signal("u")
    >>> print(predictor((Line(w[t], w[t - 1] / 2 + u[t]),), frozenset({"w"}))[0].expression)
    u[t] + w__past[t - 1]/2
    """
    past = {line.signal: past_name(line.signal) for line in lines}
    rewritten = [
        Line(signal(past[line.signal])[t], rename_signals(line.expression, past))
        for line in lines
        if line.signal not in measured
    ]
    for line in lines:
        delayed = {
            atom: signal(past[name])[t - lag]
            for name, lag in line.reads
            if lag > 0 and name in past
            for atom in (signal(name)[t - lag],)
        }
        rewritten.append(Line(line.target, swapped(line.expression, delayed)))
    needed = {line.signal for line in lines}
    while True:
        reads = {name for item in rewritten if item.signal in needed for name, _ in item.reads}
        if reads <= needed:
            break
        needed |= reads
    return causal_order(line for line in rewritten if line.signal in needed)
