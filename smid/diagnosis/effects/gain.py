"""Gain: a constant of the model, known until now, is wrong by a factor; or the input's scale is.

One constant at a time; constants with a unit of time are left to `time_constant`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.naming import free_name, fresh
from smid.diagnosis.effects.parts.plant import base_parameters, scaled
from smid.models import Model

__all__ = ["EFFECT", "TIME_UNITS", "released"]

TIME_UNITS = frozenset({"s", "ms", "us", "µs", "min", "h", "d"})
_BOX = (0.05, 20.0)


def released(model: Model, *, of_time: bool) -> Iterator[Extension]:
    """Yield the model with a factor on each fixed parameter of the plant, with a unit of time or without."""
    for parameter in base_parameters(model):
        # A zero stays zero under any factor.
        if parameter.lower < parameter.upper or not parameter.lower or (parameter.unit in TIME_UNITS) != of_time:
            continue
        factor = fresh(model, f"{parameter.name}_factor", _BOX, "", 1.0)
        extended = scaled(model, parameter, factor)
        if extended is not None:
            starts = tuple({factor.name: value} for value in (0.8, 1.25, 0.4, 2.5))
            yield Extension(extended, starts, parameter.name, describe=partial(_describe, parameter.name))


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Release each fixed constant, and the scale of the input."""
    yield from released(model, of_time=False)
    factor = fresh(model, "input_factor", _BOX, "", 1.0)
    yield Extension(
        model.insert_before(
            site.input, lambda u: factor.symbol * u, [factor], new_name=free_name(model, f"{site.input}_effective")
        ),
        tuple({factor.name: value} for value in (0.8, 1.25, 0.4, 2.5)),
        "scale of the input",
        describe=partial(_describe, f"The effect of {site.input}"),
    )


def _describe(what: str, values: Mapping[str, float], _site: Site) -> str:
    (factor,) = values.values()
    return f"{what} is {factor:.3g} times what the model says."


EFFECT = Effect(
    "gain",
    "a known constant of the model, or the scale of its input, is wrong",
    extend,
)
