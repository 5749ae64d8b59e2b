"""A sensor with a median filter, which removes short spikes (clutch thesis, 5.2.4 and figure 5.10)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data import Dataset
from smid.models import ModelError
from smid.networks import ProgressCallback
from smid.sensors.median import RunningMedian, centred_median, check_order, check_record
from smid.sensors.sensor import Run, Samples, VirtualSensor, trained

__all__ = ["MedianFiltered"]


@dataclass(frozen=True, eq=False)
class MedianFiltered(VirtualSensor):
    """A sensor and the median of its output.

    Parameters
    ----------
    order
        Samples in the window; the thesis has 50 for CPX and 250 for CFPX.
    causal
        Whether the window ends at the present sample, as real time needs, or is centred, as in the thesis.

    Raises
    ------
    ModelError
        If the order is not a whole number of at least 1.

    Examples
    --------
    >>> from smid.sensors import CPX
    >>> MedianFiltered(CPX(), causal=True).delay, MedianFiltered(CPX()).delay
    (24.5, 0.0)
    """

    sensor: VirtualSensor
    order: int = 50
    causal: bool = False

    def __post_init__(self) -> None:
        check_order(self.order)

    @property
    def delay(self) -> float:
        """Delay of a rise or fall, in samples."""
        return (self.order - 1) / 2.0 if self.causal else 0.0

    @property
    def delay_ms(self) -> float:
        """Delay in milliseconds; the sensor must be trained."""
        return 1e3 * self.delay * trained(self.sampling_time, self)

    @property
    def channels(self) -> tuple[str, ...]:
        """Those of the sensor."""
        return self.sensor.channels

    @property
    def n_parameters(self) -> int:
        """Those of the sensor; the order is chosen, not trained."""
        return self.sensor.n_parameters

    @property
    def sampling_time(self) -> float | None:
        """Of the records that trained the sensor, in seconds."""
        return self.sensor.sampling_time

    def fit(
        self,
        data: Dataset,
        *,
        seed: int | np.random.Generator,
        starts: int = 5,
        progress: ProgressCallback | None = None,
    ) -> Self:
        """Return this sensor, trained; see `VirtualSensor.fit`."""
        return replace(self, sensor=self.sensor.fit(data, seed=seed, starts=starts, progress=progress))

    def run(self) -> Run:
        """Return the sensor at rest; see `VirtualSensor.run`."""
        if not self.causal:
            raise ModelError("a centred median needs future samples: take causal=True, which has a delay")
        return _Run(self.sensor.run(), RunningMedian(self.order))

    def evaluate(self, samples: Samples) -> Array:
        """Return the filtered positions of a whole record; see `VirtualSensor.evaluate`."""
        if not self.causal:
            return centred_median(self.sensor.evaluate(samples), self.order)
        check_record(next(iter(samples.values())).size, self.order)
        return super().evaluate(samples)

    def cautions(self, samples: Samples) -> tuple[str, ...]:
        """Return the warnings of the sensor."""
        return self.sensor.cautions(samples)


@dataclass(frozen=True, eq=False)
class _Run:
    inner: Run
    median: RunningMedian

    def advance(self, samples: Samples) -> Array:
        return np.array([self.median.update(x) for x in self.inner.advance(samples).tolist()])
