"""Estimation of a hybrid model's parameters and weights by nonlinear least squares.

The residual is the output error one step ahead ("prediction", past outputs are measured) or in a free run
("simulation", past outputs are the model's own). The minimiser is one of `smid.networks`.

- Scaling: network inputs are scaled to [-1, 1]. All other numbers get units that change the output by one standard
  deviation (`smid.hybrid.problem`).
- Start: random hidden weights, for every network. The last layers start at zero, which is the first-principles model
  alone. A free-run fit starts from the result of the prediction fit, because it learns dynamics slowly from zero.
- Initial states, also of hidden states, are estimated together with the parameters (`smid.fitting.problem`).
- Safeguard: steps are projected on the parameters' boxes. Where the run diverges, the error is infinite, so no step
  goes there. A descent that stalls is told.
- Against overfitting: a penalty of squared weights, by default the one that the data tell
  (`smid.hybrid.regularisation`), or early stopping on the last part of each experiment.

Reference: hybrid thesis, sections 3.4 and 4.2; Nguyen and Widrow, IJCNN 1990; Prechelt (1998) (early stopping).
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from relaxations.algebra.arrays import Array
from smid.data import DataError, Dataset
from smid.fitting.problem import Fitting
from smid.hybrid.analysis import required
from smid.hybrid.back_couplings import warn_of_few_couplings
from smid.hybrid.hybrid_estimate import HybridEstimate
from smid.hybrid.hybrid_model import HybridModel, bound_to
from smid.hybrid.integration import integration_error
from smid.hybrid.problem import HybridError, hybrid_error, output_slopes
from smid.hybrid.regularisation import FIRST, regularised, weight_groups, with_penalty
from smid.hybrid.scaled_start import ahead_of, first_principles, has_sensor_curve, hidden_weights, scaled
from smid.hybrid.trained_range import network_inputs, trained_ranges
from smid.models import Model, ModelError
from smid.models.errors import refuse_unknown
from smid.networks import (
    Method,
    ProgressCallback,
    Stop,
    descend,
    levenberg_marquardt,
    multistart,
)

__all__ = ["ERRORS", "StalledFitWarning", "estimate"]

ERRORS = ("prediction", "simulation")
_PATIENCE = 30  # steps without a smaller validation error

Masks = list[NDArray[np.bool_]]


class StalledFitWarning(UserWarning):
    """Warning that the best descent of an estimate ended although a step should lower its error.

    Examples
    --------
    >>> issubclass(StalledFitWarning, UserWarning)
    True
    """


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
    regularisation: float | None = None,
    validation: float = 0.0,
    scale: Mapping[str, float] | None = None,
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
    regularisation
        Penalty of each squared, scaled weight, against the sum of squared errors in standard deviations. By default it
        is found from the data; with `validation` it is zero.
    validation
        Share of the used samples, the last of each experiment, that stop the descents early and choose the start.
    scale
        Of each output channel, what its errors are divided by; by default its standard deviation. A smaller one gives
        the channel a larger weight.
    progress
        Called after each step with a `Progress`.

    Warns
    -----
    BackCouplingWarning
        If the network has fewer back couplings than the plant requires.
    StalledFitWarning
        If the best descent ended although a step should lower its error.

    Raises
    ------
    DataError
        If there are more unknowns than samples, or a channel is missing.
    ModelError
        If an option is unknown or not valid, or the first-principles simulation diverges.

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
    _check_options(error, starts, iterations, regularisation, validation)
    # Compare the back couplings with those that the plant requires.
    if plant is not None:
        needed = required(plant, hybrid.white, hybrid.topology, data.sampling_time)
        warn_of_few_couplings(hybrid.couplings, needed.couplings, stacklevel=2)
    # Prepare the free-run and the one-step-ahead problem, with scaled networks.
    hybrid = bound_to(hybrid, data)
    _check_scale(scale, hybrid)
    masks = [np.arange(run.n_samples) >= data.n_init for run in data.experiments] if used is None else list(used)
    _check_count(Fitting(hybrid.model, data, masks))
    alone = first_principles(hybrid)
    hybrid = scaled(hybrid, data, masks, alone)
    training, checking = _split(masks, validation)
    # Descend from random hidden weights: one step ahead, and from there in a free run.
    generator = np.random.default_rng(seed)
    points = [{**alone, **hidden_weights(hybrid, generator)} for _ in range(starts)]
    found_from_data = regularisation is None and not validation
    penalty = FIRST if found_from_data else regularisation or 0.0
    stages = _Stages(hybrid, data, training, method, iterations, penalty, scale)
    begun = [stages.begin(values, error) for values in points]
    problem = stages.problem(error, begun[0])
    thetas = [problem.theta(values) for values in begun]
    check = replace(stages, used=checking).fitting(error)
    check.start(begun[0])
    search = multistart(
        method,
        problem,
        thetas,
        validation=(lambda theta: _mean_square(check, problem.vector(theta))) if validation else None,
        iterations=iterations,
        patience=_PATIENCE if validation else iterations,
        progress=progress,
    )
    last = search.descents[search.winner]
    if found_from_data:
        problem, last = regularised(problem, hybrid, last.theta, method, iterations)
    theta = last.theta
    # Run freely over everything; a prediction fit still needs initial states.
    values = problem.values(theta)
    free_run = Fitting(hybrid.model, data, masks, scale=scale)
    if error == "prediction":
        vector, cost = free_run.solve(free_run.start(values), held=free_run.run.parameters)
    else:
        free_run.start(values)
        vector = problem.vector(theta)
        cost = float(np.sum(free_run.residual(vector) ** 2))
    found = free_run.result(vector, cost)
    hybrid = replace(hybrid, model=found.model)
    inputs = network_inputs(hybrid, lambda model: Fitting(model, data, masks), found.model.values, found.initial)
    ranges, integration = trained_ranges(hybrid, inputs, masks), integration_error(found, data, masks)
    result = HybridEstimate(hybrid, found, search, last.stop, ranges, integration, data, tuple(masks), scale)
    if result.stop is Stop.STALLED:
        warnings.warn(result.notes[0], StalledFitWarning, stacklevel=2)
    return result


def _check_options(error: str, starts: int, iterations: int, regularisation: float | None, validation: float) -> None:
    refuse_unknown("error", [error], ERRORS)
    if starts < 1 or iterations < 1:
        raise ModelError(f"starts = {starts}, iterations = {iterations}: give positive numbers")
    if regularisation is not None and not 0 <= regularisation < np.inf:
        raise ModelError(f"regularisation = {regularisation}: give 0 or a small positive number, such as 1e-4")
    if not 0 <= validation <= 0.5:
        raise ModelError(f"validation = {validation}: give a share of the samples between 0 and 0.5")


@dataclass(frozen=True, eq=False)
class _Stages:
    """What leads from a random start to the start of the final descent."""

    hybrid: HybridModel
    data: Dataset
    used: Masks
    method: Method
    iterations: int
    penalty: float
    scale: Mapping[str, float] | None

    def fitting(self, error: str) -> Fitting:
        kind = ahead_of if error == "prediction" else Fitting
        return kind(self.hybrid.model, self.data, self.used, scale=self.scale)

    def problem(self, error: str, at: Mapping[str, float]) -> HybridError:
        plain = hybrid_error(self.fitting(error), self.hybrid, at)
        groups = weight_groups(plain, self.hybrid)
        return with_penalty(plain, groups, [self.penalty] * len(groups))

    def begin(self, values: Mapping[str, float], error: str) -> Mapping[str, float]:
        """Return a start of a free-run fit: where a prediction fit ends, or its best point if the run there is bad."""
        if error == "prediction" or has_sensor_curve(self.hybrid.model):
            return values
        first, free_run = self.problem("prediction", values), self.fitting("simulation")
        start = first.theta(values)

        def known(theta: Array) -> dict[str, float]:
            return {**values, **first.values(theta)}

        def run_error(theta: Array) -> float:
            return _run_error(free_run, free_run.start(known(theta)))

        fit = partial(descend, self.method, first, start, iterations=self.iterations, patience=self.iterations)
        end = fit().theta
        return known(end if run_error(end) < run_error(start) else fit(validation=run_error).theta)


def _run_error(fitting: Fitting, vector: Array) -> float:
    """Return the mean square of a free run; infinite where the rounding of the fitted numbers decides it."""
    slopes = output_slopes(fitting, vector)
    decided = slopes is not None and np.finfo(float).eps * np.max(slopes * np.abs(vector)) < 1.0
    return _mean_square(fitting, vector) if decided else np.inf


def _mean_square(fitting: Fitting, vector: Array) -> float:
    with np.errstate(all="ignore"):
        return float(np.nan_to_num(np.mean(fitting.residual(vector) ** 2), nan=np.inf))


def _check_scale(scale: Mapping[str, float] | None, hybrid: HybridModel) -> None:
    channels = hybrid.model.output_channels
    if scale is not None and (sorted(scale) != sorted(channels) or not all(0 < s < np.inf for s in scale.values())):
        raise ModelError(f"scale = {dict(scale)}: give a positive number for each of {', '.join(channels)}")


def _check_count(fitting: Fitting) -> None:
    samples = sum(int(mask.sum()) for mask in fitting.used) * len(fitting.outputs)
    if fitting.n_free > samples:
        raise DataError(
            f"{fitting.n_free} parameters, weights and initial states but {samples} samples to estimate them from: "
            "give more samples, or fewer neurons"
        )


def _split(masks: Masks, validation: float) -> tuple[Masks, Masks]:
    """Return the samples to descend on, and the last of each experiment, to stop on."""
    training, checking = [], []
    for mask in masks:
        order = np.cumsum(mask)
        last = mask & (order > round((1.0 - validation) * order[-1]))
        training.append(mask & ~last)
        checking.append(last)
    return training, checking
