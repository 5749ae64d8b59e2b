"""Training of PTX: all parameters at once, by least squares with analytic sensitivities.

    theta = (log tau_s, log tau_0, c_3 R, c_1 R, c_2 R / S, log r_k, log w_k, weights)

R and S are half the ranges of temperature and pressure. Without a temperature the three c have no effect and stay 0.
The logarithms keep time constants, thresholds and forces positive, so that friction opposes motion and two plays cannot
cancel each other.

With s' the derivative of the smoothed pressure, the plays have ``h' = s'(last contact) + side r'`` and
``g' = (s' - h' - g r') / r`` (`play`), the network adds ``df/dq q'``, and the lag filters the whole Jacobian (`lag`).
The play is not differentiable at the samples where a contact begins.

70 % of the samples are fitted, 15 % stop the training; the simulation runs over all samples.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from relaxations.algebra.arrays import Array
from smid.data import DataError, Dataset
from smid.models import ModelError
from smid.networks import (
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
from smid.sensors.lag import lag, lag_derivatives
from smid.sensors.play import Play, play
from smid.sensors.ptx_dynamics import Dynamics

__all__ = ["PTXError", "Record", "train_ptx"]

ITERATIONS, PATIENCE = 400, 30
SCHEDULED = 5  # parameters before those of the plays
SMALLEST_PLAY, LARGEST_PLAY = 0.02, 0.06  # of the range of the pressure, where thresholds start


@dataclass(frozen=True, eq=False)
class Record:
    """A record for training.

    Parameters
    ----------
    pressure, temperature
        Shape (n,). In bar and degC.
    target
        Shape (n,). Scaled position.
    rows
        Numbers of the samples that count.
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
    sizes
        Of the network.
    plays
        Number of play operators.
    scaling
        Of the pressure.
    reference, warmth
        Centre and half the range of the temperature.
    sampling_time
        In seconds.
    """

    sizes: tuple[int, ...]
    plays: int
    records: tuple[Record, ...]
    scaling: Scaling
    reference: float
    warmth: float
    sampling_time: float

    def dynamics(self, theta: Array) -> Dynamics:
        """Return the dynamics of a parameter vector."""
        m, unit = self.plays, float(self.scaling.half_range[0])
        smoothing, lag_0 = np.exp(theta[:2]).tolist()
        lag_slope, gain_slope, shift_slope = (theta[2:SCHEDULED] / self.warmth).tolist()
        thresholds = np.exp(theta[SCHEDULED : SCHEDULED + m]).tolist()
        forces = np.exp(theta[SCHEDULED + m : SCHEDULED + 2 * m]).tolist()
        return Dynamics(
            smoothing,
            lag_0,
            lag_slope,
            gain_slope,
            unit * shift_slope,
            tuple(thresholds),
            tuple(forces),
            self.reference,
        )

    def network(self, theta: Array) -> TanhNetwork:
        """Return the network, of scaled inputs, of a parameter vector."""
        return TanhNetwork(self.sizes, theta[SCHEDULED + 2 * self.plays :])

    def error(self, theta: Array) -> float:
        """Return the mean squared error of the samples that count."""
        # After a too long step exponentials overflow: the error is then not finite, and the step is rejected.
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            residuals = [self.positions(theta, record) - record.target for record in self.records]
        counted = np.concatenate([e[record.rows] for e, record in zip(residuals, self.records, strict=True)])
        return float(np.mean(counted**2))

    def positions(self, theta: Array, record: Record) -> Array:
        """Return the scaled positions, shape (n,)."""
        dynamics = self.dynamics(theta)
        smoothed, plays = self._pushed(dynamics, record)
        acting = dynamics.acting(smoothed, [p.position for p in plays], record.temperature)
        target = self.network(theta)(self.scaling.apply(acting[:, None]))
        return lag(target, dynamics.lagged(self.sampling_time).pole(record.temperature), float(target[0]))

    def _pushed(self, dynamics: Dynamics, record: Record) -> tuple[Array, list[Play]]:
        """Return the smoothed pressure and the plays, from rest."""
        first, n = float(record.pressure[0]), record.pressure.size
        pole = dynamics.smoothed(self.sampling_time).pole(np.full(n, 0.0))
        smoothed = lag(record.pressure, pole, first)
        return smoothed, [play(smoothed, r, first) for r in dynamics.thresholds]

    def normal_equations(self, theta: Array) -> NormalEquations:
        """Return the normal equations of the samples that count."""
        return sum_normal_equations(self._blocks(theta))

    def _blocks(self, theta: Array) -> Iterator[tuple[Array, Array]]:
        for record in self.records:
            position, jacobian = self.sensitivities(theta, record)
            yield (position - record.target)[record.rows], jacobian[record.rows]

    def sensitivities(self, theta: Array, record: Record) -> tuple[Array, Array]:
        """Return the scaled positions, shape (n,), and their derivatives, shape (n, p)."""
        # The smoothed pressure and its derivative by log tau_s.
        dynamics, m, interval = self.dynamics(theta), self.plays, self.sampling_time
        pressure, n = record.pressure, record.pressure.size
        smoothed, plays = self._pushed(dynamics, record)
        decay = float(dynamics.smoothed(interval).pole(np.asarray(0.0)))
        # d exp(-T / tau) / d log tau = exp(-T / tau) T / tau
        gain = decay * interval / dynamics.smoothing
        before = np.concatenate([pressure[:1], smoothed[:-1]])
        by_smoothing = lag_derivatives((gain * (before - pressure))[None, :], np.full(n, decay))[0]

        # The network's input, and the derivatives of the network's output.
        pushed = [p.position for p in plays]
        states, unit = dynamics.states(smoothed, pushed), self.scaling.half_range[0]
        acting = dynamics.acting(smoothed, pushed, record.temperature)
        part = self.network(theta).linearise(self.scaling.apply(acting[:, None]))
        by_acting, warmth = part.by_inputs[:, 0] / unit, record.temperature - self.reference
        by_pressure = by_acting * dynamics.gain(record.temperature)
        sources = np.zeros((theta.size, n))
        sources[0] = by_pressure * by_smoothing
        sources[3] = by_acting * (acting - dynamics.shift_slope * warmth) * warmth / self.warmth
        sources[4] = by_acting * unit * warmth / self.warmth
        for k, (moved, r, w) in enumerate(zip(plays, dynamics.thresholds, dynamics.forces, strict=True)):
            moving = np.where(moved.side != 0.0, by_smoothing[moved.contact], 0.0)
            sources[0] -= by_pressure * w * (by_smoothing - moving) / r
            sources[SCHEDULED + k] = by_pressure * w * (moved.side + states[k])
            sources[SCHEDULED + m + k] = -by_pressure * w * states[k]
        sources[SCHEDULED + 2 * m :] = part.by_weights.T

        # The lag filters all derivatives; its own two parameters act through the pole.
        decays = dynamics.lagged(interval).pole(record.temperature)
        position = lag(part.outputs, decays, float(part.outputs[0]))
        behind = np.concatenate([part.outputs[:1], position[:-1]]) - part.outputs
        tau = dynamics.lag * np.exp(-dynamics.lag_slope * warmth)
        first = sources[:, 0].copy()
        sources *= 1.0 - decays
        sources[:, 0] = first
        sources[1] = behind * decays * interval / tau
        sources[2] = -sources[1] * warmth / self.warmth
        return position, lag_derivatives(sources, decays).T


def train_ptx(
    data: Dataset,
    channels: tuple[str, ...],
    output: str,
    hidden: tuple[int, ...],
    plays: int,
    *,
    seed: int | np.random.Generator,
    starts: int,
    progress: ProgressCallback | None = None,
) -> tuple[Dynamics, TanhNetwork]:
    """Return the trained dynamics and network of a PTX.

    Parameters
    ----------
    channels
        The pressure, and the temperature if there is one.

    Raises
    ------
    DataError
        If there are more parameters than training samples.
    ModelError
        If there are no starts.
    """
    if starts < 1:
        raise ModelError(f"starts = {starts}: give a positive number")
    # Scale and split the samples.
    generator = np.random.default_rng(seed)
    sizes = (1, *hidden)
    position = data.stacked(output)
    ranges = scaling_of(np.stack([data.stacked(name) for name in channels], axis=1), channels)
    scaled = scaling_of(position[:, None], [output])
    inputs = Scaling(ranges.centre[:1], ranges.half_range[:1])
    reference, warmth = (float(ranges.centre[1]), float(ranges.half_range[1])) if len(channels) > 1 else (0.0, 1.0)
    split = random_split(position.size, generator)
    learning, checking = (
        PTXError(
            sizes, plays, _records(data, channels, output, scaled, rows), inputs, reference, warmth, data.sampling_time
        )
        for rows in (split.training, split.validation)
    )
    # Start from short time constants, small plays and random networks.
    slack = np.log(2.0 * float(ranges.half_range[0]) * np.geomspace(SMALLEST_PLAY, LARGEST_PLAY, plays))
    times = np.log([data.sampling_time, 2.0 * data.sampling_time])
    known = np.concatenate([times, np.zeros(SCHEDULED - times.size), slack, slack])
    first = [np.concatenate([known, nguyen_widrow(sizes, generator).weights]) for _ in range(starts)]
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
    return learning.dynamics(search.theta), fold(learning.network(search.theta), inputs, scaled)


def _records(
    data: Dataset, channels: tuple[str, ...], output: str, scaled: Scaling, rows: NDArray[np.intp]
) -> tuple[Record, ...]:
    """Return the records, each with its own among the row numbers, which count through all records."""
    result, begin = [], 0
    for run in data.experiments:
        mine = rows[(rows >= begin) & (rows < begin + run.n_samples)] - begin
        target = scaled.apply(run.values[output][:, None])[:, 0]
        pressure = run.values[channels[0]]
        temperature = run.values[channels[1]] if len(channels) > 1 else np.zeros(run.n_samples)
        result.append(Record(pressure, temperature, target, mine))
        begin += run.n_samples
    return tuple(result)
