"""Linear ARX with an offset, by least squares of the equation error.

``y(t) = c + sum_i a_i y(t - i) + sum_j b_j u(t - d - j)``, with i = 1..n and j = 0..n - 1. The order n is one of 1 to
10, the delay d one of 0 to 5. Reference: Ljung, System Identification, 2nd ed. (1999), section 4.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
from scipy.signal import lfilter, lfiltic

from benchmarks.peers.protocol import FreeRun, Peer, Run, Settings
from relaxations.algebra.arrays import Array


def fit(runs: Sequence[Run], settings: Settings) -> FreeRun:
    """Fit the equation to all runs at once."""
    order, delay = settings
    first = order + delay
    rows = np.vstack(
        [np.column_stack([_past(run.output, order, first), _forced(run.inputs, settings)]) for run in runs]
    )
    theta = np.linalg.lstsq(rows, np.concatenate([run.output[first:] for run in runs]))[0]
    a, b = theta[:order], theta[order:]

    def free_run(inputs: Array, known: Array) -> Array:
        start = lfiltic([1.0], np.r_[1.0, -a], known[first - order : first][::-1])
        return np.r_[known[:first], lfilter([1.0], np.r_[1.0, -a], _forced(inputs, settings) @ b, zi=start)[0]]

    return free_run


def _past(output: Array, order: int, first: int) -> Array:
    """Return the regressors of the output."""
    return np.column_stack([output[first - lag : len(output) - lag] for lag in range(1, order + 1)])


def _forced(inputs: Array, settings: Settings) -> Array:
    """Return the regressors of the inputs, and the one of the offset."""
    order, delay = settings
    first, n = order + delay, len(inputs)
    lagged = [inputs[first - lag : n - lag] for lag in range(delay, delay + order)]
    return np.column_stack([*lagged, np.ones(n - first)])


PEER = Peer("ARX", ("order", "delay"), tuple(product(range(1, 11), range(6))), fit)
