"""The interface of virtual sensors: fit to records, predict records, and run sample by sample.

A sensor computes the position from channels that are measured in the application. `VirtualSensor.run` returns an object
that takes blocks of samples and keeps the state between them. A record is one block, and a stream is made of blocks of
one sample, so both give the same result to the last bit.

Reference: clutch thesis, chapter 5.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Protocol, Self, TypeVar

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data import DataError, Dataset
from smid.data.channel import name_hint
from smid.data.gaps import require_complete
from smid.models import ModelError
from smid.networks import ProgressCallback
from smid.sensors.prediction import Prediction
from smid.sensors.stream import Stream

__all__ = ["Run", "Samples", "VirtualSensor", "require_channels", "require_training_data", "trained"]

T = TypeVar("T")

Samples = Mapping[str, Array]
"""Channel name to samples: current in mA, pressure in bar, temperature in degC, position in mm."""


class Run(Protocol):
    """A running sensor, with its state."""

    def advance(self, samples: Samples) -> Array:
        """Return the positions, shape (n,) in mm, of the next n samples."""
        ...


class VirtualSensor(ABC):
    """A sensor of the position. It is frozen: `fit` returns another, trained sensor."""

    @property
    @abstractmethod
    def channels(self) -> tuple[str, ...]:
        """Names of the channels that it reads."""

    @property
    @abstractmethod
    def n_parameters(self) -> int:
        """Number of trained parameters."""

    @property
    @abstractmethod
    def sampling_time(self) -> float | None:
        """Of the training records, in seconds; None before training."""

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
            Records with the sensor's channels and the position.
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
    def run(self) -> Run:
        """Return the sensor at rest, ready for samples.

        Raises
        ------
        ModelError
            If it is not trained, or needs future samples.
        """

    def evaluate(self, samples: Samples) -> Array:
        """Return the positions, shape (n,) in mm, of a whole record."""
        return self.run().advance(samples)

    def cautions(self, samples: Samples) -> tuple[str, ...]:  # noqa: ARG002
        """Return warnings about the answer to these samples."""
        return ()

    def predict(self, data: Dataset) -> Prediction:
        """Return the computed position of every record; the measured position is not used.

        Raises
        ------
        DataError
            If a channel is missing, or the sampling time is not that of the training.
        ModelError
            If the sensor is not trained.
        """
        sampling_time = trained(self.sampling_time, self)
        require_channels(data, self.channels)
        if not np.isclose(data.sampling_time, sampling_time, rtol=1e-6):
            raise DataError(
                f"the records have a sampling time of {data.sampling_time:g} s, those that trained the sensor "
                f"{sampling_time:g} s: resample the records"
            )
        return Prediction(
            records=tuple(run.name for run in data.experiments),
            position=tuple(self.evaluate(run.values) for run in data.experiments),
            warnings=tuple(f"{run.name}: {said}" for run in data.experiments for said in self.cautions(run.values)),
        )

    def stream(self) -> Stream:
        """Return the sensor for samples one by one; its answers equal those of `predict`.

        Raises
        ------
        ModelError
            If the sensor is not trained, or needs future samples.
        """
        return Stream(self.run(), self.channels, trained(self.sampling_time, self), self.cautions)


def trained(value: T | None, sensor: VirtualSensor) -> T:
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


def require_training_data(data: Dataset, channels: tuple[str, ...]) -> None:
    """Raise a `DataError` if a channel or the position is missing or does not vary."""
    require_channels(data, (*channels, "position"))
    for channel in (*channels, "position"):
        samples = data.stacked(channel)
        if np.ptp(samples) == 0:
            raise DataError(
                f"{data.channel(channel)} is {samples[0]:g} in every sample: train on records in which it varies"
            )
