"""Stiffness: a restoring force that is not in proportion to the position x.

A *cubic* spring hardens or softens, ``-k3 x^3``; one that does so from a rest beside zero, or is not the same on both
sides, has a *square* beside the cube, ``-k2 x^2 - k3 x^3``. A spring behind a *gap* acts on what exceeds it, ``-k (x -
max(-g, min(g, x)))``. k2, k3 and k are zero without the effect. In a difference equation of order two the force acts on
the step to ``w[t]`` by Numerov's rule, of fourth order in the sampling time: with what it is at ``w[t-1]``, half way,
and a twelfth of its second difference, which the position without this part tells.
References: Kovacic and Brennan, The Duffing Equation (2011); Wigren and Schoukens, Three free data sets for development
and benchmarking in nonlinear system identification, ECC (2013) (silverbox); Hairer, Noersett and Wanner,
Solving Ordinary Differential Equations I, 2nd ed. (1993), section III.10 (Numerov's rule).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from itertools import product

import sympy

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.extremes import larger, smaller
from smid.diagnosis.effects.parts.motion import Position, acceleration, positions
from smid.diagnosis.effects.parts.naming import fresh, quantity
from smid.models import Model, Parameter, signal, t

__all__ = ["EFFECT"]

_STRONGEST = 4.0  # times the position, per sample squared: beyond it a step is unstable


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Put each spring on each position."""
    for place in positions(model, site):
        reach = place.reach
        usual = place.motion.force_scale / reach
        most = _STRONGEST / (site.sampling_time**2 if place.time == "s" else 1.0)
        unit, length = f"1/{place.time}^2", site.unit(site.output)
        cube = fresh(model, "spring_cube", (-most / reach**2, most / reach**2), f"{unit}/{length}^2", 0.0)
        yield Extension(
            _pulled(model, place, [cube], lambda x, k3: k3 * x**3),
            tuple({cube.name: share * usual / reach**2} for share in (0.1, -0.05, 0.5)),
            f"cubic on {place.name}",
            describe=partial(_cubic, place.time),
        )
        square = fresh(model, "spring_square", (-most / reach, most / reach), f"{unit}/{length}", 0.0)
        yield Extension(
            _pulled(model, place, [square, cube], lambda x, k2, k3: k2 * x**2 + k3 * x**3),
            tuple(
                {square.name: slope * usual / reach, cube.name: share * usual / reach**2}
                for slope, share in product((0.05, -0.05), (0.1, -0.05))
            ),
            f"square and cube on {place.name}",
            describe=partial(_uneven, place.time),
        )
        beyond = fresh(model, "spring_beyond", (0, most), unit, 0.0)
        gap = fresh(model, "spring_gap", (0, reach), length)
        yield Extension(
            _pulled(model, place, [beyond, gap], lambda x, k, g: k * (x - larger(-g, smaller(g, x)))),
            tuple({beyond.name: 0.3 * usual, gap.name: share * reach} for share in (0.2, 0.4, 0.7)),
            f"gap on {place.name}",
            describe=partial(_behind_a_gap, place.time),
        )


def _pulled(model: Model, place: Position, parameters: list[Parameter], force: Callable[..., sympy.Expr]) -> Model:
    """Return the model with a force against the position, given that and the parameters, per unit of mass."""
    line, numbers = place.motion.state.line, [p.symbol for p in parameters]
    pulled = model.add_term(line.signal, -force(place.level, *numbers), parameters)
    if line.rate:
        return pulled
    before, last = (force(signal(place.name)[t - lag], *numbers) for lag in (2, 1))
    return pulled.insert_after(line.signal, lambda x: x - (force(x, *numbers) - 2 * last + before) / 12)


def _cubic(time: str, values: Mapping[str, float], site: Site) -> str:
    y, (cube,) = site.output, values.values()
    way = "hardens" if cube > 0 else "softens"
    return (
        f"The spring {way} with the cube of {y}: its force on a unit of mass has the term {cube:.3g} {y}^3, in "
        f"{acceleration(site, time)}."
    )


def _uneven(time: str, values: Mapping[str, float], site: Site) -> str:
    y, (square, cube) = site.output, values.values()
    return (
        f"The force of the spring is not in proportion to {y}: on a unit of mass it has the terms {square:.3g} {y}^2 "
        f"and {cube:.3g} {y}^3, in {acceleration(site, time)}."
    )


def _behind_a_gap(time: str, values: Mapping[str, float], site: Site) -> str:
    beyond, gap = values.values()
    return (
        f"A further spring acts where {site.output} is beyond +-{quantity(gap, site.unit(site.output))}: its force on "
        f"a unit of mass is {beyond:.3g} times what exceeds this gap, in {acceleration(site, time)}."
    )


EFFECT = Effect(
    "stiffness",
    "the restoring force hardens, softens or has a gap",
    extend,
    needs="a position that is the output",
)
