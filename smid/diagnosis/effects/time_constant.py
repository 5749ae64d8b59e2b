"""Time constant: a known time constant is wrong, or all of the plant is faster or slower by one factor.

Without a parameter in units of time the increments of all states are scaled, which scales time:
``w[t] = w[t-1] + k (f - w[t-1])``, ``d/dt w = k f``.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.gain import released
from smid.diagnosis.effects.parts.naming import fresh
from smid.diagnosis.effects.parts.plant import state_lines, with_increment
from smid.models import Model

__all__ = ["EFFECT"]


def extend(model: Model, site: Site) -> Iterator[Extension]:  # noqa: ARG001  (every effect is called alike)
    """Release each fixed time constant, or scale the speed of all states."""
    found = tuple(released(model, of_time=True))
    yield from found
    states = state_lines(model)
    if found or not states:
        return
    factor = fresh(model, "speed_factor", (0.05, 20.0), "", 1.0)
    extended = model.with_parameter(factor)
    for state in states:
        extended = with_increment(extended, state, factor.symbol * state.increment)
    yield Extension(extended, ({factor.name: 0.8}, {factor.name: 1.2}), "all states", describe=_describe)


def _describe(values: Mapping[str, float], _site: Site) -> str:
    (factor,) = values.values()
    return f"The states move {factor:.3g} times as fast as the model says."


EFFECT = Effect(
    "time_constant",
    "a known time constant of the model is wrong",
    extend,
    needs="a model with a state",
)
