"""Free run: simulation of a model with constant parameters, which uses measured outputs only at the start.

    w[t] = -a1 w[t-1] - ... + (terms of the input),   w[0], ..., w[max_lag - 1] as measured

Safeguard: the run of an unstable model is stopped when it exceeds 10^6 times the largest measured output.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.signal import lfilter, lfiltic

from relaxations.algebra.arrays import Array
from smid.display.result import Part, Result
from smid.models import ModelError
from smid.recursive.arx import Arx
from smid.recursive.poles import largest_pole

__all__ = ["FreeRun", "free_run"]

_RUNAWAY = 1e6
"""Multiple of the largest measured output at which a run is stopped."""


@dataclass(frozen=True, eq=False, repr=False)
class FreeRun(Result):
    """The simulated output of a model with constant parameters.

    Parameters
    ----------
    output
        Shape (N,). In the output's unit. The first `max_lag` samples are measured; NaN from `stopped` on.
    stopped
        The sample at which a diverging run was stopped.
    radius
        Largest magnitude of a pole. The model is unstable if it is 1 or more.
    """

    parameters: Array
    output: Array
    stopped: int | None
    radius: float

    def _content(self) -> Iterator[Part]:
        told = "stable" if self.radius < 1 else "unstable"
        ended = "" if self.stopped is None else f"; the output diverged and was stopped at sample {self.stopped}"
        yield f"Free run over {self.output.size} samples; {told}, largest pole {self.radius:.4g}{ended}."


def free_run(arx: Arx, parameters: ArrayLike, input: ArrayLike, output: ArrayLike) -> FreeRun:
    """Return the simulation of a model with constant parameters, from the first measured outputs on.

    Parameters
    ----------
    parameters
        Shape (n,). In the order of `Arx.names`.
    input, output
        Shape (N,). Only the first `max_lag` samples of the output and its range are used.

    Raises
    ------
    ModelError
        If the parameters are not n finite numbers.
    DataError
        If the series do not fit the model.

    Examples
    --------
    >>> free_run(Arx(), [-0.5, 1.0], [1, 1, 1, 1], [0, 9, 9, 9]).output
    array([0.  , 1.  , 1.5 , 1.75])
    """
    theta = np.asarray(parameters, dtype=np.float64)
    if theta.shape != (len(arx.names),) or not np.isfinite(theta).all():
        raise ModelError(f"parameters = {parameters!r}: give {len(arx.names)} finite numbers, {', '.join(arx.names)}")
    regressors, y = arx.matrix(input, output), np.asarray(output, dtype=np.float64)
    denominator, start = [1.0, *theta[: arx.na]], arx.max_lag
    added = regressors[:, arx.na :] @ theta[arx.na :]
    # The filter overflows without an error; the limit below detects the overflow.
    run = lfilter([1.0], denominator, added, zi=lfiltic([1.0], denominator, y[:start][::-1]))[0] if arx.na else added
    simulated = np.concatenate([y[:start], run])
    gone = np.flatnonzero(~(np.abs(simulated) <= _RUNAWAY * (np.abs(y).max() or 1.0)))
    stopped = int(gone[0]) if gone.size else None
    simulated[stopped if stopped is not None else y.size :] = np.nan
    return FreeRun(theta, simulated, stopped, largest_pole(theta[: arx.na].tolist()))
