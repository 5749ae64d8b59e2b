"""Input bias: a constant acts along with the input, ``u -> u + c``.

The zero of an actuator, a valve that does not close, a force on an axis. A linear plant that settles shows it as it
shows a sensor bias, so there it is not offered. A linear plant that integrates shows it as a straight drift of the
sensor, which is not offered there: a push is the likelier of the two.
Reference: Ljung, System Identification, 2nd ed. (1999), section 14.1 (drifts and detrending).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.naming import free_name, fresh, quantity
from smid.diagnosis.effects.parts.plant import is_linear, state_lines
from smid.models import Model

__all__ = ["EFFECT"]

_SHARE = 0.1  # of the largest input


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Put it before the input, where the plant is not linear or integrates."""
    if is_linear(model) and all(state.leak != 0 for state in state_lines(model)):
        return
    full = site.scale(site.input)
    bias = fresh(model, "input_bias", (-full, full), site.unit(site.input), 0.0)
    name = free_name(model, f"{site.input}_joined")
    yield Extension(
        model.insert_before(site.input, lambda u: u + bias.symbol, [bias], new_name=name),
        ({bias.name: _SHARE * full}, {bias.name: -_SHARE * full}),
    )


def describe(values: Mapping[str, float], site: Site) -> str:
    """Say how large it is."""
    (bias,) = values.values()
    return f"A constant {quantity(bias, site.unit(site.input))} acts along with {site.input}."


EFFECT = Effect(
    "input_bias",
    "a constant acts along with the input",
    extend,
    describe,
    needs="a plant that is not linear, or integrates: else it is a sensor bias",
)
