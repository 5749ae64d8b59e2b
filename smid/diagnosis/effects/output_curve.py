"""Output curve: a static nonlinearity of the sensor (Wiener).

Besides powers, polynomials and straight pieces: ``w + c (|w| - w)`` (a sensor without sign) and ``(1 - c) w + d + b
sin(k w + phi)`` (a resolver; about a level, as in the hybrid thesis's table 2).
Reference: Bai, Automatica 34 (1998) 333-338 (Wiener models).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from functools import partial

import numpy as np
import sympy

from relaxations.algebra.arrays import Array
from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.asked_for import AskedFor, Start
from smid.diagnosis.effects.parts.hinges import curves, slope_changes
from smid.diagnosis.effects.parts.naming import find, free_name, fresh, quantity
from smid.diagnosis.effects.parts.signs import signed_fit
from smid.models import Model, Parameter

__all__ = ["EFFECT"]

_NEAR_ZERO = 0.1  # of the scale; a magnitude comes this close to zero
_NEGATIVE = 1e-3  # of the scale; a rounding error below zero is no sign


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Put each curve at the sensor."""
    size = site.scale(site.output)
    name = free_name(model, f"{site.output}_curved")

    def seen(curve: Callable[[sympy.Expr], sympy.Expr], parameters: list[Parameter]) -> Model:
        return model.insert_sensor(site.output, curve, parameters, new_name=name)

    simulated = _simulated(site)
    reach = float(np.abs(simulated).max()) or size
    fold = fresh(model, "output_fold", (-1, 2), "", 0.0)
    # Of one sign, it is a gain.
    both = simulated.min() < -_NEGATIVE * reach and simulated.max() > _NEGATIVE * reach
    if both or _may_be_magnitude(site):
        known = ({fold.name: 0.9}, {fold.name: 0.4}) if both else ()
        yield Extension(
            seen(lambda w: w + fold.symbol * (sympy.Abs(w) - w), [fold]),
            AskedFor(partial(_folded, model, site, fold.name, known)),
            "magnitude",
        )
    for label, curve, parameters, starts in curves(model, site, site.output, "output_curve"):
        yield Extension(seen(curve, parameters), starts, label)
    less = fresh(model, "output_sine_instead", (-1, 2), "", 0.0)
    height = fresh(model, "output_sine_height", (-3 * size, 3 * size), site.unit(site.output), 0.0)
    level = fresh(model, "output_sine_level", (-3 * size, 3 * size), site.unit(site.output), 0.0)
    turns = fresh(model, "output_sine_rate", (0.1 / reach, 40 / reach))
    phase = fresh(model, "output_sine_phase", (-math.pi, math.pi), "rad")
    yield Extension(
        seen(
            lambda w: (1 - less.symbol) * w + level.symbol + height.symbol * sympy.sin(turns.symbol * w + phase.symbol),
            [less, level, height, turns, phase],
        ),
        tuple(
            {less.name: c, level.name: 0.0, height.name: 0.5 * c * size, turns.name: k / reach, phase.name: 0.0}
            for k in (1.5, 3.0, 6.0, 12.0)
            for c in (0.9, 0.3)
        ),
        "sine",
    )


def _may_be_magnitude(site: Site) -> bool:
    """Return whether the output comes close to zero and not below, while the input has both signs."""
    low, high = site.span(site.output)
    drive = site.span(site.input)
    return -_NEGATIVE * high <= low <= _NEAR_ZERO * high and drive[0] < 0 < drive[1]


def _folded(model: Model, site: Site, fold: str, known: tuple[Start, ...]) -> tuple[Start, ...]:
    """Return starts of a magnitude: the values that fit best with guessed signs, and those that are known."""
    found = signed_fit(model, site) if _may_be_magnitude(site) else None
    return (*([{**found, fold: 0.9}] if found is not None else []), *known)


def _simulated(site: Site) -> Array:
    """Return the base model's output, which may be negative where the sensor's is not."""
    runs = [run.values[site.output] for run in site.data.experiments]
    if site.residual:
        runs = [y - e for y, e in zip(runs, site.residual, strict=True)]
    return np.concatenate(runs)


def describe(values: Mapping[str, float], site: Site) -> str:
    """Say which curve, with its size."""
    y, unit, full = site.output, site.unit(site.output), site.scale(site.output)
    fold, exponent = find(values, "output_fold"), find(values, "output_curve_exponent")
    if fold is not None:
        return f"The sensor of {y} shows the magnitude of negative values (full rectification: 100%, here {fold:.0%})."
    if exponent is not None:
        return f"The sensor of {y} shows its power {exponent:.3g}."
    height = find(values, "output_sine_height")
    if height is not None:
        period = 2 * math.pi / (find(values, "output_sine_rate") or 1.0)
        return f"The sensor of {y} shows a sine of {quantity(height, unit)} with a period of {quantity(period, unit)}."
    if slopes := slope_changes(values, "output_curve"):
        return f"The sensor of {y} shows a broken line whose slope changes by {slopes} at its kinks."
    return f"The sensor of {y} shows a curve: at {quantity(full, unit)} {sum(values.values()):+.0%} of a straight line."


EFFECT = Effect(
    "output_curve",
    "the sensor shows a curve",
    extend,
    describe,
)
