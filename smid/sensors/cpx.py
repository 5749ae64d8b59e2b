"""CPX: the position from two past samples of current and of pressure, by a network.

    x_t = f(I_{t-1}, I_{t-2}, P_{t-1}, P_{t-2}),    f: ten tanh neurons, 61 parameters

It reads any channels with any delays. Before the first sample, a channel has its first value.

Reference: clutch thesis, (5.1)-(5.5).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from smid.data import Dataset
from smid.models import ModelError
from smid.networks import ProgressCallback, TanhNetwork, delayed, train, weight_count
from smid.sensors.curve import NetworkBlock
from smid.sensors.delay import Delay
from smid.sensors.program import Program
from smid.sensors.sensor import VirtualSensor, require_training_data, trained, training_rows
from smid.sensors.trained_on import TrainedOn

__all__ = ["CPX"]


@dataclass(frozen=True, eq=False)
class CPX(VirtualSensor):
    """Past samples of current and pressure to position.

    Parameters
    ----------
    hidden
        Neurons of each hidden layer.
    inputs, output
        Names of the channels.
    delays
        Of each input, in samples.
    network
        In the units of the channels; None before training.

    Raises
    ------
    ModelError
        If there is no input, or a delay is negative.

    Examples
    --------
    >>> from smid.data.bundled import load_clutch
    >>> data = load_clutch("20C_step_a")
    >>> sensor = CPX(hidden=(4,)).fit(data, seed=1, starts=1)
    >>> sensor.n_parameters, sensor.predict(data).mse(data) < 0.02
    (25, True)
    """

    hidden: tuple[int, ...] = (10,)
    inputs: tuple[str, ...] = ("current", "pressure")
    delays: tuple[int, ...] = (1, 2)
    output: str = "position"
    network: TanhNetwork | None = None
    trained_on: TrainedOn | None = None

    def __post_init__(self) -> None:
        if not self.inputs or not self.delays or min(self.delays) < 0:
            raise ModelError(f"inputs = {self.inputs}, delays = {self.delays}: give channels, and delays of 0 or more")

    @property
    def channels(self) -> tuple[str, ...]:
        """The inputs."""
        return self.inputs

    @property
    def n_parameters(self) -> int:
        """Number of weights and biases."""
        return weight_count((len(self.delays) * len(self.inputs), *self.hidden))

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
        lines = [self.delays] * len(self.inputs)
        rows = training_rows(data)
        training = train(
            np.concatenate([delayed([run.values[n] for n in self.inputs], lines) for run in data.experiments])[rows],
            data.stacked(self.output)[rows],
            hidden=self.hidden,
            seed=seed,
            starts=starts,
            progress=progress,
        )
        told = TrainedOn.of(data, self.channels, self.output)
        return replace(self, network=training.network, trained_on=told)

    def program(self) -> Program:
        """Return the delays and the network; see `VirtualSensor.program`."""
        program, reads = Program(), list[str]()
        for name in self.inputs:
            for delay in self.delays:
                if delay:
                    program = program.then(Delay(delay), name)
                reads.append(program.output if delay else name)
        return program.then(NetworkBlock(trained(self.network, self)), *reads)
