"""A sampled line of order two in stretched time: the plant goes on for m samples while one passes.

Write ``w[t] = -a1 w[t-1] - a2 w[t-2] + f[t-1] + g[t-2]`` with a second state q, ``x = (w, q)``:

    nominal step:     w' = -a1 w + q + f,   q' = -a2 w + g      all at t - 1
    stretched step:   x' = x + m (d + (m - 1)/2 (D d + (m - 2)/3 (D^2 d + (m - 3)/4 D^3 d)))

d is what a nominal step adds to x, and D = F - I, F the matrix of the step. With f and g held the plant goes on by
``(F^m - I) (x - rest) = sum_k C(m, k) D^(k-1) d``, Newton's binomial series; its first four terms are exact for m = 0
to 4, and m = 1 is the line itself. q is a fixed combination of level and speed, so that the pace may differ from step
to step. Delays are those of the line.

References: Ogata, Discrete-Time Control Systems, 2nd ed. (1995), section 5.2 (observable canonical form); Higham,
Functions of Matrices (2008), section 7.1 (powers of a matrix).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import sympy

from smid.diagnosis.effects.parts.naming import free_name
from smid.diagnosis.effects.parts.plant import StateLine, multiplied_out
from smid.models import Model, Parameter, signal, t
from smid.models.symbols import references, swapped

__all__ = ["stretched"]

_TERMS = 4


def stretched(
    model: Model, state: StateLine, pace: Callable[[sympy.Expr], sympy.Expr], parameters: Iterable[Parameter]
) -> Model | None:
    """Return the model with a line in stretched time; None where a term reads both the last sample and an older one.

    Parameters
    ----------
    pace
        Returns m for what a nominal step adds to the level.
    """
    if state.line.rate or state.order != 2:
        return None
    a1, a2 = -state.own_coefficient(1), -state.own_coefficient(2)
    w, q = signal(state.own), signal(free_name(model, f"{state.own}_ahead"))
    early, late = sympy.Integer(0), sympy.Integer(0)
    for term in sympy.Add.make_args(multiplied_out(state.line.expression + a1 * w[t - 1] + a2 * w[t - 2])):
        read = references(term)
        lags = [lag for _, lag in read]
        if min(lags, default=0) > 1:
            late += swapped(term, {signal(name)[t - lag]: signal(name)[t - lag + 1] for name, lag in read})
        elif max(lags, default=0) < 2:
            early += term
        else:
            return None
    added = (-(1 + a1) * w[t - 1] + q[t - 1] + early, -a2 * w[t - 1] - q[t - 1] + late)
    powers = [added]  # D^k d
    for _ in range(_TERMS - 1):
        first, second = powers[-1]
        powers.append((-(1 + a1) * first + second, -a2 * first - second))
    m, moved = pace(added[0]), (sympy.Integer(0), sympy.Integer(0))
    for k in reversed(range(_TERMS)):
        share, (first, second) = (m - k) / (k + 1), powers[k]
        moved = (share * (first + moved[0]), share * (second + moved[1]))
    model = model.replace_line(state.line.signal, w[t - 1] + moved[0], parameters)
    return model.with_line(str(q.label), q[t - 1] + moved[1])
