"""Elastic coupling: the mass is two masses with a spring and a damper between them, and maybe play.

The drive acts on the first mass v, and a share r of the mass is the second one, l. With the twist theta, the part e of
it beyond the play, and ``tau = sqrt(second mass / stiffness)``:

    (1 - r) dv/dt = f(v) - r dl/dt,    tau^2 dl/dt = e + 2 zeta tau de/dt,    dtheta/dt = v - l

f is the base model's acceleration, so that the sum of momenta follows the base model. Over each half of a sample dl/dt
is integrated by the trapezoidal rule, which neither damps nor blows up, in closed form: a force a = e / tau^2 that is
linear in theta beyond the play. tau is zero without the coupling. The sensor is at the first mass or at the second.
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
from smid.diagnosis.effects.parts.motion import Motion, integral, motions, stepped
from smid.diagnosis.effects.parts.naming import free_name, fresh
from smid.diagnosis.effects.parts.plant import output_signal
from smid.models import Model, Parameter, signal, t
from smid.models.symbols import number

__all__ = ["EFFECT"]

_WAYS = (("first mass", False, False), ("second mass", True, False), ("second mass, with play", True, True))
_PERIODS = (5.0, 9.0, 16.0)  # samples
_SHARES, _USUAL_SHARE = (0.25, 0.6), 0.4
_DAMPING = 0.05
_PARTS, _PARTS_IN_PLAY = 2, 3  # of a sample: one makes the swing 6 % too small at seven samples a period, two 1.5 %
_GAPS = (0.3, 2.0)  # of the twist by the largest acceleration


def extend(base: Model, site: Site) -> Iterator[Extension]:
    """Split each motion that the output shows: seen at either mass, and with play."""
    shown = output_signal(base, site)
    for rigid in motions(base, site):
        moved = integral(base, rigid)
        # A state of order two is a position here.
        if shown not in (rigid.state.own, moved) or (rigid.kind == "speed" and rigid.state.order > 1):
            continue
        model, motion = stepped(base, rigid, site)
        for label, at_second, play in _WAYS:
            split, spring, starts, shift = _split(model, site, motion, moved, play=play)
            if at_second:
                name = free_name(split, f"{site.output}_joined")
                split = split.insert_sensor(site.output, partial(operator.add, shift), new_name=name)
            said = partial(_describe, at_second, motion.state.own, tuple(p.name for p in spring))
            yield Extension(split, starts, f"{motion.state.own} at the {label}", describe=said)


def _split(
    model: Model, site: Site, motion: Motion, moved: str | None, *, play: bool
) -> tuple[Model, list[Parameter], tuple[dict[str, float], ...], sympy.Expr]:
    """Return the two masses, their parameters and starts, and how far the output at the second differs."""
    step, own = site.sampling_time, motion.state.own
    lasting = fresh(model, "spring_time", (0, site.duration / (4 * math.pi)), "s", 0.0)
    share, damping = fresh(model, "second_mass_share", (0.02, 0.95)), fresh(model, "coupling_damping", (0, 1))
    gap = fresh(model, "play", (0, 20 * motion.speed_scale), "", 0.0)
    spring = [lasting, share, damping, *([gap] if play else [])]
    r, zeta, tau = share.symbol, damping.symbol, lasting.symbol / number(step)
    raw = free_name(model, f"{own}_rigid")
    second, force, twist = (signal(free_name(model, f"{own}_{what}")) for what in ("second", "force", "twist"))

    # Speeds and the twist are per sample: the time of a step is one.
    last = motion.state.level if motion.kind == "position" else sympy.Integer(0)
    push = signal(raw)[t] - last - motion.speed
    count = _PARTS_IN_PLAY if play else _PARTS
    h, half = sympy.Rational(1, count), gap.symbol / 2
    now, then = h / 2 + 2 * zeta * tau, h / 2 - 2 * zeta * tau
    v, x, a, theta = motion.speed, second[t - 1], force[t - 1], twist[t - 1]
    momentum = v - r * (v - x)
    parts: list[tuple[str, sympy.Expr]] = []
    for k in range(1, count + 1):
        names = [free_name(model, f"{x.label}_{k}") if k < count else str(x.label) for x in (force, second, twist)]
        momentum += h * push
        coasting = x + then * a
        free = theta + h / 2 * (v - x + (momentum - coasting) / (1 - r))
        beyond = free - sympy.Max(-half, sympy.Min(half, free)) if play else free
        a_new, x_new, theta_new = (signal(name)[t] for name in names)
        v_new = (momentum - r * x_new) / (1 - r)
        parts += zip(
            names,
            (
                beyond / (tau**2 + h / 2 * now / (1 - r)),
                coasting + now * a_new,
                theta + h / 2 * (v - x + v_new - x_new),
            ),
            strict=True,
        )
        v, x, a, theta = v_new, x_new, a_new, theta_new
    split = model.insert_after(motion.state.line.signal, lambda _: last + v, spring, raw_name=raw)
    for name, expression in parts:
        split = split.with_line(name, expression)
    shift = x - v if motion.kind == "speed" else -theta
    if moved is not None:
        # The step that integrates the speed has seen the rigid one.
        half_step = number(step) / 2
        split = split.add_term(moved, half_step * (signal(own)[t] - signal(raw)[t]))
        shift = -number(step) * theta
    return split, spring, tuple(_starts(motion, spring, step)), shift


def _starts(motion: Motion, spring: list[Parameter], step: float) -> Iterator[dict[str, float]]:
    """Yield shares of the mass, or with play sizes of it, for each period of the swing."""
    names, push = [p.name for p in spring], motion.force_scale * (motion.step or 1.0)
    for period in _PERIODS:
        for share, gap in [(_USUAL_SHARE, gap) for gap in _GAPS] if len(spring) > 3 else [(s, 0.0) for s in _SHARES]:
            tau = period / (2 * math.pi * math.sqrt(1 - share))
            size = min(gap * push * tau**2, spring[-1].upper)
            yield dict(zip(names, (tau * step, share, _DAMPING, size), strict=False))


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
