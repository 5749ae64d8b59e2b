"""PX: the position from the pressure of the same instant, by a network.

    x_t = f(P_t),    f: ten tanh neurons, 31 parameters

Reference: clutch thesis, (5.6)-(5.10).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from smid.data import Dataset
from smid.networks import ProgressCallback, TanhNetwork, train, weight_count
from smid.sensors.curve import NetworkBlock
from smid.sensors.program import Program
from smid.sensors.sensor import VirtualSensor, require_training_data, trained, training_rows
from smid.sensors.trained_on import TrainedOn

__all__ = ["PX"]


@dataclass(frozen=True, eq=False)
class PX(VirtualSensor):
    """Pressure to position, without memory.

    Parameters
    ----------
    hidden
        Neurons of each hidden layer.
    pressure, output
        Names of the channels.
    network
        In the units of the channels; None before training.

    Examples
    --------
    >>> PX().n_parameters, PX().channels
    (31, ('pressure',))
    """

    hidden: tuple[int, ...] = (10,)
    pressure: str = "pressure"
    output: str = "position"
    network: TanhNetwork | None = None
    trained_on: TrainedOn | None = None

    @property
    def channels(self) -> tuple[str, ...]:
        """The pressure."""
        return (self.pressure,)

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
        require_training_data(data, self.channels, self.output)
        rows = training_rows(data)
        training = train(
            data.stacked(self.pressure)[rows, None],
            data.stacked(self.output)[rows],
            hidden=self.hidden,
            seed=seed,
            starts=starts,
            progress=progress,
        )
        told = TrainedOn.of(data, self.channels, self.output)
        return replace(self, network=training.network, trained_on=told)

    def program(self) -> Program:
        """Return the network; see `VirtualSensor.program`."""
        return Program().then(NetworkBlock(trained(self.network, self)), self.pressure)
