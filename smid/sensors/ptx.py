"""PTX: the position from pressure and temperature, with hysteresis, by one sensor for all temperatures.

    s = lag of P,    q = gain(T) (s - sum_k w_k g_k) + shift(T),    z = f(q),    x = lag(T) of z

The play operators g_k model friction, gain and shift the effect of the temperature, the network f the static curve, and
the last lag the motion of the piston through the oil, which is faster when warm. With two plays and six neurons there
are 28 parameters; CPX has 61 for each temperature. PTX needs no median filter, so it has no delay.

With temperature and plays as inputs of the network instead, each neuron needs more weights, and the network between the
three trained temperatures is undetermined: the error was three times as large at 0 and 40 degC as at -20, 20 and 60.

Further effects can be added: friction that depends on temperature, level and rate, a flow, backlash
(`smid.sensors.ptx_dynamics`). `smid.sensors.ptx_selection` keeps those that lower the error on other samples.

All parameters are trained together (`smid.sensors.ptx_error`).

Reference: clutch thesis, section 6.2 (asks for such a sensor); Brokate, Sprekels, "Hysteresis and Phase Transitions"
(1996), for the plays.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from smid.data import Dataset
from smid.data.channel import name_hint
from smid.models import ModelError
from smid.networks import ProgressCallback, TanhNetwork, weight_count
from smid.sensors.program import Program
from smid.sensors.ptx_dynamics import EFFECTS, Dynamics
from smid.sensors.ptx_error import SCHEDULED, STARTS
from smid.sensors.ptx_training import extend_ptx, train_ptx
from smid.sensors.sensor import VirtualSensor, require_training_data, trained
from smid.sensors.trained_on import TrainedOn

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
    pressure, output
        Names of the channels.
    temperature
        Name of a channel; None for a sensor without temperature, which has three parameters fewer.
    effects
        Further effects, among `EFFECTS` (`smid.sensors.ptx_dynamics`).
    dynamics, network
        None before training; the network is the static curve at the middle of the trained temperatures.

    Raises
    ------
    ModelError
        If the number of plays is negative, or an effect is unknown or needs a temperature.

    Examples
    --------
    >>> PTX().n_parameters, PTX(hidden=(4,), plays=1).n_parameters
    (28, 20)
    """

    hidden: tuple[int, ...] = (6,)
    plays: int = 2
    pressure: str = "pressure"
    temperature: str | None = "temperature"
    output: str = "position"
    effects: tuple[str, ...] = ()
    dynamics: Dynamics | None = None
    network: TanhNetwork | None = None
    trained_on: TrainedOn | None = None

    def __post_init__(self) -> None:
        if self.plays < 0:
            raise ModelError(f"plays = {self.plays}: give a number of play operators, 0 for no hysteresis")
        for effect in self.effects:
            if effect not in EFFECTS:
                raise ModelError(f"no effect {effect!r}; {name_hint(effect, EFFECTS)}")
        if "temperature" in self.effects and self.temperature is None:
            raise ModelError("friction cannot depend on a temperature that the sensor does not read: give its channel")

    @property
    def channels(self) -> tuple[str, ...]:
        """The pressure, and the temperature if there is one."""
        return (self.pressure,) if self.temperature is None else (self.pressure, self.temperature)

    @property
    def n_parameters(self) -> int:
        """Two time constants, three slopes, a threshold and a force per play, weights and biases."""
        scheduled = SCHEDULED - 3 * (self.temperature is None)
        scheduled += sum(len(STARTS[effect]) for effect in self.effects)
        scheduled -= 2 * ("flow" in self.effects and self.temperature is None)
        return scheduled + 2 * self.plays + weight_count((1, *self.hidden))

    def fit(
        self,
        data: Dataset,
        *,
        seed: int | np.random.Generator,
        starts: int = 5,
        progress: ProgressCallback | None = None,
    ) -> Self:
        """Return this sensor, trained on records of two temperatures or more; see `VirtualSensor.fit`."""
        require_training_data(data, self.channels, self.output)
        dynamics, network = train_ptx(
            data,
            self.channels,
            self.output,
            self.hidden,
            self.plays,
            self.effects,
            seed=seed,
            starts=starts,
            progress=progress,
        )
        told = TrainedOn.of(data, self.channels, self.output)
        return replace(self, dynamics=dynamics, network=network, trained_on=told)

    def program(self) -> Program:
        """Return lag, plays, curve and lag, and the effects; see `VirtualSensor.program`."""
        dynamics, interval = trained(self.dynamics, self), trained(self.trained_on, self).sampling_time
        return dynamics.program(trained(self.network, self), interval, self.pressure, self.temperature)

    def extended(
        self,
        data: Dataset,
        effect: str | None = None,
        *,
        seed: int | np.random.Generator,
        progress: ProgressCallback | None = None,
    ) -> Self:
        """Return this sensor, trained on from its present parameters, with a further effect.

        Parameters
        ----------
        data
            Records with the sensor's channels and its output.
        effect
            Among `EFFECTS`; None to train with the present ones.

        Raises
        ------
        ModelError
            If the effect is unknown or needs a temperature that the sensor does not read, or the sensor is not trained.
        """
        effects = tuple(name for name in EFFECTS if name in {*self.effects, effect})
        longer = replace(self, effects=effects if effect is None or effect in EFFECTS else (*effects, effect))
        dynamics, network = extend_ptx(
            data,
            self.channels,
            self.output,
            trained(self.dynamics, self),
            trained(self.network, self),
            longer.effects,
            seed=seed,
            progress=progress,
        )
        told = TrainedOn.of(data, self.channels, self.output)
        return replace(longer, dynamics=dynamics, network=network, trained_on=told)
