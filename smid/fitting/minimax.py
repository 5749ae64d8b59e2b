"""Minimax fit: parameters and initial states with the smallest maximum error of the free run.

Sequential linear programs (`smid.fitting.sequential`) minimise the largest linearised error over a box of steps. The
minimum is attained, but local; `smid.error_bound` bounds the global one.

Reference: Madsen, An algorithm for minimax solution of overdetermined systems of non-linear equations, Journal of the
Institute of Mathematics and its Applications 16 (1975) 321-328.
"""

from __future__ import annotations

import numpy as np

from relaxations.algebra.arrays import Array
from smid.fitting.problem import Fitting
from smid.fitting.sequential import Descents

__all__ = ["minimax"]

WORTH = 1e-3
"""Smallest predicted reduction, as a share of the largest error."""


def minimax(problem: Fitting, vector: Array) -> tuple[Array, float]:
    """Return a local minimiser of the largest error, shape (n_free,), and this error.

    The error is in standard deviations of its channel. It is infinite if the free run diverges at the start.
    A least-squares fit is a good start. It must keep the model's constraints; then the result does.
    """
    found = Descents(problem).descend(vector, np.zeros(len(vector)), 0.0, 1.0, WORTH)
    return found.vector, found.largest
