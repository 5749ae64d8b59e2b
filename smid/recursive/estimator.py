"""A recursive estimator: a model's structure, a method, and what it has seen so far, one sample after the other.

Two errors are kept for every sample: one step ahead, with the parameters from before the sample, and a posteriori, with
those that the sample has already corrected.  Only the first one says something about the model.
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
    """What a recursive estimator found, sample by sample.

    Parameters
    ----------
    parameters
        Shape (N, n). After each sample, in the order of `Arx.names`.
    one_step
        Shape (N,).
        Measured minus predicted with the parameters from before the sample (a priori), in the output's unit; NaN while
        the model still looks back beyond the record.
    a_posteriori
        Shape (N,). The same with the parameters from after the sample.
    put_inside
        Shape (N,). Where the stability rule put poles back.

    Examples
    --------
    >>> from smid.recursive import Arx, ForgettingFactor
    >>> estimator = RecursiveEstimator(Arx(), ForgettingFactor(1.0))
    >>> u, y = [1.0, 0.0, 1.0, 1.0], [0.0, 1.0, 0.5, 1.2]
    >>> for sample in zip(u, y):
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
    """Estimate the parameters of a model anew at each sample.

    Parameters
    ----------
    arx
        Structure of the model.
    method
        How a sample corrects the parameters.
    start
        Shape (n,). Parameters before the first sample; zero by default.

    Raises
    ------
    ModelError
        If the start or a setting of the method does not fit the number of parameters.

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

    References
    ----------
    Clutch thesis, equations (3.24)-(3.35).
    """

    def __init__(self, arx: Arx, method: Method, start: ArrayLike | None = None) -> None:
        n = len(arx.names)
        self.arx, self.method = arx, method
        self._theta = np.zeros(n) if start is None else np.array(start, dtype=np.float64)
        if self._theta.shape != (n,) or not (np.abs(self._theta) < LARGEST).all():
            raise ModelError(f"start = {start!r} is refused: give {n} finite numbers, for {', '.join(arx.names)}")
        self._memory = method.start(n)
        self._outputs: list[float] = []  # the newest first
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
        """The present parameters, shape (n,)."""
        return self._theta.copy()

    @property
    def history(self) -> History:
        """What was found so far."""
        moved = np.zeros(self._count, dtype=np.bool_)
        moved[self._put_inside] = True
        parameters = self._parameters[: self._count].copy()
        return History(parameters, np.array(self._one_step), np.array(self._a_posteriori), moved)

    def update(self, u: float, y: float) -> float:
        """Take one sample.

        Parameters
        ----------
        u, y
            Input and output at the same instant, in the channels' units.

        Returns
        -------
        float
            The error one step ahead, in the output's unit; NaN while the model looks back beyond the record.

        Raises
        ------
        DataError
            If the sample is not a finite number; the estimator stays as it was.
        DivergenceError
            If the parameters grow without bound.
        """
        try:
            usable = abs(u) < self._largest_input and abs(y) < LARGEST  # NaN is not
        except TypeError:
            usable = False
        if not usable:
            raise refusal(self._count, u, y)
        k, error, after = self._count, np.nan, np.nan
        inputs = [self.arx.input_scale * u, *self._inputs[: self._reach - 1]]
        if k >= self._first:
            phi = np.array(self.arx.row(self._outputs, inputs))
            error = y - float(phi.dot(self._theta))
            if not abs(error) < LARGEST:
                raise DivergenceError(
                    f"the parameters have grown without bound before sample {k}: give a smaller gain than that of "
                    f"'{self.method}'"
                )
            self._learn(phi, error)
            after = y - float(phi.dot(self._theta))
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
