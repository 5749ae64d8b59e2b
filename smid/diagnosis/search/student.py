"""The Student distribution of the innovations: no single sample decides.

Reference: Lange, Little and Taylor, Journal of the American Statistical Association 84 (1989) 881-896.
"""

from __future__ import annotations

import numpy as np
from scipy.special import stdtr

from relaxations.algebra.arrays import Array

TAIL = 10.0
"""Its degrees of freedom."""


def weights(innovations: Array) -> Array:
    """Return the weights by which least squares becomes the likelihood of this distribution."""
    return (TAIL + 1) / (TAIL + innovations**2)


def log_density(innovations: Array) -> Array:
    """Return the log density of each innovation, up to a constant."""
    return -0.5 * (TAIL + 1) * np.log1p(innovations**2 / TAIL)


def log_probability(lower: Array, upper: Array) -> Array:
    """Return the log probability that an innovation lies between two numbers, of which the lower is negative."""
    return np.asarray(np.log(stdtr(TAIL, upper) - stdtr(TAIL, lower)))
