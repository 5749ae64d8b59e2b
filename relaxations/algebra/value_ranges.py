"""Enclosures of the values that polynomials take on a box."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.algebra.ball_arithmetic import EPSILON, TINY, outwards
from relaxations.algebra.polynomial import Polynomials

NEAR = 1e-9  # an end of a range this close to zero, of all that was added up, is computed again as a fraction


def value_ranges(family: Polynomials, lower: Array, upper: Array) -> tuple[Array, Array]:
    """Return lower and upper bounds of each polynomial on a box, in interval arithmetic rounded outwards.

    An end next to zero is computed again with fractions, so that rounding does not blur a threshold at the value of a
    sample. The box may be infinite.

    Examples
    --------
    >>> member = Polynomials.from_terms([{(0,): 1.0, (): -0.5}])
    >>> value_ranges(member, np.array([0.5]), np.array([2.0]))
    (array([0.]), array([1.5]))
    """
    coefficients = family.coefficients
    exact = coefficients.rad == 0
    low = np.where(exact, coefficients.mid, coefficients.lower)
    high = np.where(exact, coefficients.mid, coefficients.upper)
    for column in family.factors.T:
        real = column >= 0
        with np.errstate(invalid="ignore"):
            ends = np.stack([a * b[column] for a in (low, high) for b in (lower, upper)])
        ends = np.where(np.isnan(ends), 0.0, ends)  # zero times an infinite end: the other factor is zero
        low = np.where(real, np.nextafter(ends.min(axis=0), -np.inf), low)
        high = np.where(real, np.nextafter(ends.max(axis=0), np.inf), high)
    finite = [np.where(np.isfinite(v), np.abs(v), 0.0) for v in (low, high)]
    size = np.bincount(family.rows, np.maximum(*finite), family.n_rows)
    slack = size * EPSILON * (np.bincount(family.rows, minlength=family.n_rows) + 2)
    total = [np.bincount(family.rows, v, family.n_rows) for v in (low, high)]
    below, above = np.nextafter(total[0] - slack, -np.inf), np.nextafter(total[1] + slack, np.inf)
    close = np.maximum(NEAR * size, TINY)
    near = (np.abs(below) <= close) | (np.abs(above) <= close)
    loose = ~np.isfinite(np.where(family.factors >= 0, (upper - lower)[family.factors], 0.0)).all(axis=1)
    no_fractions = np.bincount(family.rows[loose & (coefficients.magnitude() > 0)], minlength=family.n_rows) > 0
    doubtful = np.flatnonzero(near & np.isfinite(below) & np.isfinite(above) & ~no_fractions)
    if len(doubtful):
        below[doubtful], above[doubtful] = _exact_ranges(family.take(doubtful), lower, upper)
    return below, above


def _exact_ranges(family: Polynomials, lower: Array, upper: Array) -> tuple[Array, Array]:
    low, high = ([Fraction(0)] * family.n_rows for _ in range(2))
    for row, mid, rad, factor in zip(
        family.rows.tolist(),
        family.coefficients.mid.tolist(),
        family.coefficients.rad.tolist(),
        family.factors.tolist(),
        strict=True,
    ):
        ends = (Fraction(mid) - Fraction(rad), Fraction(mid) + Fraction(rad))
        for v in factor:
            if v >= 0 and any(ends):
                products = [a * b for a in ends for b in (Fraction(float(lower[v])), Fraction(float(upper[v])))]
                ends = (min(products), max(products))
        low[row] += ends[0]
        high[row] += ends[1]
    return np.array([outwards(v, -1) for v in low]), np.array([outwards(v, 1) for v in high])
