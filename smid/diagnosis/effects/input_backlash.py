"""Backlash: the input must cross a gap when it changes direction, ``p[t] = max(u - g/2, min(u + g/2, p[t-1]))``.

The play operator, written with the stop operator s, ``p = u - s``. With a gap of zero p is u.
Reference: Brokate and Sprekels, Hysteresis and Phase Transitions (1996), section 2.3.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.naming import find, free_name, fresh, quantity, signal_of
from smid.diagnosis.effects.parts.stop import stop
from smid.models import Model, signal, t

__all__ = ["EFFECT"]


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Put it before the input."""
    low, high = site.span(site.input)
    span = high - low
    if not span:
        return
    gap = fresh(model, "backlash_gap", (0, span), site.unit(site.input), 0.0)
    raw, name = signal(signal_of(model, site.input)), free_name(model, f"{site.input}_stop")
    played = model.insert_before(
        site.input,
        lambda u: u - signal(name)[t],
        [gap],
        new_name=free_name(model, f"{site.input}_play"),
    )
    yield Extension(
        played.with_line(name, stop(raw, signal(name), gap.symbol / 2)),
        tuple({gap.name: share * span} for share in (0.1, 0.25, 0.5)),
    )


def describe(values: Mapping[str, float], site: Site) -> str:
    """Say how far the input must come back."""
    gap = quantity(find(values, "backlash_gap") or 0.0, site.unit(site.input))
    return f"When it turns round, {site.input} must move by {gap} before it acts again."


EFFECT = Effect(
    "input_backlash",
    "the input must cross a gap when it turns round",
    extend,
    describe,
    needs="an input that moves",
)
