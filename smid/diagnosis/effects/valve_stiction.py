"""Stiction of a valve: it sticks until the command has moved by the band S, then slips by the jump J.

He's model of two parameters. The command pulls at the stem as a spring does; the pull is ``x = r[t-1] + u[t] -
u[t-1]``. Up to the static friction, ``|x| <= fS``, the valve stays and r[t] = x; beyond it slips until the pull is the
sliding friction, ``r[t] = fD sign(x)``. The valve is at ``u - r``. In Choudhury's words the stick band is ``S = fS +
fD``, what the command must cross when it turns round, and the slip jump is ``J = fS - fD``. Fitted are J and fD, zero
without the effect; with J = 0 it is a backlash.

A slip happens or does not, so no slope leads a fit to J: the starts are the best points of a grid.

References: He, Wang, Pottmann and Qin, Industrial & Engineering Chemistry Research 46 (2007) 3798-3812; Choudhury,
Thornhill and Shah, Control Engineering Practice 13 (2005) 641-658.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial

import sympy

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.asked_for import AskedFor
from smid.diagnosis.effects.parts.grid import best_of
from smid.diagnosis.effects.parts.naming import find, free_name, fresh, quantity, signal_of
from smid.models import Model, signal, t

__all__ = ["EFFECT"]

_STARTS = 3
_JUMPS = tuple(0.55 / 1.145**k for k in range(36))  # shares of the span, which is far larger where the input drifts
_SLIDING = tuple(0.45 / 1.25**k for k in range(22))


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Put it before the input."""
    low, high = site.span(site.input)
    span = high - low
    if not span:
        return
    unit = site.unit(site.input)
    jump, sliding = (fresh(model, name, (0, span), unit, 0.0) for name in ("slip_jump", "sliding_friction"))
    u, name = signal(signal_of(model, site.input)), free_name(model, f"{site.input}_pull")
    valve = free_name(model, f"{site.input}_valve")
    moved = model.insert_before(site.input, lambda v: v - signal(name)[t], [jump, sliding], new_name=valve)
    pull = signal(name)[t - 1] + u[t] - u[t - 1]
    slips = (1 + sympy.sign(sympy.Abs(pull) - sliding.symbol - jump.symbol)) / 2
    # Added after the insertion, the pull reads the command.
    extended = moved.with_line(name, pull + slips * (sliding.symbol * sympy.sign(pull) - pull))
    axes = {jump.name: [k * span for k in _JUMPS], sliding.name: [k * span for k in _SLIDING]}
    yield Extension(extended, AskedFor(partial(best_of, extended, site, axes, name, _STARTS)))


def describe(values: Mapping[str, float], site: Site) -> str:
    """Say how wide the band is and how large the jump."""
    unit, jump = site.unit(site.input), find(values, "slip_jump") or 0.0
    band = 2 * (find(values, "sliding_friction") or 0.0) + jump
    return (
        f"A valve sticks behind {site.input}: its stick band is {quantity(band, unit)}, its slip jump "
        f"{quantity(jump, unit)}."
    )


EFFECT = Effect(
    "valve_stiction",
    "the valve sticks, and jumps when it comes free",
    extend,
    describe,
    needs="an input that moves",
)
