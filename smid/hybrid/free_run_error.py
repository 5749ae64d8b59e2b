"""Free-run error of a model as a least-squares problem for the methods of `smid.networks`.

    r(theta) = output of the free run at the parameters ``units * theta``, minus the measured output

Many points are simulated together. Derivatives come from `smid.models.sensitivities`, along the same runs.

Safeguards: where a run diverges, the error is infinite, so no method steps there. Where only a sensitivity diverges,
its column of the Jacobian is zero.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from relaxations.algebra.arrays import Array
from smid.data import Dataset
from smid.data.gaps import require_complete
from smid.fitting.binding import bind
from smid.models import Model, ModelError
from smid.models.sensitivities import FreeRun, compile_free_run
from smid.networks import NormalEquations, lockstep, stacked_normal_equations

__all__ = ["FreeRunError", "FreeRuns"]

Rows = NDArray[np.intp]

RUNAWAY, STEEPEST = 1e8, 1e100  # squares of larger values overflow


@dataclass(frozen=True, eq=False)
class FreeRunError:
    """Free-run error of one output. The plant is at rest, with zero inputs, before the first sample.

    Parameters
    ----------
    model
        With one output. Parameters with lower < upper are free.
    units
        Shape (p,). Unit of each number theta, in the order of the free parameters.

    Raises
    ------
    ModelError
        If the number of units differs from the number of free parameters.
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
        require_complete(self.data, "this error")
        object.__setattr__(self, "model", bind(self.model, self.data))
        if self.units.shape != (len(self.run.parameters),):
            raise ModelError(
                f"units of shape {self.units.shape}: give one for each of {', '.join(self.run.parameters)}"
            )

    @cached_property
    def run(self) -> FreeRun:
        """Return the compiled model."""
        return compile_free_run(self.model)

    def values(self, theta: Array) -> dict[str, float]:
        """Return the parameters at theta."""
        return dict(zip(self.run.parameters, (theta * self.units).tolist(), strict=True))

    def theta(self, values: dict[str, float]) -> Array:
        """Return theta at the parameters."""
        return np.array([values[name] for name in self.run.parameters]) / self.units

    @cached_property
    def box(self) -> tuple[Array, Array]:
        """Return the lower and upper ends of theta, shape (p,) each."""
        parameters = [self.model.parameter(name) for name in self.run.parameters]
        ends = np.array([(p.lower, p.upper) for p in parameters]).T / self.units
        return ends[0], ends[1]

    def runs(self, thetas: Array) -> FreeRuns:
        """Return the free runs at many points, shape (B, p)."""
        names = list(zip(self.model.inputs, self.model.input_channels, strict=True))
        rest = dict.fromkeys([*self.run.states, *((name, 1) for name in self.model.inputs)], 0.0)
        values = dict(zip(self.run.parameters, (thetas * self.units).T, strict=True))
        records = self.data.experiments
        inputs = [{name: record.values[channel] for name, channel in names} for record in records]
        return FreeRuns(self, thetas, tuple(self.run.trajectory(given, values, rest) for given in inputs))

    def errors(self, thetas: Array) -> Array:
        """Return the mean squared errors at many points, shape (B, p)."""
        return self.runs(thetas).errors

    def error(self, theta: Array) -> float:
        """Return the mean squared error; infinite outside the box, and where the run diverges."""
        return float(self.errors(theta[None])[0])

    def normal_equations(self, theta: Array) -> NormalEquations:
        """Return the normal equations at theta."""
        runs = self.runs(theta[None])
        gradient, gram = runs.normal_equations(np.arange(1))
        return NormalEquations(float(runs.errors[0]), gradient[0], gram[0])

    def lower(self, starts: Array, *, evaluations: int = 100) -> Array:
        """Return the points found by descents from one start (p,) or many (B, p), run together.

        A start with an infinite error is returned unchanged. See `smid.networks.lockstep`.
        """
        lower, upper = self.box
        found, _ = lockstep(self.runs, np.atleast_2d(starts), lower, upper, evaluations=evaluations)
        return found.reshape(starts.shape)


@dataclass(frozen=True, eq=False)
class FreeRuns:
    """Free runs at many points.

    Parameters
    ----------
    thetas
        Shape (B, p).
    known
        For each record, all signals, including samples before the first.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> data = Dataset.from_arrays(input={"u": [1.0, 1, 1]}, output={"y": [0.0, 1.0, 1.5]}, sampling_time=1.0)
    >>> problem = FreeRunError(OutputError(), data, np.ones(2))
    >>> float(problem.runs(np.array([[-0.5, 1.0], [0.0, 0.0]])).errors[0])
    0.0
    """

    problem: FreeRunError
    thetas: Array
    known: tuple[Mapping[str, Array], ...]

    @cached_property
    def residuals(self) -> Array:
        """Return simulated minus measured over all records, shape (B, n); not finite where a run diverges."""
        shown, run = self.problem.model.measurements[0], self.problem.run
        simulated = [run.cut({"y": known[shown.signal]}, time=1)["y"] for known in self.known]
        measured = [record.values[shown.channel] for record in self.problem.data.experiments]
        return np.concatenate([y - seen for y, seen in zip(simulated, measured, strict=True)], axis=1)

    @cached_property
    def errors(self) -> Array:
        """Return the mean squared errors, shape (B,); infinite outside the box and where a run diverges."""
        lower, upper = self.problem.box
        inside = np.all((self.thetas >= lower) & (self.thetas <= upper), axis=1)
        for known in self.known:
            inside &= self.problem.run.finite(known)
        with np.errstate(over="ignore", invalid="ignore"):
            inside &= np.abs(self.residuals).max(axis=1) < RUNAWAY
            return np.where(inside, np.mean(self.residuals**2, axis=1), np.inf)

    def jacobian(self, rows: Rows) -> Array:
        """Return the derivatives of some runs' residuals, shape (K, n, p); a column that overflows is zero."""
        problem, p = self.problem, self.problem.units.size
        values = dict(zip(problem.run.parameters, (self.thetas[rows] * problem.units).T, strict=True))
        parts = []
        for known in self.known:
            chosen = {name: samples if samples.ndim == 1 else samples[rows] for name, samples in known.items()}
            slopes = problem.run.cut(problem.run.slopes(chosen, values), time=1)
            parts.append(slopes[problem.model.measurements[0].signal][..., :p] * problem.units)
        steep = np.concatenate(parts, axis=1)
        return np.where(np.abs(steep).max(axis=1, keepdims=True) < STEEPEST, steep, 0.0)

    def normal_equations(self, rows: Rows) -> tuple[Array, Array]:
        """Return ``J'r / n``, shape (K, p), and ``J'J / n``, shape (K, p, p), of some runs."""
        return stacked_normal_equations(self.residuals, self.jacobian, rows)
