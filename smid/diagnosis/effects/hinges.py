"""Polynomials and broken lines with an identity as their straight part, so that a free gain is not fitted twice.

``x + c2 x^2/X + c3 x^3/X^2`` with X the largest magnitude, and ``x + sum_i s_i max(0, x - q_i)`` with kinks at inner
quantiles of the data.  All c and s are zero without the effect.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import sympy

from smid.diagnosis.effects.effect import Site
from smid.diagnosis.effects.naming import fresh
from smid.models import Model, Parameter
from smid.models.symbols import number

__all__ = ["Curve", "curves"]

Curve = tuple[str, Callable[[sympy.Expr], sympy.Expr], list[Parameter], tuple[dict[str, float], ...]]
"""Label, map, parameters and starts."""

_BOX = (-5.0, 5.0)


def curves(model: Model, site: Site, channel: str, stem: str) -> Iterator[Curve]:
    """Give the curves that the levels in the data can tell from a straight line.

    Parameters
    ----------
    model : Model
        Model to be extended.
    site : Site
        Where the data are.
    channel : str
        Channel whose levels the curve is for.
    stem : str
        Beginning of the parameters' names.
    """
    levels = np.unique(site.values(channel))
    if len(levels) < 3:
        return
    scale = number(site.scale(channel))
    square = fresh(model, f"{stem}_square", _BOX, "", 0.0)
    cube = fresh(model, f"{stem}_cube", _BOX, "", 0.0)

    def polynomial(*used: tuple[Parameter, int]) -> Callable[[sympy.Expr], sympy.Expr]:
        return lambda x: x + sum((p.symbol * x**power / scale ** (power - 1) for p, power in used), sympy.Integer(0))

    yield "square", polynomial((square, 2)), [square], ({square.name: 0.3}, {square.name: -0.3})
    yield "cube", polynomial((cube, 3)), [cube], ({cube.name: 0.3}, {cube.name: -0.3})
    yield (
        "square and cube",
        polynomial((square, 2), (cube, 3)),
        [square, cube],
        ({square.name: 0.2, cube.name: 0.2}, {square.name: -0.2, cube.name: -0.2}),
    )
    for places in ((0.5,), (0.25, 0.5, 0.75)):
        quantiles = np.unique(np.quantile(site.values(channel), places))
        kinks = [float(x) for x in quantiles if levels[0] < x < levels[-1]]
        if len(kinks) < len(places):
            continue
        slopes = [fresh(model, f"{stem}_kink_{'abc'[k]}", _BOX, "", 0.0) for k in range(len(kinks))]
        yield (
            f"{len(kinks) + 1} straight pieces",
            _broken(kinks, slopes),
            slopes,
            ({p.name: 0.3 for p in slopes}, {p.name: -0.3 for p in slopes}),
        )


def _broken(kinks: list[float], slopes: list[Parameter]) -> Callable[[sympy.Expr], sympy.Expr]:
    return lambda x: (
        x
        + sum(
            (p.symbol * sympy.Max(0, x - number(kink)) for p, kink in zip(slopes, kinks, strict=True)), sympy.Integer(0)
        )
    )
