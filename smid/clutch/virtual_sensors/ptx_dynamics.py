"""What PTX remembers: a smoothed pressure, play operators, and a lag that depends on the temperature.

    s_t = lag of P with the time constant tau_s                        less noise
    g_k = where s is within the slack of play k, in [-1, 1]            hysteresis
    tau(T) = tau_20 exp(-c (T - 20))                                   oil is slower when cold

The state of a record's start is rest: the first pressure and position have stood for long, s is amid every slack.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from smid.clutch.virtual_sensors.lag import lag
from smid.clutch.virtual_sensors.play import Play, play
from smid.networks import Array

__all__ = ["Dynamics", "Memory"]

REFERENCE = 20.0  # degC


@dataclass(frozen=True)
class Memory:
    """What is kept between blocks of samples.

    Parameters
    ----------
    smoothed : float
        Smoothed pressure, in bar.
    pushed : tuple of float
        Where the part that each play pushes is, in bar.
    """

    smoothed: float
    pushed: tuple[float, ...]


@dataclass(frozen=True)
class Dynamics:
    """The time constants and thresholds of a PTX.

    Parameters
    ----------
    smoothing : float
        Time constant of the pressure, in seconds.
    lag : float
        Time constant of the position at 20 degC, in seconds.
    slope : float
        By which share the lag falls per degC, in 1/degC.
    thresholds : tuple of float
        Of the plays, in bar.
    """

    smoothing: float
    lag: float
    slope: float
    thresholds: tuple[float, ...]

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

    def inputs(self, smoothed: Array, plays: list[Play], temperature: Array) -> Array:
        """Return what the network reads: smoothed pressure in bar, states in [-1, 1], temperature in degC."""
        states = [(smoothed - p.position) / r for p, r in zip(plays, self.thresholds, strict=True)]
        return np.stack([smoothed, *states, temperature], axis=1)

    def smoothing_decay(self, sampling_time: float) -> float:
        """Return the pole of the smoothing."""
        return float(np.exp(-sampling_time / self.smoothing))

    def lag_decay(self, temperature: Array, sampling_time: float) -> Array:
        """Return the pole of the lag at each temperature."""
        tau = self.lag * np.exp(-self.slope * (temperature - REFERENCE))
        return np.asarray(np.exp(-sampling_time / tau))
