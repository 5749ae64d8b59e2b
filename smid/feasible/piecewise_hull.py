"""The convex hull of an open kink, linear in its value s and its argument x over L <= x <= U.

    s = max(0, x):   0 <= s <= U,    s >= x,    U (x - L) >= (U - L) s
    s = sign(x):    -1 <= s <= 1,    2 x - L (1 - s) >= 0  (where L < 0),    U (1 + s) - 2 x >= 0  (where U > 0)

Every pair (x, s) of the kink satisfies these, so they only enlarge the feasible set. They tend to the kink itself as L
and U tend to zero. L and U come from interval arithmetic, and the coefficients keep their rounding errors.
"""

from __future__ import annotations

import numpy as np

from relaxations.algebra.arrays import Array, Index
from relaxations.algebra.ball_arithmetic import Balls, concatenate
from relaxations.algebra.polynomial import Polynomials, pad
from smid.feasible.piecewise_functions import Kind
from smid.feasible.regimes import Ranges

SIGN_MARGIN = 2.0**-30  # share of an argument's range that is kept from zero where its sign is chosen


def box(kind: Kind, within: Ranges) -> tuple[Array, Array]:
    """Return the lower and upper bounds of the value of each open kink, shape (n,)."""
    if kind is Kind.SIGN:
        return np.where(within.low >= 0, 0.0, -1.0), np.where(within.high <= 0, 0.0, 1.0)
    return np.maximum(within.low, 0.0), np.maximum(within.high, 0.0)


def hull(kind: Kind, arguments: Polynomials, variables: Index, within: Ranges) -> Polynomials:
    """Return the inequalities ``>= 0`` of open kinks: one row of ``arguments`` and one of ``variables`` for each.

    The upper bound U of ``within`` is finite; an infinite L drops the chord.
    """
    lower, upper = Balls.exact(within.low), Balls.exact(within.high)
    one = Balls.exact(np.ones(len(variables)))
    if kind is Kind.SIGN:
        below = np.flatnonzero((within.low < 0) & np.isfinite(within.low))
        above = np.flatnonzero((within.high > 0) & np.isfinite(within.high))
        two = Balls.exact(np.full(len(variables), 2.0))
        return Polynomials.join(
            [
                _combined(arguments, variables, two, lower, -lower, below),
                _combined(arguments, variables, -two, upper, upper, above),
            ]
        )
    chord = np.flatnonzero(np.isfinite(within.low))
    zero = Balls.exact(np.zeros(len(variables)))
    finite = Balls.exact(np.where(np.isfinite(within.low), within.low, 0.0))
    return Polynomials.join(
        [
            _combined(arguments, variables, -one, one, zero, np.arange(len(variables))),
            _combined(arguments, variables, upper, finite - upper, -(upper * finite), chord),
        ]
    )


def chosen(kind: Kind, arguments: Polynomials, sides: Index, within: Ranges) -> Polynomials:
    """Return ``side * x >= 0``, which holds where the chosen side is right; a sign also needs a margin from zero."""
    count = arguments.n_rows
    off = (
        SIGN_MARGIN * np.minimum(np.maximum(-within.low, within.high), 1e300) if kind is Kind.SIGN else np.zeros(count)
    )
    side = Balls.exact(sides.astype(np.float64))
    nothing = Balls.exact(np.zeros(count))
    return _combined(arguments, np.zeros(count, dtype=np.int64), side, nothing, Balls.exact(-off), np.arange(count))


def _combined(
    arguments: Polynomials, variables: Index, of_argument: Balls, of_value: Balls, constant: Balls, rows: Index
) -> Polynomials:
    """Return ``of_argument x + of_value s + constant`` for some rows."""
    degree = max(arguments.factors.shape[1], 1)
    own = np.arange(arguments.n_rows)
    single = pad(variables.reshape(-1, 1), degree)
    whole = Polynomials(
        arguments.n_rows,
        np.concatenate([arguments.rows, own, own]),
        np.concatenate([pad(arguments.factors, degree), single, np.full((len(own), degree), -1)]),
        concatenate([arguments.coefficients * of_argument[arguments.rows], of_value, constant]),
    )
    return whole.take(rows).collect()
