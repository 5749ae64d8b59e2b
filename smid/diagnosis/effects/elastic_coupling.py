"""Elastic coupling: the mass is two masses with a spring and a damper between them, and maybe play.

The drive acts on the first mass; a share r of the mass is the second one, at the speed v - s. With the twist theta, the
part e of it beyond the play, and ``tau = sqrt(second mass / stiffness)``,

    v = rigid speed + r s,    (1 - r) ds/dt = f - a,    tau^2 a = e + 2 zeta tau de/dt,    dtheta/dt = s

where f is the base model's acceleration: the sum of momenta follows the base model. Over parts of a sample the
trapezoidal rule, which neither damps nor blows up, gives the force a of the spring in closed form. tau is zero without
the coupling. The sensor is at the first mass or at the second.
References: Hairer and Wanner, Solving Ordinary Differential Equations II (1996), IV.3 (trapezoidal rule); Nordin and
Gutman, Automatica 38 (2002) 1633-1649 (two masses with play).
"""

from __future__ import annotations

import math
import operator
from collections.abc import Iterator, Mapping
from functools import partial

import sympy

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.extremes import larger, smaller
from smid.diagnosis.effects.parts.motion import Motion, integral, motions, stepped
from smid.diagnosis.effects.parts.naming import free_name, fresh
from smid.diagnosis.effects.parts.plant import output_signal
from smid.models import Model, Parameter, signal, t
from smid.models.symbols import number

__all__ = ["EFFECT"]

# Where the sensor is, and with which shares of the mass and sizes of the play a fit begins; the play in parts of the
# twist by the largest acceleration. At the second mass the share hardly shows.
_WAYS: tuple[tuple[str, bool, tuple[tuple[float, ...], ...]], ...] = (
    ("first mass", False, ((0.25,), (0.6,))),
    ("second mass", True, ((0.4,),)),
    ("second mass, with play", True, ((0.4, 0.3), (0.4, 2.0))),
)
_PERIODS = (5.0, 9.0, 16.0)  # samples
_DAMPING = 0.05
_PARTS, _PARTS_IN_PLAY = 2, 3  # of a sample: one makes the swing 6 % too small at seven samples a period, two 1.5 %


def extend(base: Model, site: Site) -> Iterator[Extension]:
    """Split each motion that the output shows: seen at either mass, and with play."""
    shown = output_signal(base, site)
    for rigid in motions(base, site):
        moved = integral(base, rigid)
        # A state of order two is a position here.
        if shown not in (rigid.state.own, moved) or (rigid.kind == "speed" and rigid.state.order > 1):
            continue
        model, motion = stepped(base, rigid, site)
        for label, at_second, shapes in _WAYS:
            split, spring, shift = _split(model, site, motion, moved, play=len(shapes[0]) > 1)
            if at_second:
                name = free_name(split, f"{site.output}_joined")
                split = split.insert_sensor(site.output, partial(operator.add, shift), new_name=name)
            said = partial(_describe, at_second, motion.state.own, tuple(p.name for p in spring))
            yield Extension(
                split,
                tuple(_starts(motion, spring, shapes, site.sampling_time)),
                f"{motion.state.own} at the {label}",
                describe=said,
            )


def _split(
    model: Model, site: Site, motion: Motion, moved: str | None, *, play: bool
) -> tuple[Model, list[Parameter], sympy.Expr]:
    """Return the two masses, their parameters, and how far the output at the second differs."""
    step, own = site.sampling_time, motion.state.own
    lasting = fresh(model, "spring_time", (0, site.duration / (4 * math.pi)), "s", 0.0)
    share, damping = fresh(model, "second_mass_share", (0.02, 0.95)), fresh(model, "coupling_damping", (0, 1))
    gap = fresh(model, "play", (0, 20 * motion.speed_scale), "", 0.0)
    spring = [lasting, share, damping, *([gap] if play else [])]
    r, zeta, tau = share.symbol, damping.symbol, lasting.symbol / number(step)
    raw = free_name(model, f"{own}_rigid")
    slip, force, twist = (signal(free_name(model, f"{own}_{what}")) for what in ("slip", "force", "twist"))

    # Speeds and the twist are per sample: the time of a step is one.
    last = motion.state.level if motion.kind == "position" else sympy.Integer(0)
    split = model.insert_after(
        motion.state.line.signal, lambda w: w + r * (slip[t] - slip[t - 1]), spring, raw_name=raw
    )
    count = _PARTS_IN_PLAY if play else _PARTS
    h, half = sympy.Rational(1, count), gap.symbol / 2
    push = h * (signal(raw)[t] - last - motion.speed)
    now, then = h / 2 + 2 * zeta * tau, h / 2 - 2 * zeta * tau
    s, a, theta = slip[t - 1], force[t - 1], twist[t - 1]
    for k in range(1, count + 1):
        names = [free_name(split, f"{x.label}_{k}") if k < count else str(x.label) for x in (slip, force, twist)]
        s_new, a_new, theta_new = (signal(name)[t] for name in names)
        coasting = (push - then * a) / (1 - r)
        free = theta + h * s + h / 2 * coasting
        beyond = free - larger(-half, smaller(half, free)) if play else free
        split = split.with_line(names[1], beyond / (tau**2 + h / 2 * now / (1 - r)))
        split = split.with_line(names[0], s + coasting - now * a_new / (1 - r))
        split = split.with_line(names[2], theta + h / 2 * (s + s_new))
        s, a, theta = s_new, a_new, theta_new
    shift = -s if motion.kind == "speed" else -theta
    if moved is not None:
        # The step that integrates the speed has seen the rigid one.
        half_step = number(step) / 2
        split = split.add_term(moved, half_step * (signal(own)[t] - signal(raw)[t]))
        shift = -number(step) * theta
    return split, spring, shift


def _starts(
    motion: Motion, spring: list[Parameter], shapes: tuple[tuple[float, ...], ...], step: float
) -> Iterator[dict[str, float]]:
    """Yield the starts for each period of the swing."""
    push = motion.force_scale * (motion.step or 1.0)
    for period in _PERIODS:
        for share, *gaps in shapes:
            tau = period / (2 * math.pi * math.sqrt(1 - share))
            sizes = [min(gap * push * tau**2, spring[-1].upper) for gap in gaps]
            yield dict(zip([p.name for p in spring], (tau * step, share, _DAMPING, *sizes), strict=True))


def _describe(at_second: bool, state: str, names: tuple[str, ...], values: Mapping[str, float], site: Site) -> str:
    """Say the swing of the free masses and the play by the acceleration that twists the spring as far.

    The share of the mass is said where the sensor is at the first one: at the second it hardly shows.
    """
    tau, share, damping, *play = (values[name] for name in names)
    loose = math.sqrt(1 - share)
    swing = f"{1 / (2 * math.pi * tau * loose):.3g} Hz" if tau else "an infinite frequency"
    split = "the second" if at_second else f"the first, the second has {share:.0%} of the mass"
    gap = f", with a play as wide as {play[0] * site.sampling_time / tau**2:.3g} per second twist it" if play else ""
    return (
        f"{state} moves two masses with a spring between them{gap}: {site.output} shows {split}, and they swing at "
        f"{swing} with a damping ratio of {damping / loose:.2g}."
    )


EFFECT = Effect(
    "elastic_coupling",
    "the mass is two masses with a spring between them",
    extend,
    needs="a motion that the output shows",
)
