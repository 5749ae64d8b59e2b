"""PTX: the position from pressure and temperature, with hysteresis, by one sensor for all temperatures.

    s = lag of P,    q = gain(T) (s - sum_k w_k g_k) + shift(T),    z = f(q),    x = lag(T) of z

The play operators g_k model friction, gain and shift the effect of the temperature, the network f the static curve, and
the last lag the motion of the piston through the oil, which is faster when warm. With two plays and six neurons there
are 28 parameters; CPX has 61 for each temperature. PTX needs no median filter, so it has no delay.

With temperature and plays as inputs of the network instead, each neuron needs more weights, and the network between the
three trained temperatures is undetermined: the error was three times as large at 0 and 40 degC as at -20, 20 and 60.

All parameters are trained together (`smid.sensors.ptx_training`).

Reference: clutch thesis, section 6.2 (asks for such a sensor); Brokate, Sprekels, "Hysteresis and Phase Transitions"
(1996), for the plays.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data import Dataset
from smid.models import ModelError
from smid.networks import ProgressCallback, TanhNetwork, weight_count
from smid.sensors.lag import lag
from smid.sensors.ptx_dynamics import Dynamics, Memory
from smid.sensors.ptx_training import SCHEDULED, train_ptx
from smid.sensors.sensor import Run, Samples, VirtualSensor, require_training_data, trained

__all__ = ["PTX"]


@dataclass(frozen=True, eq=False)
class PTX(VirtualSensor):
    """Pressure and temperature to position, with memory.

    Parameters
    ----------
    hidden
        Neurons of each hidden layer.
    plays
        Number of play operators.
    dynamics, network
        None before training; the network, from bar to mm, is the static curve at 20 degC.
    temperature_range
        Lowest and highest temperature of the training records, in degC.
    sampling_time
        Of the training records, in seconds.

    Raises
    ------
    ModelError
        If the number of plays is negative.

    Examples
    --------
    >>> PTX().n_parameters, PTX(hidden=(4,), plays=1).n_parameters
    (28, 20)
    """

    hidden: tuple[int, ...] = (6,)
    plays: int = 2
    dynamics: Dynamics | None = None
    network: TanhNetwork | None = None
    temperature_range: tuple[float, float] | None = None
    sampling_time: float | None = None

    def __post_init__(self) -> None:
        if self.plays < 0:
            raise ModelError(f"plays = {self.plays}: give a number of play operators, 0 for no hysteresis")

    @property
    def channels(self) -> tuple[str, ...]:
        """Pressure and temperature."""
        return ("pressure", "temperature")

    @property
    def n_parameters(self) -> int:
        """Two time constants, three slopes, a threshold and a force per play, weights and biases."""
        return SCHEDULED + 2 * self.plays + weight_count((1, *self.hidden))

    def fit(
        self,
        data: Dataset,
        *,
        seed: int | np.random.Generator,
        starts: int = 5,
        progress: ProgressCallback | None = None,
    ) -> Self:
        """Return this sensor, trained on records of two temperatures or more; see `VirtualSensor.fit`."""
        require_training_data(data, self.channels)
        dynamics, network = train_ptx(data, self.hidden, self.plays, seed=seed, starts=starts, progress=progress)
        temperature = data.stacked("temperature")
        return replace(
            self,
            dynamics=dynamics,
            network=network,
            temperature_range=(float(temperature.min()), float(temperature.max())),
            sampling_time=data.sampling_time,
        )

    def run(self) -> Run:
        """Return the sensor at rest; see `VirtualSensor.run`."""
        return _Run(trained(self.dynamics, self), trained(self.network, self), trained(self.sampling_time, self))

    def cautions(self, samples: Samples) -> tuple[str, ...]:
        """Return a warning where the temperature is outside the range of the training."""
        low, high = trained(self.temperature_range, self)
        coldest, warmest = float(samples["temperature"].min()), float(samples["temperature"].max())
        if low <= coldest and warmest <= high:
            return ()
        reached = f"{coldest:g}" if coldest == warmest else f"{coldest:g} to {warmest:g}"
        return (f"temperature {reached} degC, but the sensor was trained from {low:g} to {high:g} degC: extrapolated",)


class _Run:
    def __init__(self, dynamics: Dynamics, network: TanhNetwork, sampling_time: float) -> None:
        self._dynamics, self._network, self._interval = dynamics, network, sampling_time
        self._memory: Memory | None = None
        self._position: float | None = None

    def advance(self, samples: Samples) -> Array:
        pressure, temperature = samples["pressure"], samples["temperature"]
        memory = self._memory or self._dynamics.rest(float(pressure[0]))
        smoothed = self._dynamics.smooth(pressure, memory, self._interval)
        plays = self._dynamics.push(smoothed, memory)
        states = self._dynamics.states(smoothed, plays)
        target = self._network(self._dynamics.acting(smoothed, states, temperature)[:, None])
        before = float(target[0]) if self._position is None else self._position
        position = lag(target, self._dynamics.lag_decay(temperature, self._interval), before)
        self._memory = Memory(float(smoothed[-1]), tuple(float(p.position[-1]) for p in plays))
        self._position = float(position[-1])
        return position
