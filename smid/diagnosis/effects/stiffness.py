"""Stiffness: a restoring force that is not in proportion to the position x.

A *cubic* spring hardens or softens, ``-k3 x^3``. A spring behind a *gap* acts on what exceeds it, ``-k (x - max(-g,
min(g, x)))``. k3 and k are zero without the effect. In a difference equation of order two the force acts on the step to
``w[t]`` with the position ``w[t-1]``, half way: Stoermer's rule, of second order in the sampling time.
References: Kovacic and Brennan, The Duffing Equation (2011); Wigren and Schoukens, Three free data sets for development
and benchmarking in nonlinear system identification, ECC (2013) (silverbox); Hairer, Lubich and Wanner, Acta Numerica 12
(2003) 399-450 (Stoermer's rule).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.extremes import larger, smaller
from smid.diagnosis.effects.parts.motion import acceleration, positions
from smid.diagnosis.effects.parts.naming import fresh, quantity
from smid.models import Model

__all__ = ["EFFECT"]

_STRONGEST = 4.0  # times the position, per sample squared: beyond it a step is unstable


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Put each spring on each position."""
    for place in positions(model, site):
        line, x, reach = place.motion.state.line.signal, place.level, place.reach
        usual = place.motion.force_scale / reach
        most = _STRONGEST / (site.sampling_time**2 if place.time == "s" else 1.0)
        unit = f"1/{place.time}^2"
        cube = fresh(
            model, "spring_cube", (-most / reach**2, most / reach**2), f"{unit}/{site.unit(site.output)}^2", 0.0
        )
        yield Extension(
            model.add_term(line, -cube.symbol * x**3, [cube]),
            tuple({cube.name: share * usual / reach**2} for share in (0.1, -0.05, 0.5)),
            f"cubic on {place.name}",
            describe=partial(_cubic, place.time),
        )
        beyond = fresh(model, "spring_beyond", (0, most), unit, 0.0)
        gap = fresh(model, "spring_gap", (0, reach), site.unit(site.output))
        inside = larger(-gap.symbol, smaller(gap.symbol, x))
        yield Extension(
            model.add_term(line, -beyond.symbol * (x - inside), [beyond, gap]),
            tuple({beyond.name: 0.3 * usual, gap.name: share * reach} for share in (0.2, 0.4, 0.7)),
            f"gap on {place.name}",
            describe=partial(_behind_a_gap, place.time),
        )


def _cubic(time: str, values: Mapping[str, float], site: Site) -> str:
    y, (cube,) = site.output, values.values()
    way = "hardens" if cube > 0 else "softens"
    return (
        f"The spring {way} with the cube of {y}: its force on a unit of mass has the term {cube:.3g} {y}^3, in "
        f"{acceleration(site, time)}."
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
