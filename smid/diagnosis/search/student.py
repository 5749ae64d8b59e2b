"""The Student distribution of the innovations: no single sample decides.

For an even number of degrees of freedom its probabilities are finite sums, which take a quarter of the time of
``scipy.special.stdtr``.

References: Lange, Little and Taylor, Journal of the American Statistical Association 84 (1989) 881-896; Abramowitz and
Stegun, Handbook of Mathematical Functions (1964), 26.7.4.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial.polynomial import polyval
from scipy.special import binom

from relaxations.algebra.arrays import Array

TAIL = 10.0
"""Its degrees of freedom, an even number."""

_TERMS = int(TAIL) // 2
_TAIL_BEGINS, _TAIL_TERMS = 0.1, 12
_SERIES = binom(2 * (k := np.arange(_TERMS + _TAIL_TERMS)), k) / 4.0**k  # of 1 / sqrt(1 - c)


def weights(innovations: Array) -> Array:
    """Return the weights by which least squares becomes the likelihood of this distribution."""
    return (TAIL + 1) / (TAIL + innovations**2)


def log_density(innovations: Array) -> Array:
    """Return the log density of each innovation, up to a constant."""
    return -0.5 * (TAIL + 1) * np.log1p(innovations**2 / TAIL)


def log_probability(lower: Array, upper: Array) -> Array:
    """Return the log probability that an innovation lies between two numbers, of which the lower is negative."""
    below, above = _beyond(np.abs(lower)), _beyond(np.abs(upper))
    return np.asarray(np.log(np.where(upper < 0, above, 1 - above) - below))


def _beyond(size: Array) -> Array:
    """Return the probability that an innovation is larger than a number that is not negative.

    With c = TAIL / (TAIL + size^2) it is 1/2 - sqrt(1 - c) / 2 times the first terms of the power series of
    1 / sqrt(1 - c), and in the tail, where all digits would cancel, sqrt(1 - c) / 2 times the next ones.
    """
    square = TAIL + size**2
    c, root = TAIL / square, size / np.sqrt(square)
    tail = c < _TAIL_BEGINS
    result = 0.5 - 0.5 * root * polyval(c, _SERIES[:_TERMS])
    result[tail] = 0.5 * root[tail] * c[tail] ** _TERMS * polyval(c[tail], _SERIES[_TERMS:])
    return np.asarray(result)
