"""The interface of virtual sensors: fit to records, predict records, and run sample by sample.

A sensor computes an output, such as a position, from channels that are measured in the application. Its steps are a
`smid.sensors.program.Program`: a record is one block of samples, and a stream is made of blocks of one sample, so both
give the same result to the last bit.

Reference: clutch thesis, chapter 5.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from relaxations.algebra.arrays import Array
from smid.data import DataError, Dataset
from smid.data.channel import name_hint
from smid.data.gaps import require_complete
from smid.models import ModelError
from smid.networks import ProgressCallback
from smid.sensors.prediction import Prediction
from smid.sensors.program import Program, Samples
from smid.sensors.stream import Stream
from smid.sensors.trained_on import TrainedOn

__all__ = ["VirtualSensor", "require_channels", "require_training_data", "trained", "training_rows"]

T = TypeVar("T")


class VirtualSensor(ABC):
    """A sensor of an output that is not measured. It is frozen: `fit` returns another, trained sensor."""

    @property
    @abstractmethod
    def channels(self) -> tuple[str, ...]:
        """Names of the channels that it reads."""

    @property
    @abstractmethod
    def output(self) -> str:
        """Name of the channel that it computes."""

    @property
    @abstractmethod
    def n_parameters(self) -> int:
        """Number of trained parameters."""

    @property
    @abstractmethod
    def trained_on(self) -> TrainedOn | None:
        """Names, units and ranges of the training records; None before training."""

    @abstractmethod
    def fit(
        self,
        data: Dataset,
        *,
        seed: int | np.random.Generator,
        starts: int = 5,
        progress: ProgressCallback | None = None,
    ) -> Self:
        """Return this sensor, trained.

        Parameters
        ----------
        data
            Records with the sensor's channels and its output. Their warm-up (`Dataset.n_init`) is run over, not fitted.
        seed
            Of the split and of the starts.
        starts
            Number of random starts, where training has local minima.
        progress
            Called after each step of training.

        Raises
        ------
        DataError
            If a channel is missing or does not vary, or there are too few samples.
        """

    @abstractmethod
    def program(self) -> Program:
        """Return the steps of the sensor.

        Raises
        ------
        ModelError
            If it is not trained.
        """

    @property
    def sampling_time(self) -> float | None:
        """Of the training records, in seconds; None before training."""
        return None if self.trained_on is None else self.trained_on.sampling_time

    def evaluate(self, samples: Samples) -> Array:
        """Return the output, shape (n,), of a whole record in the units of the training."""
        program = self.program()
        return program.advance(samples)[0][program.output]

    def predict(self, data: Dataset) -> Prediction:
        """Return the computed output of every record; the measured output is not used.

        Raises
        ------
        DataError
            If a channel is missing, a unit does not match, or the sampling time is not that of the training.
        ModelError
            If the sensor is not trained.
        """
        told = trained(self.trained_on, self)
        require_channels(data, self.channels)
        data, warnings = told.read(data)
        return Prediction(
            output=told.output,
            records=tuple(run.name for run in data.experiments),
            position=tuple(self.evaluate(run.values) for run in data.experiments),
            warnings=(
                *warnings,
                *(f"{run.name}: {said}" for run in data.experiments for said in told.cautions(run.values)),
            ),
        )

    def stream(self, *, units: Mapping[str, str] | None = None, state: Mapping[str, Any] | None = None) -> Stream:
        """Return the sensor for samples one by one; its answers equal those of `predict`.

        Parameters
        ----------
        units
            Of the samples by channel; by default those of the training.
        state
            Of an earlier stream of this sensor, see `Stream.state`.

        Raises
        ------
        DataError
            If a unit does not match, or the state is that of another sensor.
        ModelError
            If the sensor is not trained, or needs future samples.
        """
        told = trained(self.trained_on, self)
        return Stream(self.program(), told, units or {}, state)


def trained(value: T | None, sensor: object) -> T:
    """Return a trained value; raise a `ModelError` if it is None."""
    if value is None:
        raise ModelError(
            f"this {type(sensor).__name__} is not trained: take what its fit(data, seed=...) returns, or load a sensor"
        )
    return value


def require_channels(data: Dataset, channels: tuple[str, ...]) -> None:
    """Raise a `DataError` if the records lack a channel, or samples."""
    for channel in channels:
        if channel not in data.names:
            raise DataError(
                f"the records have no channel {channel!r}, which the sensor needs ({', '.join(channels)}); "
                f"{name_hint(channel, data.names)}, see Dataset.rename"
            )
    require_complete(data, "a virtual sensor")


def require_training_data(data: Dataset, channels: tuple[str, ...], output: str) -> None:
    """Raise a `DataError` if a channel or the output is missing or does not vary."""
    require_channels(data, (*channels, output))
    for channel in (*channels, output):
        samples = data.stacked(channel)
        if np.ptp(samples) == 0:
            raise DataError(
                f"{data.channel(channel)} is {samples[0]:g} in every sample: train on records in which it varies"
            )


def training_rows(data: Dataset) -> NDArray[np.intp]:
    """Return the numbers of the samples behind the warm-up, counted through all records."""
    scored = [np.arange(run.n_samples) >= data.n_init for run in data.experiments]
    return np.flatnonzero(np.concatenate(scored))
