"""PX: the position from the pressure of the same instant, by a network.

    x_t = f(P_t),    f: ten tanh neurons, 31 parameters

Reference: clutch thesis, (5.6)-(5.10).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data import Dataset
from smid.networks import ProgressCallback, TanhNetwork, train, weight_count
from smid.sensors.sensor import Run, Samples, VirtualSensor, require_training_data, trained

__all__ = ["PX"]


@dataclass(frozen=True, eq=False)
class PX(VirtualSensor):
    """Pressure to position, without memory.

    Parameters
    ----------
    hidden
        Neurons of each hidden layer.
    network
        From bar to mm; None before training.
    sampling_time
        Of the training records, in seconds.

    Examples
    --------
    >>> PX().n_parameters, PX().channels
    (31, ('pressure',))
    """

    hidden: tuple[int, ...] = (10,)
    network: TanhNetwork | None = None
    sampling_time: float | None = None

    @property
    def channels(self) -> tuple[str, ...]:
        """The pressure."""
        return ("pressure",)

    @property
    def n_parameters(self) -> int:
        """Number of weights and biases."""
        return weight_count((1, *self.hidden))

    def fit(
        self,
        data: Dataset,
        *,
        seed: int | np.random.Generator,
        starts: int = 5,
        progress: ProgressCallback | None = None,
    ) -> Self:
        """Return this sensor, trained by Levenberg-Marquardt; see `VirtualSensor.fit`."""
        require_training_data(data, self.channels)
        training = train(
            data.stacked("pressure")[:, None],
            data.stacked("position"),
            hidden=self.hidden,
            seed=seed,
            starts=starts,
            progress=progress,
        )
        return replace(self, network=training.network, sampling_time=data.sampling_time)

    def run(self) -> Run:
        """Return the sensor; see `VirtualSensor.run`."""
        return _Run(trained(self.network, self))


@dataclass(frozen=True, eq=False)
class _Run:
    network: TanhNetwork

    def advance(self, samples: Samples) -> Array:
        return self.network(samples["pressure"][:, None])
