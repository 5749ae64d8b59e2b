"""What every virtual sensor does: be fitted to records, predict records, and run along with the plant.

A sensor computes the position from channels that are measured in the real application.  `VirtualSensor.run` gives an
object that is fed with blocks of samples and keeps what must be remembered between them; a record is one block, and a
stream is made of blocks of one sample.  The same arithmetic in the same order serves both, so they agree to the last
bit.

Reference: clutch thesis, chapter 5.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Protocol, Self, TypeVar

import numpy as np

from smid.data import DataError, Dataset
from smid.data.channel import name_hint
from smid.models import ModelError
from smid.networks import Array, ProgressCallback
from smid.sensors.prediction import Prediction
from smid.sensors.stream import Stream

__all__ = ["Run", "Samples", "VirtualSensor", "require_channels", "require_training_data", "trained"]

T = TypeVar("T")

Samples = Mapping[str, Array]
"""Channel name to samples: current in mA, pressure in bar, temperature in degC, position in mm."""


class Run(Protocol):
    """A sensor at work, with what it remembers."""

    def advance(self, samples: Samples) -> Array:
        """Return the positions, shape (n,) in mm, of the next n samples."""
        ...


class VirtualSensor(ABC):
    """A sensor of the position.  Frozen: `fit` returns another one, trained."""

    @property
    @abstractmethod
    def channels(self) -> tuple[str, ...]:
        """Names of the channels that it reads."""

    @property
    @abstractmethod
    def n_parameters(self) -> int:
        """How many numbers training finds."""

    @property
    @abstractmethod
    def sampling_time(self) -> float | None:
        """Of the records that trained it, in seconds; None before."""

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
            How many random starts, where training has local minima.
        progress
            Called after each step of training.

        Raises
        ------
        DataError
            If a channel is missing or does not vary, or there are too few samples.
        """

    @abstractmethod
    def run(self) -> Run:
        """Return the sensor at rest, ready to be fed.

        Raises
        ------
        ModelError
            If it is not trained, or needs samples that are still to come.
        """

    def evaluate(self, samples: Samples) -> Array:
        """Return the positions, shape (n,) in mm, of a whole record."""
        return self.run().advance(samples)

    def cautions(self, samples: Samples) -> tuple[str, ...]:  # noqa: ARG002
        """Return what must be said about an answer to these samples."""
        return ()

    def predict(self, data: Dataset) -> Prediction:
        """Compute the position of every record.

        Parameters
        ----------
        data
            With the sensor's channels; the position is not looked at.

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
        """Return the sensor ready for samples one by one.

        Returns
        -------
        Stream
            What it answers is what `predict` says of the same samples.

        Raises
        ------
        ModelError
            If the sensor is not trained, or needs samples that are still to come.
        """
        return Stream(self.run(), self.channels, trained(self.sampling_time, self), self.cautions)


def trained(value: T | None, sensor: VirtualSensor) -> T:
    """Return what training found, or say that there was none.

    Raises
    ------
    ModelError
        If the value is None.
    """
    if value is None:
        raise ModelError(
            f"this {type(sensor).__name__} is not trained: take what its fit(data, seed=...) returns, or load a sensor"
        )
    return value


def require_channels(data: Dataset, channels: tuple[str, ...]) -> None:
    """Refuse records without a channel.

    Raises
    ------
    DataError
        With the channel that is missing, and what it is for.
    """
    for channel in channels:
        if channel not in data.names:
            raise DataError(
                f"the records have no channel {channel!r}, which the sensor needs ({', '.join(channels)}); "
                f"{name_hint(channel, data.names)}, see Dataset.rename"
            )


def require_training_data(data: Dataset, channels: tuple[str, ...]) -> None:
    """Refuse records that cannot train a sensor of these channels.

    Raises
    ------
    DataError
        If a channel or the position is missing, or does not vary.
    """
    require_channels(data, (*channels, "position"))
    for channel in (*channels, "position"):
        samples = data.stacked(channel)
        if np.ptp(samples) == 0:
            raise DataError(
                f"{data.channel(channel)} is {samples[0]:g} in every sample: train on records in which it varies"
            )
