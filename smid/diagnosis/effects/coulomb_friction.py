"""Coulomb friction: a constant force against motion, which sticks.

See `smid.diagnosis.effects.parts.motion`, and `smid.diagnosis.effects.parts.slides` for a static force balance.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.motion import dry_motions, time_of, with_dry_friction
from smid.diagnosis.effects.parts.naming import find, fresh, quantity
from smid.diagnosis.effects.parts.slides import slides
from smid.models import Model

__all__ = ["EFFECT"]


def extend(base: Model, site: Site) -> Iterator[Extension]:
    """Put it on each motion."""
    for model, motion in dry_motions(base, site):
        rate = motion.state.line.rate
        force = fresh(model, motion.friction, (0, 5 * motion.force_scale), "", 0.0)
        speeds = (1e-3 * motion.speed_scale, 0.2 * motion.speed_scale)
        sticking = fresh(model, "friction_sticking", speeds) if rate else None
        shape = {sticking.name: 0.05 * motion.speed_scale} if sticking else {}
        yield Extension(
            with_dry_friction(model, motion, force.symbol, [force], sticking),
            tuple({force.name: share * motion.force_scale, **shape} for share in (0.1, 0.02, 0.5)),
            f"{motion.state.own} as {motion.kind}" + (" (regularised)" if rate else ""),
        )
    for slide in slides(base, site):
        force = fresh(base, "sliding_friction", slide.forces, site.unit(site.output), 0.0)
        sticking = fresh(base, "friction_sticking", slide.sticking)
        yield Extension(
            base.add_term(slide.line, force.symbol * slide.way(sticking), [force, sticking]),
            tuple({force.name: size, sticking.name: speed} for size in slide.sizes for speed in slide.speeds),
            slide.label,
            describe=partial(_in_balance, slide.what),
        )


def describe(values: Mapping[str, float], site: Site) -> str:
    """Say how large the force is."""
    force = quantity(find(values, "friction") or 0.0)
    name = next(iter(values))
    what = "speed" if name.startswith("speed_") else f"speed of {site.output}"
    return f"A constant friction takes {force} from the {what} per {time_of(name)} and holds it at rest below that."


def _in_balance(what: str, values: Mapping[str, float], site: Site) -> str:
    force, _ = values.values()
    size = quantity(force, site.unit(site.output))
    return f"A constant friction of {size} adds to {site.output}, with the sign of {what}."


EFFECT = Effect(
    "coulomb_friction",
    "a constant force against motion",
    extend,
    describe,
    needs="a state that is the output, or a speed; or a force that channels explain, of which one is a speed",
)
