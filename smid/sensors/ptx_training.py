"""Training of PTX: all parameters at once, from random starts or from those of a sensor (`smid.sensors.ptx_error`).

70 % of the samples behind the warm-up are fitted, 15 % stop the training; the simulation runs over all samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from relaxations.algebra.arrays import Array
from smid.data import DataError, Dataset
from smid.models import ModelError
from smid.networks import (
    ProgressCallback,
    Scaling,
    TanhNetwork,
    fold,
    levenberg_marquardt,
    multistart,
    nguyen_widrow,
    random_split,
    scaling_of,
)
from smid.sensors.ptx_dynamics import Dynamics
from smid.sensors.ptx_error import SCHEDULED, STARTS, PTXError, Record
from smid.sensors.sensor import training_rows

__all__ = ["extend_ptx", "train_ptx"]

ITERATIONS, PATIENCE = 400, 30
SMALLEST_PLAY, LARGEST_PLAY = 0.02, 0.06  # of the range of the pressure, where thresholds start


def _problem(
    data: Dataset,
    channels: tuple[str, ...],
    output: str,
    hidden: tuple[int, ...],
    plays: int,
    effects: tuple[str, ...],
    generator: np.random.Generator,
) -> tuple[PTXError, PTXError, Scaling]:
    """Return the errors of the fitted and of the stopping samples, and the scaling of the output."""
    position = data.stacked(output)
    ranges = scaling_of(np.stack([data.stacked(name) for name in channels], axis=1), channels)
    scaled = scaling_of(position[:, None], [output])
    inputs = Scaling(ranges.centre[:1], ranges.half_range[:1])
    reference, warmth = (float(ranges.centre[1]), float(ranges.half_range[1])) if len(channels) > 1 else (0.0, 1.0)
    trained_on = training_rows(data)
    split = random_split(trained_on.size, generator)
    learning, checking = (
        PTXError(
            (1, *hidden),
            plays,
            _records(data, channels, output, scaled, trained_on[rows]),
            inputs,
            reference,
            warmth,
            data.sampling_time,
            effects,
        )
        for rows in (split.training, split.validation)
    )
    return learning, checking, scaled


def train_ptx(
    data: Dataset,
    channels: tuple[str, ...],
    output: str,
    hidden: tuple[int, ...],
    plays: int,
    effects: tuple[str, ...],
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
    generator = np.random.default_rng(seed)
    learning, checking, scaled = _problem(data, channels, output, hidden, plays, effects, generator)
    # Start from short time constants, small plays and random networks.
    slack = np.log(2.0 * float(learning.scaling.half_range[0]) * np.geomspace(SMALLEST_PLAY, LARGEST_PLAY, plays))
    times = np.log([data.sampling_time, 2.0 * data.sampling_time])
    begun = [STARTS[effect] for effect in effects]
    known = np.concatenate([times, np.zeros(SCHEDULED - times.size), *begun, slack, slack])
    first = [np.concatenate([known, nguyen_widrow(learning.sizes, generator).weights]) for _ in range(starts)]
    return _descended(learning, checking, scaled, first, progress)


def extend_ptx(
    data: Dataset,
    channels: tuple[str, ...],
    output: str,
    dynamics: Dynamics,
    network: TanhNetwork,
    effects: tuple[str, ...],
    *,
    seed: int | np.random.Generator,
    progress: ProgressCallback | None = None,
) -> tuple[Dynamics, TanhNetwork]:
    """Return dynamics and network, trained on from those of a sensor, with these effects; see `train_ptx`."""
    learning, checking, scaled = _problem(
        data, channels, output, network.sizes[1:], len(dynamics.thresholds), effects, np.random.default_rng(seed)
    )
    if dynamics.backlash is not None:
        dynamics = replace(dynamics, backlash=dynamics.backlash / float(scaled.half_range[0]))
    network = fold(network, _inverse(learning.scaling), _inverse(scaled))
    return _descended(learning, checking, scaled, [learning.theta(dynamics, network.weights)], progress)


def _descended(
    learning: PTXError, checking: PTXError, scaled: Scaling, first: Sequence[Array], progress: ProgressCallback | None
) -> tuple[Dynamics, TanhNetwork]:
    fitted = sum(record.rows.size for record in learning.records)
    if first[0].size > fitted:
        raise DataError(
            f"{first[0].size} parameters but {fitted} training samples: give more samples, or fewer neurons"
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
    found = learning.dynamics(search.theta)
    if found.backlash is not None:
        found = replace(found, backlash=found.backlash * float(scaled.half_range[0]))
    return found, fold(learning.network(search.theta), learning.scaling, scaled)


def _inverse(scaling: Scaling) -> Scaling:
    """Return the scaling that takes scaled numbers back."""
    return Scaling(-scaling.centre / scaling.half_range, 1.0 / scaling.half_range)


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
