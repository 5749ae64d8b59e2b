"""Viscous friction: a force against motion in proportion to speed, ``-d v``.

Offered only where the model has no damping yet.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.motion import Motion, motions
from smid.diagnosis.effects.parts.naming import find, fresh, quantity
from smid.diagnosis.effects.parts.slides import slides
from smid.models import Model
from smid.models.symbols import plain_symbols

__all__ = ["EFFECT"]


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Put it on each motion that has no damping."""
    free = {p.name for p in model.parameters if p.lower < p.upper}
    for motion in motions(model, site):
        state = motion.state
        # A known decay is a damping: the effect `gain` checks it.
        damped = plain_symbols(state.own_coefficient(2)) & free if motion.kind == "position" else state.leak != 0
        if damped:
            continue
        least, usual = _sizes(motion)
        damping = fresh(model, f"{motion.kind}_damping", (least, 10 * usual), "1/s" if state.line.rate else "", 0.0)
        yield Extension(
            model.add_term(state.line.signal, -damping.symbol * motion.speed, [damping]),
            tuple({damping.name: share * usual} for share in (0.1, 0.02, 0.5)),
            f"{state.own} as {motion.kind}",
        )
    for slide in slides(model, site):
        if not slide.damped:
            usual = slide.force_scale / slide.full
            damping = fresh(model, "sliding_damping", (-10 * usual, 10 * usual), "", 0.0)
            yield Extension(
                model.add_term(slide.line, damping.symbol * slide.speed, [damping]),
                tuple({damping.name: share * usual} for share in (0.1, -0.1)),
                slide.label,
                describe=partial(_in_balance, slide.what),
            )


def _sizes(motion: Motion) -> tuple[float, float]:
    """Return the least and the usual damping; a known damping may be too large, so the least is negative."""
    usual = motion.force_scale / motion.speed_scale
    return -0.5 * usual, usual


def describe(values: Mapping[str, float], site: Site) -> str:  # noqa: ARG001  (every effect is called alike)
    """Say how large it is."""
    return f"A force against motion grows with speed: {quantity(find(values, 'damping') or 0.0)} times the speed."


def _in_balance(what: str, values: Mapping[str, float], site: Site) -> str:
    (damping,) = values.values()
    return f"A viscous friction adds {damping:.3g} times {what} to {site.output}."


EFFECT = Effect(
    "viscous_friction",
    "a force against motion in proportion to speed",
    extend,
    describe,
    needs="a motion without damping",
)
