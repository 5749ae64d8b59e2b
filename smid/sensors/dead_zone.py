"""A sensor with a dead zone: up to a threshold of the pressure, the position is the rest position.

    x = rest  where  P <= threshold,   else the output of the sensor

The rest position is the mean of the positions below the threshold. Of all thresholds, the one that lowers the sum of
squared errors most is taken; cumulative sums over the samples sorted by pressure try every one.

Reference: clutch thesis, 5.3.3 and figures 5.19 to 5.21, which do not give the thresholds.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data import Dataset
from smid.networks import ProgressCallback
from smid.sensors.sensor import Run, Samples, VirtualSensor, require_training_data

__all__ = ["DeadZone"]


@dataclass(frozen=True, eq=False)
class DeadZone(VirtualSensor):
    """A sensor, and the rest position at low pressure.

    Parameters
    ----------
    sensor
        Gives the position above the threshold.
    threshold
        In bar; None before training, or if no threshold lowers the error.
    rest
        Position in mm up to the threshold.

    Examples
    --------
    >>> from smid.data.bundled import load_clutch
    >>> from smid.sensors import CFPX
    >>> data = load_clutch("20C_step_a")
    >>> plain = CFPX(10).fit(data, seed=1)
    >>> sensor = DeadZone(CFPX(10)).fit(data, seed=1)
    >>> sensor.predict(data).mse(data) < plain.predict(data).mse(data)
    True
    """

    sensor: VirtualSensor
    threshold: float | None = None
    rest: float | None = None

    @property
    def channels(self) -> tuple[str, ...]:
        """Those of the sensor, and the pressure."""
        return tuple(dict.fromkeys((*self.sensor.channels, "pressure")))

    @property
    def n_parameters(self) -> int:
        """Those of the sensor, threshold and rest."""
        return self.sensor.n_parameters + 2

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
        """Return this sensor, trained, with its dead zone; see `VirtualSensor.fit`."""
        require_training_data(data, self.channels)
        sensor = self.sensor.fit(data, seed=seed, starts=starts, progress=progress)
        # For every threshold: the fall of the squared error if the samples up to it get their mean.
        order = np.argsort(data.stacked("pressure"), kind="stable")
        pressure, position = data.stacked("pressure")[order], data.stacked("position")[order]
        spoken = np.concatenate(sensor.predict(data).position)[order]
        mean = np.cumsum(position) / np.arange(1, position.size + 1)
        at_rest = np.cumsum(position**2) - np.cumsum(position) * mean
        gain = np.cumsum((position - spoken) ** 2) - at_rest
        best = int(np.argmax(gain))
        if gain[best] <= 0:
            return replace(self, sensor=sensor, threshold=None, rest=None)
        return replace(self, sensor=sensor, threshold=float(pressure[best]), rest=float(mean[best]))

    def run(self) -> Run:
        """Return the sensor at rest; see `VirtualSensor.run`."""
        return _Run(self.sensor.run(), self._enforced)

    def evaluate(self, samples: Samples) -> Array:
        """Return the positions of a whole record; see `VirtualSensor.evaluate`."""
        return self._enforced(samples, self.sensor.evaluate(samples))

    def _enforced(self, samples: Samples, position: Array) -> Array:
        if self.threshold is None or self.rest is None:
            return position
        return np.where(samples["pressure"] <= self.threshold, self.rest, position)

    def cautions(self, samples: Samples) -> tuple[str, ...]:
        """Return the warnings of the sensor."""
        return self.sensor.cautions(samples)


@dataclass(frozen=True, eq=False)
class _Run:
    inner: Run
    enforce: Callable[[Samples, Array], Array]

    def advance(self, samples: Samples) -> Array:
        return self.enforce(samples, self.inner.advance(samples))
