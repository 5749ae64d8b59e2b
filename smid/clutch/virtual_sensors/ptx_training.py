"""Training of PTX: smoothing, thresholds, lag and weights at once, by least squares with analytic sensitivities.

    theta = (log tau_s, log tau_20, c R, log r_1, ..., log r_m, weights),    R half the range of the temperature

Logarithms keep time constants and thresholds positive.  With s' the derivative of the smoothed pressure, the plays have
``h' = s'(last contact) + side r'`` and ``g' = (s' - h' - g r') / r`` (`play`), the network adds
``df/ds s' + sum_k df/dg_k g_k'``, and the lag filters the whole Jacobian (`lag`).  The play is not differentiable where
a contact begins; these are single samples.

70 % of the samples are fitted, 15 % stop the training; the state runs over all of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from smid.clutch.virtual_sensors.lag import lag, lag_derivatives
from smid.clutch.virtual_sensors.ptx_dynamics import REFERENCE, Dynamics
from smid.data import DataError, Dataset
from smid.networks import (
    Array,
    NormalEquations,
    ProgressCallback,
    Scaling,
    TanhNetwork,
    fold,
    levenberg_marquardt,
    multistart,
    nguyen_widrow,
    random_split,
    scaling_of,
    sum_normal_equations,
)

__all__ = ["PTXError", "Record", "train_ptx"]

ITERATIONS, PATIENCE = 400, 30
SMALLEST_PLAY, LARGEST_PLAY = 0.02, 0.06  # of the range of the pressure, where thresholds start


@dataclass(frozen=True, eq=False)
class Record:
    """What training needs of a record.

    Parameters
    ----------
    pressure : ndarray, shape (n,)
        In bar.
    temperature : ndarray, shape (n,)
        In degC.
    target : ndarray, shape (n,)
        Position, scaled.
    rows : ndarray of int
        Which samples count.
    """

    pressure: Array
    temperature: Array
    target: Array
    rows: NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class PTXError:
    """The error of a PTX on chosen samples of records, as a least-squares problem.

    Parameters
    ----------
    sizes : tuple of int
        Of the network.
    records : tuple of Record
    scaling : Scaling
        Of the network's inputs.
    sampling_time : float
        In seconds.
    """

    sizes: tuple[int, ...]
    records: tuple[Record, ...]
    scaling: Scaling
    sampling_time: float

    @property
    def plays(self) -> int:
        """How many."""
        return self.sizes[0] - 2

    def dynamics(self, theta: Array) -> Dynamics:
        """Return the time constants and thresholds that a vector stands for."""
        smoothing, lag_20, slope = theta[:3]
        thresholds = np.exp(theta[3 : 3 + self.plays]).tolist()
        warmth = float(self.scaling.half_range[-1])
        return Dynamics(float(np.exp(smoothing)), float(np.exp(lag_20)), float(slope) / warmth, tuple(thresholds))

    def network(self, theta: Array) -> TanhNetwork:
        """Return the network of scaled inputs that a vector stands for."""
        return TanhNetwork(self.sizes, theta[3 + self.plays :])

    def error(self, theta: Array) -> float:
        """Return the mean squared error of the samples that count."""
        # A step too long makes exponentials overflow; then there is no error, and the step is refused.
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            residuals = [self.positions(theta, record) - record.target for record in self.records]
        counted = np.concatenate([e[record.rows] for e, record in zip(residuals, self.records, strict=True)])
        return float(np.mean(counted**2))

    def positions(self, theta: Array, record: Record) -> Array:
        """Return the scaled positions, shape (n,)."""
        dynamics = self.dynamics(theta)
        memory = dynamics.rest(float(record.pressure[0]))
        smoothed = dynamics.smooth(record.pressure, memory, self.sampling_time)
        inputs = dynamics.inputs(smoothed, dynamics.push(smoothed, memory), record.temperature)
        target = self.network(theta)(self.scaling.apply(inputs))
        return lag(target, dynamics.lag_decay(record.temperature, self.sampling_time), float(target[0]))

    def normal_equations(self, theta: Array) -> NormalEquations:
        """Return the normal equations of the samples that count."""
        return sum_normal_equations(self._blocks(theta))

    def _blocks(self, theta: Array) -> Iterator[tuple[Array, Array]]:
        for record in self.records:
            position, jacobian = self.sensitivities(theta, record)
            yield (position - record.target)[record.rows], jacobian[record.rows]

    def sensitivities(self, theta: Array, record: Record) -> tuple[Array, Array]:
        """Return the scaled positions, shape (n,), and their derivatives, shape (n, p)."""
        dynamics, m, interval = self.dynamics(theta), self.plays, self.sampling_time
        pressure, n = record.pressure, record.pressure.size
        memory = dynamics.rest(float(pressure[0]))
        smoothed = dynamics.smooth(pressure, memory, interval)
        decay = dynamics.smoothing_decay(interval)
        # d exp(-T / tau) / d log tau = exp(-T / tau) T / tau
        gain = decay * interval / dynamics.smoothing
        before = np.concatenate([[memory.smoothed], smoothed[:-1]])
        by_smoothing = lag_derivatives((gain * (before - pressure))[None, :], np.full(n, decay))[0]

        plays = dynamics.push(smoothed, memory)
        inputs = dynamics.inputs(smoothed, plays, record.temperature)
        part = self.network(theta).linearise(self.scaling.apply(inputs))
        by_inputs = part.by_inputs / self.scaling.half_range
        sources = np.zeros((theta.size, n))
        sources[0] = by_inputs[:, 0] * by_smoothing
        for k, (moved, r) in enumerate(zip(plays, dynamics.thresholds, strict=True)):
            pushed = np.where(moved.side != 0.0, by_smoothing[moved.contact], 0.0)
            sources[0] += by_inputs[:, 1 + k] * (by_smoothing - pushed) / r
            sources[3 + k] = by_inputs[:, 1 + k] * (-moved.side - inputs[:, 1 + k])
        sources[3 + m :] = part.by_weights.T

        decays = dynamics.lag_decay(record.temperature, interval)
        position = lag(part.outputs, decays, float(part.outputs[0]))
        behind = np.concatenate([part.outputs[:1], position[:-1]]) - part.outputs
        warmth = (record.temperature - REFERENCE) / self.scaling.half_range[-1]
        tau = dynamics.lag * np.exp(-dynamics.slope * (record.temperature - REFERENCE))
        first = sources[:, 0].copy()
        sources *= 1.0 - decays
        sources[:, 0] = first
        sources[1] = behind * decays * interval / tau
        sources[2] = -sources[1] * warmth
        return position, lag_derivatives(sources, decays).T


def train_ptx(
    data: Dataset,
    hidden: tuple[int, ...],
    plays: int,
    *,
    seed: int | np.random.Generator,
    starts: int,
    progress: ProgressCallback | None = None,
) -> tuple[Dynamics, TanhNetwork]:
    """Train the parts of a PTX.

    Parameters
    ----------
    data : Dataset
        Records with pressure in bar, temperature in degC and position in mm.
    hidden : tuple of int
        Neurons of each hidden layer.
    plays : int
        How many play operators.
    seed : int or numpy.random.Generator
        Of the split and of the starts.
    starts : int
        How many random starts.
    progress : callable, optional
        Called after each step.

    Returns
    -------
    Dynamics
    TanhNetwork
        From bar, states and degC to mm.

    Raises
    ------
    DataError
        If there are more parameters than training samples.
    """
    generator = np.random.default_rng(seed)
    sizes = (plays + 2, *hidden)
    pressure, temperature, position = (data.stacked(name) for name in ("pressure", "temperature", "position"))
    ranges = scaling_of(np.stack([pressure, temperature], axis=1), ["pressure", "temperature"])
    output = scaling_of(position[:, None], ["position"])
    inputs = Scaling(
        np.concatenate([ranges.centre[:1], np.zeros(plays), ranges.centre[1:]]),
        np.concatenate([ranges.half_range[:1], np.ones(plays), ranges.half_range[1:]]),
    )
    split = random_split(position.size, generator)
    learning, checking = (
        PTXError(sizes, _records(data, output, rows), inputs, data.sampling_time)
        for rows in (split.training, split.validation)
    )
    slack = np.log(2.0 * float(ranges.half_range[0]) * np.geomspace(SMALLEST_PLAY, LARGEST_PLAY, plays))
    times = np.log([data.sampling_time, 2.0 * data.sampling_time])
    first = [np.concatenate([times, [0.0], slack, nguyen_widrow(sizes, generator).weights]) for _ in range(starts)]
    if first[0].size > split.training.size:
        raise DataError(
            f"{first[0].size} parameters but {split.training.size} training samples of {position.size}: "
            "give more samples, or fewer neurons"
        )
    search = multistart(
        levenberg_marquardt,
        learning,
        first,
        validation=checking.error,
        iterations=ITERATIONS,
        patience=PATIENCE,
        progress=progress,
    )
    return learning.dynamics(search.theta), fold(learning.network(search.theta), inputs, output)


def _records(data: Dataset, output: Scaling, rows: NDArray[np.intp]) -> tuple[Record, ...]:
    """Return the records with those of the rows, numbered through all records, that are theirs."""
    result, begin = [], 0
    for run in data.experiments:
        mine = rows[(rows >= begin) & (rows < begin + run.n_samples)] - begin
        target = output.apply(run.values["position"][:, None])[:, 0]
        result.append(Record(run.values["pressure"], run.values["temperature"], target, mine))
        begin += run.n_samples
    return tuple(result)
