"""What PTX knows of time, friction and temperature: a smoothed pressure, play operators, and what schedules them.

    s = lag of P, with the time constant tau_s                          less noise
    g_k = where s is within the slack of play k, in [-1, 1]             hysteresis
    q = exp(c_1 (T - 20)) (s - sum_k w_k g_k) + c_2 (T - 20)            what acts, as if it were 20 degC
    tau(T) = tau_20 exp(-c_3 (T - 20))                                  oil is slower when cold

Pressure less a sum of plays of positive forces is the operator of Prandtl and Ishlinskii.  At the start of a record
there is rest: the first pressure and position have stood for long, and s is amid every slack.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from smid.networks import Array
from smid.sensors.lag import lag
from smid.sensors.play import Play, play

__all__ = ["REFERENCE", "Dynamics", "Memory"]

REFERENCE = 20.0  # degC


@dataclass(frozen=True)
class Memory:
    """What is kept between blocks of samples.

    Parameters
    ----------
    smoothed
        Smoothed pressure, in bar.
    pushed
        Where the part that each play pushes is, in bar.
    """

    smoothed: float
    pushed: tuple[float, ...]


@dataclass(frozen=True)
class Dynamics:
    """The numbers of a PTX outside its network.

    Parameters
    ----------
    smoothing
        Time constant of the pressure, in seconds.
    lag
        Time constant of the position at 20 degC, in seconds.
    lag_slope
        By which share the lag falls per degC, in 1/degC.
    gain_slope
        By which share the pressure counts more per degC, in 1/degC.
    shift_slope
        What is added to the pressure per degC, in bar/degC.
    thresholds
        Of the plays, in bar.
    forces
        By what each play lowers the pressure that acts where it is pushed up, in bar.
    """

    smoothing: float
    lag: float
    lag_slope: float
    gain_slope: float
    shift_slope: float
    thresholds: tuple[float, ...]
    forces: tuple[float, ...]

    def rest(self, pressure: float) -> Memory:
        """Return the memory of a plant that has stood at a pressure."""
        return Memory(pressure, (pressure,) * len(self.thresholds))

    def smooth(self, pressure: Array, memory: Memory, sampling_time: float) -> Array:
        """Return the smoothed pressure, shape (n,) in bar."""
        decay = np.full(pressure.size, self.smoothing_decay(sampling_time))
        return lag(pressure, decay, memory.smoothed)

    def push(self, smoothed: Array, memory: Memory) -> list[Play]:
        """Return what each play does with the smoothed pressure."""
        return [play(smoothed, r, before) for r, before in zip(self.thresholds, memory.pushed, strict=True)]

    def acting(self, smoothed: Array, states: list[Array], temperature: Array) -> Array:
        """Return the pressure that would do the same at 20 degC and without friction, shape (n,) in bar."""
        friction = sum((w * g for w, g in zip(self.forces, states, strict=True)), np.zeros(smoothed.size))
        return self.gain(temperature) * (smoothed - friction) + self.shift_slope * (temperature - REFERENCE)

    def states(self, smoothed: Array, plays: list[Play]) -> list[Array]:
        """Return where the pressure is within the slack of each play, from -1 to 1."""
        return [(smoothed - p.position) / r for p, r in zip(plays, self.thresholds, strict=True)]

    def gain(self, temperature: Array) -> Array:
        """Return by what the pressure is multiplied at each temperature."""
        return np.asarray(np.exp(self.gain_slope * (temperature - REFERENCE)))

    def smoothing_decay(self, sampling_time: float) -> float:
        """Return the pole of the smoothing."""
        return float(np.exp(-sampling_time / self.smoothing))

    def lag_decay(self, temperature: Array, sampling_time: float) -> Array:
        """Return the pole of the lag at each temperature."""
        tau = self.lag * np.exp(-self.lag_slope * (temperature - REFERENCE))
        return np.asarray(np.exp(-sampling_time / tau))
