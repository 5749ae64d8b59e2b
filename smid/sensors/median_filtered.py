"""A sensor with a median filter, which removes short spikes (clutch thesis, 5.2.4 and figure 5.10)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from smid.data import Dataset
from smid.networks import ProgressCallback
from smid.sensors.median import Median, check_order
from smid.sensors.program import Program
from smid.sensors.sensor import VirtualSensor, trained
from smid.sensors.trained_on import TrainedOn

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
        return 1e3 * self.delay * trained(self.trained_on, self).sampling_time

    @property
    def channels(self) -> tuple[str, ...]:
        """Those of the sensor."""
        return self.sensor.channels

    @property
    def n_parameters(self) -> int:
        """Those of the sensor; the order is chosen, not trained."""
        return self.sensor.n_parameters

    @property
    def output(self) -> str:
        """That of the sensor."""
        return self.sensor.output

    @property
    def trained_on(self) -> TrainedOn | None:
        """The records that trained the sensor."""
        return self.sensor.trained_on

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

    def program(self) -> Program:
        """Return the steps of the sensor, then the median; see `VirtualSensor.program`."""
        inner = self.sensor.program()
        return inner.then(Median(self.order, self.causal), inner.output)
