"""The dynamic part of PTX: smoothed pressure, play operators, and the effect of the temperature.

    s = lag of P, with the time constant tau_s                          less noise
    g_k = place of s within the slack of play k, in [-1, 1]             hysteresis
    q = exp(c_1 (T - 20)) (s - sum_k w_k g_k) + c_2 (T - 20)            pressure with the same effect at 20 degC
    tau(T) = tau_20 exp(-c_3 (T - 20))                                  slower oil when cold

A pressure minus a sum of plays of positive forces is a Prandtl-Ishlinskii operator. A record starts at rest: pressure
and position have been constant, and s is in the middle of every slack.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relaxations.algebra.arrays import Array
from smid.sensors.lag import lag
from smid.sensors.play import Play, play

__all__ = ["REFERENCE", "Dynamics", "Memory"]

REFERENCE = 20.0  # degC


@dataclass(frozen=True)
class Memory:
    """The state between blocks of samples, in bar: the smoothed pressure, and the position of each pushed part."""

    smoothed: float
    pushed: tuple[float, ...]


@dataclass(frozen=True)
class Dynamics:
    """The parameters of a PTX outside its network.

    Parameters
    ----------
    smoothing
        Time constant of the pressure, in seconds.
    lag
        Time constant of the position at 20 degC, in seconds.
    lag_slope
        Relative fall of the lag per degC, in 1/degC.
    gain_slope
        Relative rise of the gain per degC, in 1/degC.
    shift_slope
        Shift of the pressure per degC, in bar/degC.
    thresholds
        Of the plays, in bar.
    forces
        Friction of each play while the pressure rises, in bar.
    """

    smoothing: float
    lag: float
    lag_slope: float
    gain_slope: float
    shift_slope: float
    thresholds: tuple[float, ...]
    forces: tuple[float, ...]

    def rest(self, pressure: float) -> Memory:
        """Return the memory of a plant at rest at a pressure."""
        return Memory(pressure, (pressure,) * len(self.thresholds))

    def smooth(self, pressure: Array, memory: Memory, sampling_time: float) -> Array:
        """Return the smoothed pressure, shape (n,) in bar."""
        decay = np.full(pressure.size, self.smoothing_decay(sampling_time))
        return lag(pressure, decay, memory.smoothed)

    def push(self, smoothed: Array, memory: Memory) -> list[Play]:
        """Return the response of each play to the smoothed pressure."""
        return [play(smoothed, r, before) for r, before in zip(self.thresholds, memory.pushed, strict=True)]

    def acting(self, smoothed: Array, states: list[Array], temperature: Array) -> Array:
        """Return the pressure with the same effect at 20 degC and without friction, shape (n,) in bar."""
        friction = sum((w * g for w, g in zip(self.forces, states, strict=True)), np.zeros(smoothed.size))
        return self.gain(temperature) * (smoothed - friction) + self.shift_slope * (temperature - REFERENCE)

    def states(self, smoothed: Array, plays: list[Play]) -> list[Array]:
        """Return the place of the pressure within the slack of each play, from -1 to 1."""
        return [(smoothed - p.position) / r for p, r in zip(plays, self.thresholds, strict=True)]

    def gain(self, temperature: Array) -> Array:
        """Return the factor of the pressure at each temperature."""
        return np.asarray(np.exp(self.gain_slope * (temperature - REFERENCE)))

    def smoothing_decay(self, sampling_time: float) -> float:
        """Return the pole of the smoothing."""
        return float(np.exp(-sampling_time / self.smoothing))

    def lag_decay(self, temperature: Array, sampling_time: float) -> Array:
        """Return the pole of the lag at each temperature."""
        tau = self.lag * np.exp(-self.lag_slope * (temperature - REFERENCE))
        return np.asarray(np.exp(-sampling_time / tau))
