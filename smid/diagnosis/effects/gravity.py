"""Gravity: a torque ``-g sin(x)`` on an angle x, ``g = m g0 l / J``, or a constant force, as of a load that hangs.

The angle is the position that the output shows. In radians or degrees it is taken as it is. In another unit its scale,
radians per unit, is a parameter, and its starts fit the equation of motion, integrated twice. The arm need not hang
where the sensor shows zero: then the torque is ``-g sin(x - x0)``, written as ``-a sin(x) - b cos(x)``. A constant
force is offered in rates only, where a position is known to be one. All forces are zero without the effect. In a
difference equation the force acts half way along the step (see `smid.diagnosis.effects.stiffness`).
Reference: Spong, Hutchinson and Vidyasagar, Robot Modeling and Control, 2nd ed. (2020), section 6.3.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from functools import partial

import numpy as np
import sympy

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.motion import Position, acceleration, positions
from smid.diagnosis.effects.parts.naming import find, fresh, quantity
from smid.models import Model
from smid.models.symbols import number

__all__ = ["EFFECT"]

_RADIANS = {"rad": 1.0, "deg": math.pi / 180, "°": math.pi / 180}
_TURNS = np.geomspace(0.2, 40.0, 80)  # radians at the end of the range, where the unit does not tell
_STRONGEST = 50.0  # times the largest acceleration in the record
_STARTS = 3


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Put a pendulum, one from another zero, and a constant force on each position."""
    for place in positions(model, site):
        line, most = place.motion.state.line.signal, _STRONGEST * place.motion.force_scale
        sine, cosine, force = (
            fresh(model, f"gravity_{part}", (-most, most), acceleration(site, place.time), 0.0)
            for part in ("sine", "cosine", "force")
        )
        radians = _RADIANS.get(site.unit(site.output))
        if radians is None:
            turns = (_TURNS / place.reach).tolist()
            shape = [fresh(model, "gravity_turn", (turns[0], turns[-1]))]
            angle = shape[0].symbol * place.level
        else:
            turns, shape, angle = [radians], [], number(radians) * place.level
        pull = -sine.symbol * sympy.sin(angle)
        for label, term, weights in (
            ("pendulum", pull, [sine]),
            ("pendulum with another zero", pull - cosine.symbol * sympy.cos(angle), [sine, cosine]),
        ):
            new = [*weights, *shape]
            starts = _fitted(model, site, place, turns, len(weights))
            yield Extension(
                model.add_term(line, term, new),
                tuple({p.name: min(p.upper, max(p.lower, x)) for p, x in zip(new, s, strict=False)} for s in starts),
                f"{label} on {place.name}",
                describe=partial(_pendulum, place.time, radians or 1.0),
            )
        if place.motion.state.line.rate:
            usual = 0.1 * place.motion.force_scale
            yield Extension(
                model.add_term(line, force.symbol, [force]),
                ({force.name: usual}, {force.name: -usual}),
                f"constant on {place.name}",
                describe=partial(_constant, place.time),
            )


def _fitted(model: Model, site: Site, place: Position, turns: list[float], count: int) -> list[list[float]]:
    """Fit the equation of motion, integrated twice, to the measured angle; return weights of sine and cosine, and turn.

    Linear in all but the turn, and smoother than accelerations. First angle and speed of each experiment are projected
    out.
    """
    step = site.sampling_time if place.time == "s" else 1.0
    found = []
    for turn in turns:
        parts = []
        for run in site.data.experiments:
            y, one = run.values[site.output], np.ones(run.n_samples)
            forces = [np.sin(turn * y), np.cos(turn * y)][:count]
            forces += [run.values[name] for name in model.input_channels]
            twice = [np.cumsum(np.cumsum(x)) * step**2 for x in (*forces, y, one)]
            begun = np.linalg.qr(np.column_stack((one, np.arange(run.n_samples))))[0]
            whole = np.column_stack((*twice, np.cumsum(y) * step, y))
            parts.append(whole - begun @ (begun.T @ whole))
        *columns, y = np.concatenate(parts).T
        size = np.array([np.linalg.norm(column) or 1.0 for column in columns])
        basis = np.column_stack(columns) / size
        weights = np.linalg.lstsq(basis, y, rcond=1e-12)[0]
        found.append((float(np.sum((y - basis @ weights) ** 2)), [*(-weights / size)[:count].tolist(), turn]))
    left = [math.inf, *(item[0] for item in found), math.inf]
    lowest = [item for k, item in enumerate(found) if left[k] > item[0] <= left[k + 2]]
    return [start for _, start in sorted(lowest)[:_STARTS]]


def _pendulum(time: str, radians: float, values: Mapping[str, float], site: Site) -> str:
    y, scale = site.output, find(values, "gravity_turn") or radians
    sine, cosine = find(values, "gravity_sine") or 0.0, find(values, "gravity_cosine") or 0.0
    size = quantity(math.hypot(sine, cosine), acceleration(site, time))
    zero = math.atan2(-cosine, sine) / scale
    angle = f"({y} {-zero:+.3g})" if zero else y
    return f"Gravity pulls at {y} with {size} times the sine of {scale:.3g} {angle}, in radians."


def _constant(time: str, values: Mapping[str, float], site: Site) -> str:
    (force,) = values.values()
    size = quantity(force, acceleration(site, time))
    return f"A constant force, such as a load that hangs, accelerates {site.output} by {size}."


EFFECT = Effect(
    "gravity",
    "gravity turns an arm, or a constant force pulls",
    extend,
    needs="a position that is the output",
)
