"""Estimation of a hybrid model's parameters and weights by nonlinear least squares.

The residual is the output error one step ahead ("prediction", past outputs are measured) or in a free run
("simulation", past outputs are the model's own). The minimiser is one of `smid.networks`.

- Scaling: network inputs are scaled to [-1, 1]. All other numbers get units that change the output by one standard
  deviation.
- Start: hidden weights after Nguyen and Widrow. The last layer starts at zero, which is the first-principles model
  alone. A free-run fit starts from the result of the prediction fit, because it learns dynamics slowly from zero.
- Safeguard: outside the parameters' boxes, and where the run diverges, the error is infinite, so no step goes there.

Reference: hybrid thesis, sections 3.4 and 4.2; Nguyen and Widrow, IJCNN 1990.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from relaxations.algebra.arrays import Array
from smid.data import DataError, Dataset
from smid.display.result import Part, Result, plain
from smid.fitting.fit import Fit, Fitting, prediction
from smid.hybrid.analysis import required
from smid.hybrid.back_couplings import warn_of_few_couplings
from smid.hybrid.hybrid_model import HybridModel, bound_to
from smid.hybrid.neural import NeuralTerm
from smid.models import Line, Model, ModelError, signal, t
from smid.models.errors import refuse_unknown
from smid.networks import (
    Method,
    MultiStart,
    NormalEquations,
    ProgressCallback,
    Scaling,
    descend,
    fold,
    levenberg_marquardt,
    multistart,
    nguyen_widrow,
    sum_normal_equations,
)

__all__ = ["ERRORS", "HybridEstimate", "estimate"]

ERRORS = ("prediction", "simulation")
_INSENSITIVE = 1e-8  # smallest slope to scale by, in standard deviations of the output


@dataclass(frozen=True, eq=False, repr=False)
class HybridEstimate(Result):
    """Estimated hybrid model.

    Parameters
    ----------
    hybrid
        Bound to the data; its model has the estimated values.
    fit
        Free run over all experiments.
    search
        Descents from all starts, in scaled parameters and errors.
    """

    hybrid: HybridModel
    fit: Fit
    search: MultiStart

    @property
    def model(self) -> Model:
        """Return the estimated model."""
        return self.hybrid.model

    def _content(self) -> Iterator[Part]:
        free = [p for p in self.hybrid.white.parameters if p.lower < p.upper]
        told = "".join(f"; {p.name} = {self.model.values[p.name]:.4g} {p.unit}".rstrip() for p in free)
        weights = len(self.hybrid.term.parameters)
        yield f"{self.hybrid.topology}, {self.hybrid.couplings}, {weights} weights{told}; {self.search}"

    def to_dict(self) -> dict[str, Any]:
        """Return the estimated model, the free run and the result of the search as plain data."""
        return {
            "topology": self.hybrid.topology,
            "couplings": plain(self.hybrid.couplings),
            "model": self.model.to_dict(),
            "cost": plain(self.fit.cost),
            "simulated": plain(self.fit.simulated),
            "search": str(self.search),
        }


@dataclass(frozen=True, eq=False)
class _Scaled:
    """Output error as a least-squares problem in ``theta``; the fitted numbers are ``units @ theta``."""

    fitting: Fitting
    units: Array

    @property
    def count(self) -> int:
        """Return the number of residuals."""
        return sum(int(mask.sum()) for mask in self.fitting.used) * len(self.fitting.outputs)

    def vector(self, theta: Array) -> Array:
        return np.asarray(self.units @ theta)

    def theta(self, values: Mapping[str, float]) -> Array:
        return np.asarray(np.linalg.solve(self.units, self.fitting.start(values)), dtype=np.float64)

    def values(self, theta: Array) -> dict[str, float]:
        return dict(zip(self.fitting.run.parameters, self.vector(theta).tolist(), strict=False))

    def error(self, theta: Array) -> float:
        vector = self.vector(theta)
        count = self.fitting.lower.size
        if np.any(vector[:count] < self.fitting.lower) or np.any(vector[:count] > self.fitting.upper):
            return np.inf
        with np.errstate(all="ignore"):  # a run may diverge
            return float(np.mean(self.fitting.residual(vector) ** 2))

    def normal_equations(self, theta: Array) -> NormalEquations:
        vector = self.vector(theta)
        return sum_normal_equations([(self.fitting.residual(vector), self.fitting.jacobian(vector) @ self.units)])


def estimate(
    hybrid: HybridModel,
    data: Dataset,
    used: Sequence[NDArray[np.bool_]] | None = None,
    *,
    plant: Model | None = None,
    error: str = "simulation",
    method: Method = levenberg_marquardt,
    starts: int = 5,
    iterations: int = 300,
    seed: int | np.random.Generator,
    progress: ProgressCallback | None = None,
) -> HybridEstimate:
    """Return a hybrid model with estimated weights and free first-principles parameters.

    Parameters
    ----------
    hybrid
        Values in its model are the start of the first-principles parameters.
    used
        Shape (n,). Per experiment, the samples to fit; by default all after the warm-up.
    plant
        Expected linear plant. Back couplings of a network in series or in parallel are checked against it.
    error
        "simulation" (free run) or "prediction" (one step ahead).
    method
        `levenberg_marquardt`, `gauss_newton` or `gradient_descent` of `smid.networks`.
    starts
        Number of random starts; the smallest error is kept.
    iterations
        Maximum number of steps from each start.
    progress
        Called after each step with a `Progress`.

    Warns
    -----
    BackCouplingWarning
        If the network has fewer back couplings than the plant requires.

    Raises
    ------
    DataError
        If there are more unknowns than samples, or a channel is missing.
    ModelError
        If an option is unknown, the first-principles simulation diverges, or an input far from zero needs weights
        beyond their limit.

    Examples
    --------
    >>> from smid.hybrid import EXTRA, parallel
    >>> from smid.models import Reactor
    >>> u = np.sin(np.arange(60.0)) + 2.0
    >>> y = Reactor(1.0, sampling_time=1.0).simulate(Dataset.from_arrays(
    ...     input={"u": u}, output={"y": u}, sampling_time=1.0)).outputs[0]["y"]
    >>> data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    >>> found = estimate(parallel(Reactor(2.0), EXTRA), data, starts=1, seed=1)
    >>> bool(np.std(found.fit.residual(data, "y")[0]) < 0.1 * np.std(y))
    True
    """
    refuse_unknown("error", [error], ERRORS)
    if starts < 1 or iterations < 1:
        raise ModelError(f"starts = {starts}, iterations = {iterations}: give positive numbers")
    # Compare the back couplings with those that the plant requires.
    if plant is not None:
        needed = required(plant, hybrid.white, hybrid.topology, data.sampling_time)
        warn_of_few_couplings(hybrid.couplings, needed.couplings, stacklevel=2)
    # Prepare the free-run and the one-step-ahead problem.
    hybrid = bound_to(hybrid, data)
    masks = [np.arange(run.n_samples) >= data.n_init for run in data.experiments] if used is None else list(used)
    free_run, ahead = Fitting(hybrid.model, data, masks), _ahead(hybrid.model, data, masks)
    _check_count(free_run)
    # Draw the starts: first-principles values and random hidden weights.
    generator = np.random.default_rng(seed)
    alone = _first_principles(hybrid)
    ranges = _input_ranges(hybrid, data, masks, alone)
    points = [{**alone, **_hidden_weights(hybrid.term, ranges, generator)} for _ in range(starts)]
    # Scale the chosen error and minimise it from each start.
    if error == "prediction":
        problem = _scaled(ahead, hybrid, ranges, alone)
        thetas = [problem.theta(values) for values in points]
    else:
        problem, first = (_scaled(fitting, hybrid, ranges, alone) for fitting in (free_run, ahead))
        thetas = [_after_prediction(problem, first, values, method, iterations) for values in points]
    search = multistart(method, problem, thetas, iterations=iterations, patience=iterations, progress=progress)
    values = problem.values(search.theta)
    # A prediction fit still needs initial states for the free run.
    if error == "prediction":
        vector, cost = free_run.solve(free_run.start(values), held=free_run.run.parameters)
    else:
        vector, cost = problem.vector(search.theta), search.descents[search.winner].best * problem.count
    found = free_run.result(vector, cost)
    return HybridEstimate(replace(hybrid, model=found.model), found, search)


def _ahead(model: Model, data: Dataset, used: Sequence[NDArray[np.bool_]]) -> Fitting:
    """Return the fit of the one-step-ahead predictions over the samples that can be predicted."""
    if any(item.inverse is not None for item in model.outputs):
        raise ModelError(f"an output of {model.name!r} has a sensor curve: put the curve into the model's lines")
    # The first samples cannot be predicted: the samples before them are unknown.
    return prediction(model, data, [mask & (np.arange(mask.size) >= model.max_lag) for mask in used])


def _check_count(fitting: Fitting) -> None:
    samples = sum(int(mask.sum()) for mask in fitting.used) * len(fitting.outputs)
    if fitting.n_free > samples:
        raise DataError(
            f"{fitting.n_free} parameters, weights and initial states but {samples} samples to estimate them from: "
            "give more samples, or fewer neurons"
        )


def _first_principles(hybrid: HybridModel) -> dict[str, float]:
    """Return the start: first-principles values, or the middle of each box, and zero weights."""
    values = {parameter.name: 0.0 for parameter in hybrid.term.parameters}
    for parameter in hybrid.white.parameters:
        if parameter.lower < parameter.upper:
            middle = (parameter.lower + parameter.upper) / 2
            values[parameter.name] = hybrid.model.values.get(parameter.name, middle if np.isfinite(middle) else 0.0)
    return values


def _input_ranges(
    hybrid: HybridModel, data: Dataset, used: Sequence[NDArray[np.bool_]], alone: Mapping[str, float]
) -> Scaling:
    """Return the range of the network inputs, with measured past outputs."""
    names = [f"{hybrid.term.name}_input{k}" for k in range(len(hybrid.term.inputs))]
    lines = tuple(Line(signal(name)[t], item) for name, item in zip(names, hybrid.term.inputs, strict=True))
    model = replace(hybrid.model, lines=(*hybrid.model.lines, *lines))
    # Simulate one step ahead, with a signal for each network input.
    fitting = _ahead(model, data, used)
    initial = fitting.initial(fitting.start(alone))
    values = {name: alone[name] for name in fitting.run.parameters}
    columns = []
    for inputs, before, mask in zip(fitting.inputs, initial, used, strict=True):
        found, _ = fitting.run.run(inputs, values, before, jacobian=False)
        columns.append(np.stack([found[name][mask] for name in names], axis=1))
    samples = np.concatenate(columns)
    if not np.isfinite(samples).all():
        raise ModelError(
            f"the simulation of {hybrid.white.name!r} alone diverges on these data: start from other parameter values"
        )
    low, high = samples.min(axis=0), samples.max(axis=0)
    # A constant input has no range; its weight acts as a bias.
    return Scaling((high + low) / 2.0, np.where(high > low, (high - low) / 2.0, 1.0))


def _hidden_weights(term: NeuralTerm, ranges: Scaling, generator: np.random.Generator) -> dict[str, float]:
    """Return random hidden weights in the inputs' units; the last layer is zero."""
    if not term.hidden:
        return {}
    network = fold(nguyen_widrow(term.sizes, generator), ranges, Scaling(np.zeros(1), np.ones(1)))
    weights = network.weights.copy()
    weights[-term.sizes[-1] - 1 :] = 0.0
    largest = float(np.abs(weights).max())
    if largest > term.limit:
        raise ModelError(
            f"the inputs of the network {term.name!r} need weights up to {largest:.3g}, beyond its limit "
            f"{term.limit:g}: scale its inputs, as in (T[t] - 440) / 10"
        )
    names = (parameter.name for parameter in term.parameters)
    return dict(zip(names, weights.tolist(), strict=True))


def _scaled(fitting: Fitting, hybrid: HybridModel, ranges: Scaling, alone: Mapping[str, float]) -> _Scaled:
    start = fitting.start(alone)
    slopes = np.sqrt(np.mean(fitting.jacobian(start) ** 2, axis=0))
    if not np.isfinite(slopes).all():
        raise ModelError(
            f"the simulation of {hybrid.white.name!r} alone diverges on these data: start from other parameter values"
        )
    weights = [fitting.run.parameters.index(parameter.name) for parameter in hybrid.term.parameters]
    unit = np.where(slopes > _INSENSITIVE, 1.0 / np.maximum(slopes, _INSENSITIVE), np.maximum(np.abs(start), 1.0))
    units = np.diag(unit)
    units[np.ix_(weights, weights)] = _weight_units(hybrid.term, ranges, float(unit[weights[-1]]))
    return _Scaled(fitting, units)


def _weight_units(term: NeuralTerm, ranges: Scaling, output: float) -> Array:
    """Return the matrix from weights for scaled inputs and output to weights in their units."""
    k = term.sizes[0]
    m = (*term.hidden, 1)[0]
    units = np.eye(len(term.parameters))
    for row in range(m):
        block = slice(row * k, (row + 1) * k)
        units[block, block] = np.diag(1.0 / ranges.half_range)
        units[m * k + row, block] = -ranges.centre / ranges.half_range
    units[-term.sizes[-1] - 1 :] *= output
    return units


def _after_prediction(
    problem: _Scaled, first: _Scaled, values: Mapping[str, float], method: Method, iterations: int
) -> Array:
    """Return the better start of a free-run fit: the result of the prediction fit, or the first point."""
    found = first.values(descend(method, first, first.theta(values), iterations=iterations, patience=iterations).theta)
    points = [problem.theta(point) for point in (found, values)]
    return min(points, key=lambda theta: float(np.nan_to_num(problem.error(theta), nan=np.inf)))
