"""Powers, polynomials and broken lines, with an identity as their straight part: a free gain is not fitted twice.

``x |x/X|^(p-1)``, ``x + c2 x^2/X + c3 x^3/X^2 + ...`` with X the largest magnitude, and ``x + sum_i s_i (max(0, x -
q_i) - max(0, -q_i))`` with kinks at inner quantiles of the data, or two that are free.  All c and s are zero without
the effect, and p is one. A curve is no bias: zero stays zero. Of a channel that stays away from zero nobody knows what
a broken line does there, and the line may be moved, ``d + ...``: a valve need not begin to open where its signal is
zero.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
import sympy

from smid.diagnosis.effects.effect import Site
from smid.diagnosis.effects.parts.extremes import larger
from smid.diagnosis.effects.parts.naming import fresh
from smid.models import Model, Parameter
from smid.models.symbols import number

__all__ = ["Curve", "curves", "slope_changes"]

Curve = tuple[str, Callable[[sympy.Expr], sympy.Expr], list[Parameter], tuple[dict[str, float], ...]]
"""Label, map, parameters and starts."""

_BOX = (-5.0, 5.0)
_EXPONENTS = (0.2, 4.0)
_POWERS = (0.6, 1.6, 2.5)
_GUARD = 1e-6  # keeps the slope at zero finite where the exponent is below one


def curves(model: Model, site: Site, channel: str, stem: str) -> Iterator[Curve]:
    """Yield the curves that the levels in the data can distinguish from a straight line."""
    levels = np.unique(site.values(channel))
    if len(levels) < 3:
        return
    size = site.scale(channel)
    scale = number(size)
    exponent = fresh(model, f"{stem}_exponent", _EXPONENTS, "", 1.0)
    yield "power", _power(exponent, scale), [exponent], tuple({exponent.name: p} for p in _POWERS)
    if all(p.lower == p.upper for p in model.parameters if p.name not in model.origins):
        # No gain of the model can make up for the level at which the power is one.
        level = fresh(model, f"{stem}_level", (0.05 * size, 20 * size), site.unit(channel))
        starts = tuple({exponent.name: p, level.name: size} for p in _POWERS)
        yield "power about a level", _power(exponent, level.symbol), [exponent, level], starts
    square = fresh(model, f"{stem}_square", _BOX, "", 0.0)
    cube = fresh(model, f"{stem}_cube", _BOX, "", 0.0)

    def polynomial(*used: tuple[Parameter, int]) -> Callable[[sympy.Expr], sympy.Expr]:
        return lambda x: x + sum((p.symbol * x**power / scale ** (power - 1) for p, power in used), sympy.Integer(0))

    def sloped(count: int) -> list[Parameter]:
        return [fresh(model, f"{stem}_kink_{'abc'[k]}", _BOX, "", 0.0) for k in range(count)]

    yield "square", polynomial((square, 2)), [square], ({square.name: 0.3}, {square.name: -0.3})
    yield "cube", polynomial((cube, 3)), [cube], ({cube.name: 0.3}, {cube.name: -0.3})
    yield (
        "square and cube",
        polynomial((square, 2), (cube, 3)),
        [square, cube],
        ({square.name: 0.2, cube.name: 0.2}, {square.name: -0.2, cube.name: -0.2}),
    )
    higher = [fresh(model, f"{stem}_{power}", _BOX, "", 0.0) for power in ("fourth", "fifth")]
    every = [square, cube, *higher]
    yield (
        "up to the fifth power",
        polynomial(*zip(every, (2, 3, 4, 5), strict=True)),
        every,
        ({p.name: 0.1 for p in every}, {p.name: -0.1 for p in every}),
    )
    low, high = float(levels[0]), float(levels[-1])
    moved = [fresh(model, f"{stem}_offset", (-size, size), site.unit(channel), 0.0)] if low > 0 or high < 0 else []
    for places in ((0.5,), (0.25, 0.5, 0.75)):
        quantiles = np.unique(np.quantile(site.values(channel), places))
        kinks = [float(x) for x in quantiles if levels[0] < x < levels[-1]]
        if len(kinks) < len(places):
            continue
        slopes = sloped(len(kinks))
        yield (
            f"{len(kinks) + 1} straight pieces",
            _broken([number(x) for x in kinks], slopes, moved),
            [*slopes, *moved],
            tuple({p.name: a for p in slopes} | {p.name: 0.0 for p in moved} for a in (0.3, -0.3)),
        )
    ends = [fresh(model, f"{stem}_{at}", (low, high), site.unit(channel)) for at in ("first_kink", "second_kink")]
    slopes = sloped(2)
    yield (
        "3 straight pieces",
        _broken([p.symbol for p in ends], slopes, moved),
        [*slopes, *ends, *moved],
        tuple(
            {slopes[0].name: a, slopes[1].name: b}
            | {p.name: low + share * (high - low) for p, share in zip(ends, (0.35, 0.65), strict=True)}
            | {p.name: 0.0 for p in moved}
            for a, b in ((0.5, -0.5), (-0.3, 0.5))
        ),
    )


def _power(exponent: Parameter, scale: sympy.Expr) -> Callable[[sympy.Expr], sympy.Expr]:
    return lambda x: x * (sympy.Abs(x / scale) + number(_GUARD)) ** (exponent.symbol - 1)


def slope_changes(values: Mapping[str, float], stem: str) -> str:
    """List by how much the slope of a broken line changes at each kink; empty for a polynomial."""
    return ", ".join(f"{value:+.0%}" for name, value in values.items() if name.startswith(f"{stem}_kink_"))


def _broken(
    kinks: Sequence[sympy.Expr], slopes: Sequence[Parameter], moved: Sequence[Parameter]
) -> Callable[[sympy.Expr], sympy.Expr]:
    def bent(x: sympy.Expr) -> sympy.Expr:
        hinges = (larger(0, x - kink) - larger(0, -kink) for kink in kinks)
        terms = [p.symbol * hinge for p, hinge in zip(slopes, hinges, strict=True)]
        return x + sum(terms + [p.symbol for p in moved], sympy.Integer(0))

    return bent
