"""Input curve: a static nonlinearity before the dynamics (Hammerstein): a power, a polynomial, or straight pieces.

Reference: Narendra and Gallman, IEEE Trans. Automatic Control 11 (1966) 546-550; the clutch of the hybrid thesis.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.hinges import curves, slope_changes
from smid.diagnosis.effects.parts.naming import find, free_name, quantity
from smid.models import Model

__all__ = ["EFFECT"]


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Put each curve before the input."""
    name = free_name(model, f"{site.input}_curved")
    for label, curve, parameters, starts in curves(model, site, site.input, "input_curve"):
        yield Extension(model.insert_before(site.input, curve, parameters, new_name=name), starts, label)


def describe(values: Mapping[str, float], site: Site) -> str:
    """Say how much the largest input gains or loses against a straight line."""
    full = site.scale(site.input)
    exponent = find(values, "input_curve_exponent")
    if exponent is not None:
        return f"The effect of {site.input} follows the power {exponent:.3g}, not 1."
    if slopes := slope_changes(values, "input_curve"):
        return f"{site.input} acts along a broken line whose slope changes by {slopes} at its kinks."
    share = sum(values.values())
    return (
        f"{site.input} acts along a curve: at {quantity(full, site.unit(site.input))} {share:+.0%} of a straight line."
    )


EFFECT = Effect(
    "input_curve",
    "the input acts along a curve",
    extend,
    describe,
    needs="an input with three levels or more",
)
