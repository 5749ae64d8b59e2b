r"""Test whether the input reacts on past outputs.

In closed loop the input contains the noise of the output, and the estimates of an open-loop method are biased.  What an
input that was planned cannot know is the *innovation* of the output

.. math:: v_t = y_t - \sum_i a_i y_{t-i} - b_0 u_t - \sum_i b_i u_{t-i} ,

the part of y that neither its past nor u up to now tell.  Granger's test asks whether it helps to predict the
innovation of the input, :math:`w_t = u_t - \sum_i c_i u_{t-i}`: the regression of :math:`w_t` on
:math:`v_{t-1}, \ldots, v_{t-q}` against none.  Under no feedback v is white and knows nothing of u, so the test holds
for every input, a ramp, a sine or a PRBS too; the plain comparison of predictors of u with and without past y does not,
because past outputs remember older inputs than the predictor has lags.

The jumps of a reference would drown the reactions between them.  So the predictor of u is a robust one (weights of
Huber), and w is clipped: v knows nothing of any function of u.  A reaction within the same sample looks like a
direct path from u to y, and is not seen.

Reference: Granger, Investigating causal relations by econometric models, Econometrica 37 (1969); Ljung, System
Identification, 2nd ed., section 13.4.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import f

from relaxations.algebra.arrays import Array

ORDER = 10
REACTION = 5
_SMALLEST_INPUT, _SMALLEST_OUTPUT = 1e-4, 1e-3
"""Innovations below these shares of the deviation are rounding, or errors of the linear predictors."""


@dataclass(frozen=True)
class Feedback:
    """How much of the input past outputs explain.

    Parameters
    ----------
    share
        Part of the variance of the input's innovation that past innovations of the output explain.
    chance
        Probability of at least this share without feedback.
    """

    share: float
    chance: float


def feedback(inputs: Sequence[Array], outputs: Sequence[Array]) -> Feedback:
    """Test whether an input reacts on past outputs.

    Parameters
    ----------
    inputs, outputs
        Shape (N,). One for each experiment.

    Examples
    --------
    >>> random = np.random.default_rng(0)
    >>> u, y = np.zeros(600), np.zeros(600)
    >>> for t in range(1, 600):
    ...     u[t] = -0.5 * y[t - 1] + random.standard_normal()
    ...     y[t] = 0.8 * y[t - 1] + u[t - 1] + random.standard_normal()
    >>> feedback([u], [y]).chance < 1e-9, feedback([random.standard_normal(600)], [y]).chance > 0.01
    (True, True)
    """
    nothing = Feedback(0.0, 1.0)
    deviation = float(np.concatenate([u - u.mean() for u in inputs]).std())
    rows = [_rows(u, y) for u, y in zip(inputs, outputs, strict=True) if u.size > ORDER + REACTION]
    samples = sum(now.size for _, now, _, _ in rows)
    if deviation == 0 or samples < 10 * ORDER:
        return nothing
    past_u, past_y = np.concatenate([r[0] for r in rows]), np.concatenate([r[2] for r in rows])
    now_u, now_y = np.concatenate([r[1] for r in rows]), np.concatenate([r[3] for r in rows])
    w = _between_jumps(past_u, now_u)
    v = _left_over(np.column_stack([past_u, past_y, now_u]), now_y)
    if w.std() <= _SMALLEST_INPUT * deviation or v.std() <= _SMALLEST_OUTPUT * now_y.std():
        return nothing
    lagged, target = [], []
    start = 0
    for _, now, _, _ in rows:
        stop = start + now.size
        lagged.append(np.lib.stride_tricks.sliding_window_view(v[start : stop - 1], REACTION))
        target.append(w[start + REACTION : stop])
        start = stop
    phi, goal = np.concatenate(lagged), np.concatenate(target)
    left = _left_over(phi, goal)
    free = goal.size - 1 - REACTION
    total, rest = float(np.sum((goal - goal.mean()) ** 2)), float(left @ left)
    if free < 1 or rest <= 0:
        return nothing
    return Feedback(1 - rest / total, float(f.sf((total - rest) / REACTION / (rest / free), REACTION, free)))


def _rows(u: Array, y: Array) -> tuple[Array, Array, Array, Array]:
    def windows(x: Array) -> Array:
        return np.lib.stride_tricks.sliding_window_view(x[:-1], ORDER)

    return windows(u), u[ORDER:], windows(y), y[ORDER:]


def _between_jumps(phi: Array, target: Array) -> Array:
    """Return the residual of a regression that jumps of the target do not pull on, clipped."""
    left, limit = _left_over(phi, target), np.inf
    for _ in range(10):
        scale = 1.4826 * float(np.median(np.abs(left)))
        if scale <= 1e-12 * float(np.abs(target).max()):
            break
        limit = 2 * scale
        weight = np.sqrt(np.minimum(1.0, limit / np.maximum(np.abs(left), limit)))
        columns = np.column_stack([phi, np.ones(target.size)])
        left = target - columns @ np.linalg.lstsq(columns * weight[:, None], target * weight, rcond=1e-10)[0]
    return np.clip(left, -2 * limit, 2 * limit)


def _left_over(phi: Array, target: Array) -> Array:
    """Return the residual of the regression with a constant."""
    columns = phi - phi.mean(axis=0)
    centred = target - target.mean()
    gains = np.linalg.lstsq(columns, centred, rcond=1e-10)[0]
    return np.asarray(centred - columns @ gains, dtype=np.float64)
