"""Polynomial NARX by forward regression with orthogonal least squares (FROLS), of SysIdentPy.

Degree 1, 2 or 3; 2, 3 or 5 past samples of the output and of each input. The number of terms is chosen by AIC among 1
to 20 (SysIdentPy: 15), the parameters come from its LeastSquares, and the rest is left as SysIdentPy sets it. Its `fit`
takes one record: runs are joined, and the equations across the joints remain. Reference: Lacerda et al., SysIdentPy,
Journal of Open Source Software 5 (2020) 2384.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from math import comb

import numpy as np
from sysidentpy.basis_function import Polynomial
from sysidentpy.model_structure_selection import FROLS
from sysidentpy.parameter_estimation import LeastSquares

from benchmarks.peers.protocol import FreeRun, Peer, Run, Settings
from relaxations.algebra.arrays import Array

TERMS = 20


def fit(runs: Sequence[Run], settings: Settings) -> FreeRun:
    """Choose terms and fit their coefficients."""
    degree, lags = settings
    inputs = np.vstack([run.inputs for run in runs])
    model = FROLS(
        ylag=lags,
        xlag=lags if inputs.shape[1] == 1 else [list(range(1, lags + 1))] * inputs.shape[1],
        n_info_values=min(TERMS, comb(lags * (1 + inputs.shape[1]) + degree, degree)),
        estimator=LeastSquares(),
        basis_function=Polynomial(degree=degree),
    )
    model.fit(X=inputs, y=np.concatenate([run.output for run in runs])[:, None])

    def free_run(inputs: Array, known: Array) -> Array:
        return np.asarray(model.predict(X=inputs, y=known[: model.max_lag, None])).ravel()

    return free_run


PEER = Peer("FROLS", ("degree", "lags"), tuple(product((1, 2, 3), (2, 3, 5))), fit)
