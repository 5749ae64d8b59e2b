"""Stribeck friction: larger at rest than when sliding, ``F(v) = F + extra exp(-|v| / vf)``.

In a difference equation v is the speed of the sample before.  Reference: Armstrong-Helouvry, Dupont, Canudas de Wit,
Automatica 30 (1994) 1083-1138.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial

import sympy

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.motion import dry_motions, time_of, with_dry_friction
from smid.diagnosis.effects.parts.naming import find, fresh, quantity
from smid.diagnosis.effects.parts.slides import slides
from smid.models import Model

__all__ = ["EFFECT"]


def extend(base: Model, site: Site) -> Iterator[Extension]:
    """Put it on each motion."""
    for model, motion in dry_motions(base, site):
        rate, full, force = motion.state.line.rate, motion.speed_scale, motion.force_scale
        sliding = fresh(model, f"{motion.friction}_sliding", (0, 5 * force), "", 0.0)
        extra = fresh(model, f"{motion.friction}_extra", (0, 5 * force), "", 0.0)
        fading = fresh(model, "friction_fading", (1e-2 * full, full))
        sticking = fresh(model, "friction_sticking", (1e-3 * full, 0.2 * full)) if rate else None
        shape = {sticking.name: 0.05 * full} if sticking else {}
        threshold = sliding.symbol + extra.symbol * sympy.exp(-sympy.Abs(motion.speed) / fading.symbol)
        yield Extension(
            with_dry_friction(model, motion, threshold, [sliding, extra, fading], sticking),
            tuple(
                {sliding.name: share * force, extra.name: share * force, fading.name: fade * full, **shape}
                for share in (0.1, 0.02, 0.4)
                for fade in (0.1, 0.3)
            ),
            f"{motion.state.own} as {motion.kind}" + (" (regularised)" if rate else ""),
        )
    for slide in slides(base, site):
        unit = site.unit(site.output)
        sliding = fresh(base, "sliding_friction", slide.forces, unit, 0.0)
        extra = fresh(base, "sliding_friction_extra", slide.forces, unit, 0.0)
        fading = fresh(base, "friction_fading", (1e-2 * slide.full, slide.full))
        sticking = fresh(base, "friction_sticking", slide.sticking)
        size = sliding.symbol + extra.symbol * sympy.exp(-sympy.Abs(slide.speed) / fading.symbol)
        yield Extension(
            base.add_term(slide.line, size * slide.way(sticking), [sliding, extra, fading, sticking]),
            tuple(
                {sliding.name: force, extra.name: force, fading.name: fade * slide.full, sticking.name: speed}
                for force in slide.sizes
                for fade in (0.1, 0.3)
                for speed in slide.speeds
            ),
            slide.label,
            describe=partial(_in_balance, slide.what),
        )


def describe(values: Mapping[str, float], site: Site) -> str:  # noqa: ARG001  (every effect is called alike)
    """Say how large the force is, sliding and at rest."""
    sliding, extra = find(values, "friction_sliding") or 0.0, find(values, "friction_extra") or 0.0
    per = time_of(next(iter(values)))
    return (
        f"Friction takes {quantity(sliding)} from the speed per {per} when sliding, and must be overcome by "
        f"{quantity(sliding + extra)} from rest."
    )


def _in_balance(what: str, values: Mapping[str, float], site: Site) -> str:
    sliding, extra, *_ = values.values()
    unit = site.unit(site.output)
    return (
        f"Friction with the sign of {what} adds {quantity(sliding, unit)} to {site.output} when sliding fast, and "
        f"{quantity(sliding + extra, unit)} when slow."
    )


EFFECT = Effect(
    "stribeck_friction",
    "a force against motion, larger at rest than when sliding",
    extend,
    describe,
    needs="a state that is the output, or a speed; or a force that channels explain, of which one is a speed",
)
