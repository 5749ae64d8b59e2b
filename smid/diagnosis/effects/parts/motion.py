"""States that are a speed or a position, for forces against motion.

A difference equation does not show which a state is, so both are offered: of any state as a *speed*, of one of
order two as a *position* whose increment is the speed.  In rates a position is a state whose rate is another state.

Dry friction on a speed in a difference equation acts along the step, and holds what comes to rest within it; of a
position it is the soft threshold ``s(v) = v - max(-F, min(F, v))`` of the speed that would be without it: the implicit
step, which sticks and does not chatter.  In a rate it is ``-F max(-1, min(1, v / vs))``.
References: Acary and Brogliato, Numerical Methods for Nonsmooth Dynamical Systems (2008), chapter 1 (implicit step);
Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30 (1994) 1083-1138 (friction models).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import sympy

from smid.diagnosis.effects.effect import Site
from smid.diagnosis.effects.parts.extremes import larger, smaller
from smid.diagnosis.effects.parts.plant import StateLine, output_signal, state_lines
from smid.models import Model, Parameter, signal, t
from smid.models.symbols import number

__all__ = [
    "Motion",
    "Position",
    "acceleration",
    "dry_motions",
    "integral",
    "motions",
    "positions",
    "stepped",
    "time_of",
    "with_dry_friction",
]


_REST, _SOME = 0.05, 0.02
_TINY = 1e-100  # below any speed; its inverse squared, in a slope, is still a number
_PER_STEP = "_step"


@dataclass(frozen=True)
class Motion:
    """A state line read as mechanics.

    Parameters
    ----------
    state
        The line that forces act on.
    kind
        "speed" or "position", what the state is.
    speed
        Speed before the step, per second in a rate, else per sample where the state is a position.
    speed_scale, force_scale
        Largest speed, and largest change of it per sample or per second, in the data.
    step
        Seconds, of a step that integrates a rate.
    """

    state: StateLine
    kind: str
    speed: sympy.Expr
    speed_scale: float
    force_scale: float
    step: float | None = None

    @property
    def friction(self) -> str:
        """Name of a friction force: as it changes the speed per second, or in a difference equation per step."""
        per_second = self.state.line.rate or self.step is not None
        return f"{self.kind}{'' if per_second else _PER_STEP}_friction"


def time_of(friction: str) -> str:
    """Return the time in which a friction of this name changes the speed by its value."""
    return "sample" if f"{_PER_STEP}_friction" in friction else "second"


def motions(model: Model, site: Site) -> Iterator[Motion]:
    """Yield the ways to read the plant's states as mechanics."""
    states = {state.own: state for state in state_lines(model)}
    output = output_signal(model, site)
    moved = _largest_change(site, 1)
    turned = _largest_change(site, 2)
    step = site.sampling_time
    driven = set()
    for state in states.values():
        if state.line.rate:
            expression = state.line.expression
            name = str(expression.base.label) if isinstance(expression, sympy.Indexed) else ""
            if name in states and states[name].line.rate:
                driven.add(name)
                speed = signal(name)[t]
                yield Motion(states[name], "speed", speed, moved / step, turned / step**2)
    for name, state in states.items():
        if name != output:
            continue
        moves_itself = isinstance(state.line.expression, sympy.Indexed)
        if state.line.rate and name not in driven and not moves_itself:
            yield Motion(state, "speed", state.level, site.scale(site.output), moved / step)
        if not state.line.rate:
            yield Motion(state, "speed", state.level, site.scale(site.output), moved)
            if state.order == 2:
                x = signal(name)
                yield Motion(state, "position", x[t - 1] - x[t - 2], moved, turned)


@dataclass(frozen=True)
class Position:
    """A position that the output shows, and the line that a force on it acts on.

    Parameters
    ----------
    name
        The state that is the position.
    motion
        The motion whose state line takes the force.
    level
        The position that the line reads.
    reach
        Largest magnitude of the position, in the output's unit.
    time
        Unit of time of a force on the line: "s", or "sample" in a difference equation.
    """

    name: str
    motion: Motion
    level: sympy.Expr
    reach: float
    time: str


def positions(model: Model, site: Site) -> Iterator[Position]:
    """Yield the positions among the states: of order two, or with a speed for a rate."""
    output, reach = output_signal(model, site), site.scale(site.output)
    for motion in motions(model, site):
        if motion.kind == "position":
            yield Position(motion.state.own, motion, motion.state.level, reach, "sample")
        elif integral(model, motion) == output:
            yield Position(output, motion, signal(output)[t], reach, "s")


def integral(model: Model, motion: Motion) -> str | None:
    """Return the position whose rate is the speed of a motion."""
    speed = signal(motion.state.own)[t]
    return next((s.own for s in state_lines(model) if s.line.rate and s.line.expression == speed), None)


def acceleration(site: Site, time: str) -> str:
    """Return the unit of an acceleration of the output; for the time see `Position`."""
    return f"{site.unit(site.output) or '1'}/{time}^2"


def dry_motions(model: Model, site: Site) -> Iterator[tuple[Model, Motion]]:
    """Yield the motions that dry friction can act on, each with the model it is a motion of.

    A rate comes twice: as it is, and as the difference equation that integrates it, where friction can stick.  A speed
    that neither turns nor comes to rest is left out: there dry friction is a constant force.
    """
    values, slow = site.values(site.output), _REST * site.scale(site.output)
    rests = np.quantile(np.abs(values), _SOME) <= slow
    turns = values.min() < -slow and values.max() > slow  # also from one experiment to another
    for motion in motions(model, site):
        is_speed = motion.kind == "speed" and motion.state.own == output_signal(model, site)
        if is_speed and not (rests or turns):
            continue
        yield model, motion
        if motion.state.line.rate:
            yield stepped(model, motion, site)


def stepped(model: Model, motion: Motion, site: Site) -> tuple[Model, Motion]:
    """Return a motion as a difference equation, with its model: of a rate the one that integrates it."""
    if not motion.state.line.rate:
        return model, motion
    discrete = model.discretised()
    state = next(s for s in state_lines(discrete) if s.line.signal == motion.state.line.signal)
    return discrete, replace(motion, state=state, speed=state.level, step=site.sampling_time)


def _largest_change(site: Site, order: int) -> float:
    """Return the largest difference of the output per sample, over a hundredth of the record against noise."""
    largest = 0.0
    for run in site.data.experiments:
        values = run.values[site.output]
        apart = max(1, len(values) // 100)
        for _ in range(order):
            values = (values[apart:] - values[:-apart]) / apart
        largest = max(largest, float(np.abs(values).max(initial=0.0)))
    return largest or site.scale(site.output)


def with_dry_friction(
    model: Model,
    motion: Motion,
    threshold: sympy.Expr,
    parameters: list[Parameter],
    sticking: Parameter | None,
) -> Model:
    """Put a dry friction force on a motion.

    Parameters
    ----------
    threshold
        The force, not negative, by what it changes the speed per second; in a difference equation per step.
    """
    line = motion.state.line
    if sticking is not None:
        sliding = larger(-1, smaller(1, motion.speed / sticking.symbol))
        return model.add_term(line.signal, -threshold * sliding, [*parameters, sticking])
    taken = threshold if motion.step is None else threshold * number(motion.step)
    if motion.kind == "speed":
        coasting = (1 - motion.state.leak) * motion.state.level
        return model.insert_after(line.signal, lambda v: _slid(coasting, v, taken), parameters)
    last = motion.state.level
    return model.insert_after(line.signal, lambda w: last + _held(w - last, taken), parameters)


def _held(v: sympy.Expr, threshold: sympy.Expr) -> sympy.Expr:
    """Take friction from a speed, to rest at most."""
    return v - larger(-threshold, smaller(threshold, v))


def _slid(coasting: sympy.Expr, free: sympy.Expr, threshold: sympy.Expr) -> sympy.Expr:
    """Return the speed after a step, from what it would be without friction, and without friction and drive.

    Exact for a mass, or a first-order lag, that a constant force drives during the step: where it comes to rest within
    the step it turns round, or stays.
    """
    drive, way = free - coasting, sympy.sign(coasting)
    going_on = way * larger(0, way * free - threshold)
    left = larger(0, 1 - sympy.Abs(coasting) / larger(_TINY, threshold - way * drive))  # of the step, from rest
    return going_on + left * _held(drive, threshold)
