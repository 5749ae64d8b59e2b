"""CPX: the position from two past samples of current and of pressure, by a network.

    x_t = f(I_{t-1}, I_{t-2}, P_{t-1}, P_{t-2}),    f: ten tanh neurons, 61 parameters

Before the first sample, current and pressure have their first values.

Reference: clutch thesis, (5.1)-(5.5).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data import Dataset
from smid.networks import ProgressCallback, TanhNetwork, delayed, train, weight_count
from smid.sensors.sensor import Run, Samples, VirtualSensor, require_training_data, trained

__all__ = ["CPX"]

DELAYS = (1, 2)


@dataclass(frozen=True, eq=False)
class CPX(VirtualSensor):
    """Current and pressure to position.

    Parameters
    ----------
    hidden
        Neurons of each hidden layer.
    network
        From mA and bar to mm; None before training.
    sampling_time
        Of the training records, in seconds.

    Examples
    --------
    >>> from smid.data.bundled import load_clutch
    >>> data = load_clutch("20C_step_a")
    >>> sensor = CPX(hidden=(4,)).fit(data, seed=1, starts=1)
    >>> sensor.n_parameters, sensor.predict(data).mse(data) < 0.02
    (25, True)
    """

    hidden: tuple[int, ...] = (10,)
    network: TanhNetwork | None = None
    sampling_time: float | None = None

    @property
    def channels(self) -> tuple[str, ...]:
        """Current and pressure."""
        return ("current", "pressure")

    @property
    def n_parameters(self) -> int:
        """Number of weights and biases."""
        return weight_count((len(DELAYS) * len(self.channels), *self.hidden))

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
            np.concatenate([_delay_line(run.values) for run in data.experiments]),
            data.stacked("position"),
            hidden=self.hidden,
            seed=seed,
            starts=starts,
            progress=progress,
        )
        return replace(self, network=training.network, sampling_time=data.sampling_time)

    def run(self) -> Run:
        """Return the sensor at rest; see `VirtualSensor.run`."""
        return _Run(trained(self.network, self))


def _delay_line(samples: Samples) -> Array:
    return delayed([samples["current"], samples["pressure"]], [DELAYS, DELAYS])


class _Run:
    def __init__(self, network: TanhNetwork) -> None:
        self._network = network
        self._past: dict[str, Array] | None = None

    def advance(self, samples: Samples) -> Array:
        names = ("current", "pressure")
        past = self._past or {name: np.repeat(samples[name][:1], max(DELAYS)) for name in names}
        joined = {name: np.concatenate([past[name], samples[name]]) for name in names}
        self._past = {name: joined[name][-max(DELAYS) :] for name in names}
        return self._network(_delay_line(joined)[max(DELAYS) :])
