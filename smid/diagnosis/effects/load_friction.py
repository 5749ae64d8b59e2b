"""Load friction: Coulomb friction in proportion to another channel, a normal load, a seal's pressure.

It sticks; see `smid.diagnosis.effects.parts.motion`, and `smid.diagnosis.effects.parts.slides` for a force balance. A
rate becomes the difference equation that integrates it.
Reference: Armstrong-Helouvry, Dupont and Canudas de Wit, Automatica 30 (1994) 1083-1138, section 2.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.channels import further
from smid.diagnosis.effects.parts.extremes import larger
from smid.diagnosis.effects.parts.motion import dry_motions, time_of, with_dry_friction
from smid.diagnosis.effects.parts.naming import fresh, quantity, read_channel
from smid.diagnosis.effects.parts.slides import slides
from smid.models import Model, signal, t
from smid.models.symbols import number

__all__ = ["EFFECT"]

_BELOW_ZERO = 0.1  # of the largest load: a pressure sensor may show a little less than none


def extend(base: Model, site: Site) -> Iterator[Extension]:
    """Put it on each motion that can stick, with each load."""
    for channel, low, high in further(base, site):
        if low < -_BELOW_ZERO * high:
            continue
        reading, name = read_channel(base, channel)
        for model, motion in dry_motions(reading, site):
            if motion.state.line.rate:
                continue
            force = fresh(model, f"load_{motion.friction}", (0, 5 * motion.force_scale), "", 0.0)
            pressing = larger(0, signal(name)[t - motion.state.lag]) / number(high)
            yield Extension(
                with_dry_friction(model, motion, force.symbol * pressing, [force], None),
                tuple({force.name: share * motion.force_scale} for share in (0.1, 0.02, 0.5)),
                f"{motion.state.own} as {motion.kind}, with {channel}",
                describe=partial(_describe, channel, motion.state.own, time_of(motion.friction)),
            )
        for slide in slides(reading, site):
            force = fresh(reading, "load_sliding_friction", slide.forces, site.unit(site.output), 0.0)
            sticking = fresh(reading, "friction_sticking", slide.sticking)
            size = force.symbol * larger(0, signal(name)[t]) / number(high)
            yield Extension(
                reading.add_term(slide.line, size * slide.way(sticking), [force, sticking]),
                tuple({force.name: size, sticking.name: speed} for size in slide.sizes for speed in slide.speeds),
                f"{slide.label}, pressed by {channel}",
                describe=partial(_in_balance, channel, slide.what),
            )


def _describe(channel: str, state: str, time: str, values: Mapping[str, float], site: Site) -> str:
    """Say the force per unit of the load, and the largest."""
    (force,) = values.values()
    high, unit = site.span(channel)[1], site.unit(channel)
    return (
        f"Friction on {state} grows with {channel}: it takes {force / high:.3g} per {unit or 'unit'} of {channel} and "
        f"{time}, {force:.3g} at {quantity(high, unit)}."
    )


def _in_balance(channel: str, what: str, values: Mapping[str, float], site: Site) -> str:
    force, _ = values.values()
    high, unit, y = site.span(channel)[1], site.unit(channel), site.unit(site.output)
    return (
        f"Friction with the sign of {what} grows with {channel}: it adds {quantity(force / high, y)} per "
        f"{unit or 'unit'} of {channel} to {site.output}, {quantity(force, y)} at {quantity(high, unit)}."
    )


EFFECT = Effect(
    "load_friction",
    "a dry friction in proportion to a measured load",
    extend,
    needs="a further channel that is not negative, and a motion that comes to rest, or a force that channels explain",
)
