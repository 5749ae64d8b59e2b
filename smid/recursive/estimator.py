"""A recursive estimator: model structure, method and state, updated sample by sample.

Each sample has two errors: one step ahead (parameters from before the sample) and a posteriori (parameters from after
it). Only the first one measures the quality of the model.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from relaxations.algebra.arrays import Array
from smid.display.result import Part, Result
from smid.display.table import Table, figure
from smid.models import ModelError
from smid.recursive.arx import LARGEST, Arx, refusal
from smid.recursive.method import DivergenceError, Method
from smid.recursive.poles import put_inside, stable

__all__ = ["History", "RecursiveEstimator"]

_ROOM = 1024


@dataclass(frozen=True, eq=False, repr=False)
class History(Result):
    """The parameters and errors of a recursive estimator, sample by sample.

    Parameters
    ----------
    parameters
        Shape (N, n). After each sample, in the order of `Arx.names`.
    one_step
        Shape (N,). Measured minus predicted output, with the parameters from before the sample, in the output's unit.
        NaN for the first `Arx.max_lag` samples.
    a_posteriori
        Shape (N,). The same with the parameters from after the sample.
    put_inside
        Shape (N,). True where the stability rule moved poles.

    Examples
    --------
    >>> from smid.recursive import Arx, ForgettingFactor
    >>> estimator = RecursiveEstimator(Arx(), ForgettingFactor(1.0))
    >>> for sample in zip([1.0, 0.0, 1.0, 1.0], [0.0, 1.0, 0.5, 1.2]):
    ...     _ = estimator.update(*sample)
    >>> estimator.history.parameters.shape
    (4, 2)
    """

    parameters: Array
    one_step: Array
    a_posteriori: Array
    put_inside: np.ndarray[tuple[int], np.dtype[np.bool_]]

    def _content(self) -> Iterator[Part]:
        errors = {"one step ahead": self.one_step, "a posteriori": self.a_posteriori}
        known = {name: error[np.isfinite(error)] for name, error in errors.items()}
        rows = tuple((name, figure(float(np.sqrt(np.mean(e**2)))) if e.size else "-") for name, e in known.items())
        yield Table(
            f"{len(self.one_step)} samples, {self.parameters.shape[1]} parameters.", ("error", "RMSE"), rows, "lr"
        )


class RecursiveEstimator:
    """Recursive estimator of the parameters of a model, (3.24)-(3.35) of the clutch thesis.

    Parameters
    ----------
    start
        Shape (n,). Parameters before the first sample; zero by default.

    Raises
    ------
    ModelError
        If `start` or a setting of the method does not fit the number of parameters, or the model has several inputs.

    Examples
    --------
    >>> from smid.recursive import ForgettingFactor
    >>> estimator = RecursiveEstimator(Arx(), ForgettingFactor(1.0))
    >>> y = 0.0
    >>> for u in [1.0, 0.0, 2.0, -1.0, 3.0, 0.0]:
    ...     _ = estimator.update(u, y)
    ...     y = 0.5 * y + 2 * u
    >>> estimator.parameters.round(3)
    array([-0.5,  2. ])
    """

    def __init__(self, arx: Arx, method: Method, start: ArrayLike | None = None) -> None:
        n = len(arx.names)
        if arx.inputs > 1:
            raise ModelError(f"{arx.inputs} inputs: recursive estimators take one; RecursiveSet takes several")
        self.arx, self.method = arx, method
        self._theta = np.zeros(n) if start is None else np.array(start, dtype=np.float64)
        if self._theta.shape != (n,) or not (np.abs(self._theta) < LARGEST).all():
            raise ModelError(f"start = {start!r} is refused: give {n} finite numbers, for {', '.join(arx.names)}")
        self._memory = method.start(n)
        self._outputs: list[float] = []  # newest first
        self._inputs: list[float] = []
        self._reach = arx.delay + arx.nb + 1
        self._first, self._largest_input = arx.max_lag, arx.largest_input
        self._keeps_stable = arx.stable and arx.na > 0
        self._count = 0
        self._parameters = np.empty((_ROOM, n))
        self._one_step, self._a_posteriori = array("d"), array("d")
        self._put_inside: list[int] = []

    @property
    def parameters(self) -> Array:
        """Return the present parameters, shape (n,)."""
        return self._theta.copy()

    def __repr__(self) -> str:
        values = ", ".join(f"{name} = {value:.6g}" for name, value in zip(self.arx.names, self._theta, strict=True))
        return f"{type(self).__name__} after {self._count} samples: {values}"

    @property
    def history(self) -> History:
        """Return the parameters and errors of all samples so far."""
        moved = np.zeros(self._count, dtype=np.bool_)
        moved[self._put_inside] = True
        parameters = self._parameters[: self._count].copy()
        return History(parameters, np.array(self._one_step), np.array(self._a_posteriori), moved)

    def update(self, u: float, y: float) -> float:
        """Return the error one step ahead, in the output's unit, and correct the parameters by one sample.

        The error is NaN for the first `Arx.max_lag` samples. Input and output are of the same instant.

        Raises
        ------
        DataError
            If the sample is not a finite number. The estimator does not change.
        DivergenceError
            If the parameters grow without bound.
        """
        try:
            usable = abs(u) < self._largest_input and abs(y) < LARGEST  # False for NaN
        except TypeError:
            usable = False
        if not usable:
            raise refusal(self._count, (u,), y)
        # Predict with the parameters from before the sample, then correct them.
        k, error, after = self._count, np.nan, np.nan
        inputs = [self.arx.input_scale * u, *self._inputs[: self._reach - 1]]
        if k >= self._first:
            phi = np.array(self.arx.row(self._outputs, inputs))
            error = y - float(phi.dot(self._theta))
            if not abs(error) < LARGEST:
                raise DivergenceError(
                    f"the parameters have grown without bound before sample {k}: give a smaller gain than "
                    f"'{self.method}' has"
                )
            self._learn(phi, error)
            after = y - float(phi.dot(self._theta))
        # Store the sample for the next regressors, and the results for the history.
        self._inputs = inputs
        self._outputs = [y, *self._outputs[: self.arx.na - 1]] if self.arx.na else []
        if k == len(self._parameters):
            self._parameters = np.concatenate([self._parameters, np.empty_like(self._parameters)])
        self._parameters[k] = self._theta
        self._one_step.append(error)
        self._a_posteriori.append(after)
        self._count = k + 1
        return error

    def _learn(self, phi: Array, error: float) -> None:
        gain, self._memory = self.method.correct(self._memory, phi)
        theta = self._theta + gain * error
        if self._keeps_stable:
            denominator = theta[: self.arx.na].tolist()
            if not stable(denominator):
                held = put_inside(denominator) - self._theta[: self.arx.na]
                theta = self._theta + self.method.hold(self._memory, phi, error, gain * error, held)
                self._put_inside.append(self._count)
        self._theta = theta
