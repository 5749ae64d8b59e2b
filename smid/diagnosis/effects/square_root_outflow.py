"""Square-root outflow: each vessel empties with the root of its level, all vessels of a cascade at once.

An orifice lets through the root of the level (Torricelli), a long pipe the level itself. The outflow q of a level v,
both as shares of the full vessel, obeys ``v = b' q + (1 - b') q^2`` with ``b' = 2 b / (1 + b)``:

    q = (R - b) / (1 - b),  R = sqrt(b^2 + (1 - b^2) v)

b = 1 is the linear outflow; b = 0 the root of v; in between it is the root of a level counted from ``b^2 / (1 - b^2)``
below, up to a constant: the outlet lies below the zero of the sensor. So one law without an exponent goes from the
linear outflow to the root.

In rates the outflow takes the place of the linear one. A difference equation of order one takes the step ``(1 - p^s) /
(s (1 - p))`` times its increment, s the slope of q, p its pole: the exponential Euler step, of second order in the
sampling time. A single difference equation of higher order is left out: its states are not levels. (Order two was
tried, as two vessels with the poles of the linear one. The fit of a linear model to two root tanks often has complex
poles, from which no such start exists, and from real poles the fit did not reach the noise.) Give a cascade as rates, a
line for each vessel.

References: Schoukens and Noel, Three benchmarks addressing open challenges in nonlinear system identification, IFAC
(2017) (cascaded tanks); Hochbruck and Ostermann, Acta Numerica 19 (2010) 209-286 (exponential Euler).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import sympy

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.extremes import larger
from smid.diagnosis.effects.parts.naming import fresh, quantity
from smid.diagnosis.effects.parts.outflow import cascade_name, cascades, with_outflow
from smid.diagnosis.effects.parts.plant import StateLine, shown_at, state_lines, with_increment, without_effects
from smid.models import Model
from smid.models.symbols import number

__all__ = ["EFFECT"]

_STARTS = (0.95, 0.8, 0.5, 0.1)  # the last is near the linear law, where the first step of a fit is to be trusted
_ROOT = 0.6  # below, the law is nearer to the linear one: the outlet would lie a fifth of the range below zero
_GUARD = 1e-6  # keeps the slope of the root at zero finite
_LEAST = 1e-3  # the least pole: a vessel has a positive one, what a fit tries may not


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Turn the linear outflow of each cascade; of a single vessel also with its outlet at another level."""
    states = state_lines(model)
    for vessels in cascades(states):
        if not vessels[0].line.rate and vessels[0].order > 1:
            continue
        # A vessel of the base model empties; a decay that an effect brought is friction, say.
        if any(without_effects(model, vessel.leak) == 0 for vessel in vessels):
            continue
        share = fresh(model, "root_share", (0, 1), "", 0.0)
        shown = shown_at(model, site, vessels[0])
        full = site.scale(shown)
        law, label = _Law(1 - share.symbol, number(full)), cascade_name(vessels, states)
        bare = model.with_parameter(share)
        yield Extension(
            _emptied(bare, vessels, states, law),
            tuple({share.name: start} for start in _STARTS),
            label,
            {share.name: (_ROOT, np.inf)},
            partial(_describe, label, shown),
        )
        if len(vessels) == 1:
            outlet = fresh(model, "root_outlet", (-full, full), site.unit(shown))
            # Without the effect the zero of the level must not matter.
            moved = replace(law, zero=share.symbol * outlet.symbol)
            yield Extension(
                _emptied(bare.with_parameter(outlet), vessels, states, moved),
                tuple({share.name: _STARTS[0], outlet.name: level * full} for level in (-0.1, 0.1)),
                f"{label}, outlet at another level",
                {share.name: (_ROOT, np.inf)},
                partial(_describe, label, shown),
            )


def _emptied(model: Model, vessels: Sequence[StateLine], states: Sequence[StateLine], law: _Law) -> Model:
    vessel = vessels[0]
    if vessel.line.rate or len(vessels) > 1:
        return with_outflow(model, vessels, states, law.outflow)
    inflow = vessel.increment + vessel.leak * vessel.level
    return with_increment(model, vessel, law.step(vessel.level, 1 - vessel.leak, inflow))


@dataclass(frozen=True)
class _Law:
    """The outflow, in the unit of the level, with b, the full level, and where the level is zero."""

    b: sympy.Expr
    full: sympy.Expr
    zero: sympy.Expr = sympy.S.Zero

    def outflow(self, level: sympy.Expr) -> sympy.Expr:
        return (level - self.zero) * (1 + self.b) / (self.b + self._root(level))

    def step(self, level: sympy.Expr, pole: sympy.Expr, inflow: sympy.Expr) -> sympy.Expr:
        """Return what a vessel gains in a sample, of which the linear one keeps the share `pole`."""
        slope, kept = (1 + self.b) / (2 * self._root(level)), larger(_LEAST, pole)
        return (1 - kept**slope) / (slope * (1 - kept)) * (inflow - (1 - pole) * self.outflow(level))

    def _root(self, level: sympy.Expr) -> sympy.Expr:
        return sympy.sqrt(self.b**2 + (1 - self.b**2) * (sympy.Abs(level - self.zero) / self.full + number(_GUARD)))


def _describe(vessels: str, shown: str, values: Mapping[str, float], site: Site) -> str:
    share, *outlet = values.values()
    b = 1 - share
    zero = share * sum(outlet) - site.scale(shown) * b**2 / max(1 - b**2, _GUARD)
    level = quantity(zero + 0.0, site.unit(shown))
    return f"The outflow ({vessels}) goes with the square root of the level, counted from {level}."


EFFECT = Effect(
    "square_root_outflow",
    "vessels empty with the square root of their level",
    extend,
    needs="a state of order one that decays in proportion to itself",
)
