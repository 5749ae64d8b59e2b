"""PTX: one sensor for every temperature, with hysteresis: from pressure and temperature to position.

    s = lag of P,    q = gain(T) (s - sum_k w_k g_k) + shift(T),    z = f(q),    x = lag(T) of z

Friction takes its share of the pressure, by play operators g_k; the temperature schedules what is left, by a gain and a
shift; the network f is the static curve; and a lag follows, the piston's way through the oil, shorter when warm.  With
two plays and six neurons it has 28 parameters, CPX has 61 for each temperature.  It needs no median filter, hence no
delay.

Temperature and plays might be inputs of the network instead.  That costs a weight for each neuron, and records of three
temperatures leave open what a network does between them: trained like this one, it erred three times as much at 0 and
40 degC as at -20, 20 and 60.

All are trained together (`smid.sensors.ptx_training`).

Reference: clutch thesis, section 6.2, asks for it; Brokate, Sprekels, "Hysteresis and Phase Transitions" (1996), for
the plays.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from smid.data import Dataset
from smid.models import ModelError
from smid.networks import Array, ProgressCallback, TanhNetwork, weight_count
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
        How many play operators.
    dynamics
        What training found: time constants, schedules, thresholds and forces.
    network
        What training found, from bar to mm: the static curve at 20 degC.
    temperature_range
        Lowest and highest temperature of the records that trained it, in degC.
    sampling_time
        Of the records that trained it, in seconds.

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
        """Say where the temperature is outside the range of the training."""
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
