"""The output error of a model that was at rest, as a least-squares problem for the methods of `smid.networks`.

    r(theta) = angle of the free run at the parameters ``units * theta``, minus the measured one

Derivatives come from `smid.models.sensitivities`.  Where the run leaves the finite range there is no error, and no
method steps there; where only its sensitivities do, that direction is left out of the step.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from smid.binding import bind
from smid.data import Dataset
from smid.models import Model, ModelError, simulate
from smid.models.sensitivities import FreeRun, compile_free_run
from smid.networks import NormalEquations, sum_normal_equations

__all__ = ["FreeRunError"]

Array = NDArray[np.float64]

RUNAWAY, STEEPEST = 1e8, 1e100  # squares beyond overflow


@dataclass(frozen=True, eq=False)
class FreeRunError:
    """Free-run error of one output, of a plant that is at rest, with its inputs at zero, before the first sample.

    Parameters
    ----------
    model : Model
        With one output; its free parameters are those whose box is not a point.
    data : Dataset
        One or more records.
    units : ndarray, shape (p,)
        What one unit of each number stands for, in the order of the model's free parameters.

    Raises
    ------
    ModelError
        If the units are not as many as the free parameters.
    DataError
        If a channel is missing, or there are more parameters than samples.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> data = Dataset.from_arrays(input={"u": [1.0, 1, 1]}, output={"y": [0.0, 1.0, 1.5]}, sampling_time=1.0)
    >>> FreeRunError(OutputError(), data, np.ones(2)).error(np.array([-0.5, 1.0]))
    0.0
    """

    model: Model
    data: Dataset
    units: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "model", bind(self.model, self.data))
        if self.units.shape != (len(self.run.parameters),):
            raise ModelError(
                f"units of shape {self.units.shape}: give one for each of {', '.join(self.run.parameters)}"
            )

    @cached_property
    def run(self) -> FreeRun:
        """The compiled model."""
        return compile_free_run(self.model)

    def values(self, theta: Array) -> dict[str, float]:
        """Return the parameters that numbers stand for."""
        return dict(zip(self.run.parameters, (theta * self.units).tolist(), strict=True))

    def theta(self, values: dict[str, float]) -> Array:
        """Return the numbers that stand for parameters."""
        return np.array([values[name] for name in self.run.parameters]) / self.units

    def error(self, theta: Array) -> float:
        """Return the mean squared error; infinite outside the boxes, and where the run leaves the finite range."""
        boxes = ((self.model.parameter(name), value) for name, value in self.values(theta).items())
        if not all(box.lower <= value <= box.upper for box, value in boxes):
            return np.inf
        residual, _ = self.evaluate(theta, jacobian=False)
        return float(np.mean(residual**2)) if np.abs(residual).max() < RUNAWAY else np.inf

    def errors(self, thetas: Array) -> Array:
        """Return the mean squared error of many points at once.

        Parameters
        ----------
        thetas : ndarray, shape (B, p)

        Returns
        -------
        ndarray, shape (B,)
        """
        values = dict(zip(self.run.parameters, (thetas * self.units).T, strict=True))
        total = np.zeros(len(thetas))
        count = 0
        with np.errstate(over="ignore", invalid="ignore"):
            for record in self.data.experiments:
                before = {channel: np.append(0.0, record.values[channel]) for channel in self.model.input_channels}
                run = simulate(self.model, before, values, check=False)
                channel = self.model.output_channels[0]
                total += np.sum((run[channel][:, 1:] - record.values[channel]) ** 2, axis=1)
                count += record.n_samples
        return np.where(np.isfinite(total), total, np.inf) / count

    def normal_equations(self, theta: Array) -> NormalEquations:
        """Return the normal equations."""
        return sum_normal_equations([self.evaluate(theta, jacobian=True)])

    @cached_property
    def _inputs(self) -> list[dict[str, Array]]:
        names = list(zip(self.model.inputs, self.model.input_channels, strict=True))
        return [{name: run.values[channel] for name, channel in names} for run in self.data.experiments]

    @cached_property
    def _rest(self) -> dict[tuple[str, int], float]:
        return dict.fromkeys([*self.run.states, *((name, 1) for name in self.model.inputs)], 0.0)

    def evaluate(self, theta: Array, *, jacobian: bool) -> tuple[Array, Array]:
        """Return the residuals, shape (n,), and their Jacobian, shape (n, p), or none.

        Residuals are infinite where the run leaves the finite range; a column that does is zero.
        """
        values, shown, p = self.values(theta), self.model.measurements[0], self.units.size
        residuals, rows = [], []
        for record, inputs in zip(self.data.experiments, self._inputs, strict=True):
            signals, slopes = self.run.run(inputs, values, self._rest, jacobian=jacobian)
            # Not a number is no error either.
            residuals.append(np.nan_to_num(signals[shown.signal] - record.values[shown.channel], nan=np.inf))
            if jacobian:
                rows.append(slopes.get(shown.signal, np.zeros((record.n_samples, p)))[:, :p] * self.units)
        steep = np.concatenate(rows) if jacobian else np.empty((0, p))
        steep[:, ~(np.abs(steep).max(axis=0, initial=0.0) < STEEPEST)] = 0.0
        return np.concatenate(residuals), steep

    def lower(self, start: Array, *, evaluations: int = 100) -> Array:
        """Descend from a start by SciPy's trust-region reflective method, which keeps the boxes.

        It scales each number by its column of the Jacobian.  The jump's weights are hundreds of times larger than the
        others: without that scale, as `smid.networks.levenberg_marquardt` is for networks whose weights are alike, it
        takes four times the evaluations.

        Parameters
        ----------
        start : ndarray, shape (p,)
        evaluations : int
            At most so many.

        Returns
        -------
        ndarray, shape (p,)
            The start itself where its error is not finite.
        """
        if not np.isfinite(self.error(start)):
            return start
        boxes = [self.model.parameter(name) for name in self.run.parameters]
        lower, upper = (np.array(ends) / self.units for ends in zip(*((p.lower, p.upper) for p in boxes), strict=True))
        # The run is the greater part of a Jacobian, and most points are stepped to: each is evaluated once, with both.
        last: dict[bytes, tuple[Array, Array]] = {}

        def both(theta: Array) -> tuple[Array, Array]:
            key = theta.tobytes()
            if key not in last:
                last.clear()
                last[key] = self.evaluate(theta, jacobian=True)
            return last[key]

        def residual(theta: Array) -> Array:
            return np.clip(both(theta)[0], -RUNAWAY, RUNAWAY)

        def steep(theta: Array) -> Array:
            return both(theta)[1]

        found = least_squares(residual, start, jac=steep, bounds=(lower, upper), x_scale="jac", max_nfev=evaluations)
        return np.asarray(found.x)
