"""Drift: a parameter of the plant moves slowly with time, ``p -> p + dp time / T``, T the length of the record.

Reference: Ljung, System Identification, 2nd ed. (1999), section 11.1 (time-varying systems).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.clock import with_clock
from smid.diagnosis.effects.parts.naming import quantity
from smid.diagnosis.effects.parts.varying import Varied, extensions
from smid.models import Model
from smid.models.symbols import number

__all__ = ["EFFECT"]


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Let each parameter of the plant drift."""
    timed, now = with_clock(model, site.sampling_time)
    yield from extensions(timed, "drift", lambda _: now / number(site.duration), _describe)


def _describe(varied: Varied, values: Mapping[str, float], site: Site) -> str:
    return f"{varied.what} moves {varied.much(values)} over {quantity(site.duration, 's')}."


EFFECT = Effect(
    "parameter_drift",
    "a parameter moves slowly with time",
    extend,
    needs="a model with parameters",
)
