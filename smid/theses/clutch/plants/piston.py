"""The piston of the foreign plants: a diaphragm spring, and oil that resists in proportion to speed and to its square.

    load(x, T) = (preload + k_1 x - k_2 x^2 + k_3 x^3) / (1 + softening (T - 20)) + expansion (T - 20)
    r_1(T) v + r_2 v |v| = q - load(x, T),    x >= 0,    dx/dt = v

The load of a diaphragm spring is a cubic polynomial of its deflection; here it rises everywhere. q is the pressure less
the friction. Nothing moves up to the preload. The viscosity of the oil follows Vogel's law. All numbers are our
assumptions; the travel at 37 bar is about 10 mm.

Reference: Almen, Laszlo, "The uniform-section disk spring", Trans. ASME 58 (1936); Vogel, "Das
Temperaturabhaengigkeitsgesetz der Viskositaet von Fluessigkeiten", Physikalische Zeitschrift 22 (1921).
"""

from __future__ import annotations

import math

import numpy as np

from relaxations.algebra.arrays import Array

__all__ = ["Piston"]

PRELOAD = 2.5  # bar
LOAD = (2.2, -0.42, 0.055)  # bar/mm, bar/mm^2, bar/mm^3
SOFTENING = 0.0025  # 1/degC
EXPANSION = 0.004  # bar/degC
RESISTANCE = 3e-3  # bar s/mm, at 20 degC
TURBULENCE = 1e-5  # bar s^2/mm^2
LAMINAR = 0.4  # share of the resistance that is proportional to the viscosity


class Piston:
    """The piston at one temperature, in degC."""

    def __init__(self, temperature: float) -> None:
        warmth = temperature - 20.0
        self.share = 1.0 / (1.0 + SOFTENING * warmth)
        self.shift = EXPANSION * warmth
        self.resistance = RESISTANCE * (1.0 - LAMINAR + LAMINAR * viscosity(temperature))

    def load(self, position: float) -> float:
        """Return the pressure in bar that holds a position in mm."""
        k1, k2, k3 = LOAD
        return self.share * (PRELOAD + position * (k1 + position * (k2 + position * k3))) + self.shift

    def stiffness(self, position: float) -> float:
        """Return the slope of the load in bar/mm."""
        k1, k2, k3 = LOAD
        return self.share * (k1 + position * (2.0 * k2 + position * 3.0 * k3))

    def speed(self, excess: float, resistance: float) -> float:
        """Return the speed in mm/s that takes an excess pressure in bar."""
        root = math.sqrt(resistance**2 + 4.0 * TURBULENCE * abs(excess))
        return 2.0 * excess / (resistance + root)

    def step(self, position: float, excess: float, stiffness: float, interval: float) -> float:
        """Return the position after an interval in s, by a linearly implicit step."""
        v = self.speed(excess, self.resistance)
        damping = self.resistance + 2.0 * TURBULENCE * abs(v)
        return max(0.0, position + interval * v / (1.0 + interval * stiffness / damping))

    def moved(self, pressure: Array, interval: float) -> Array:
        """Return the positions in mm, shape (n,), under pressures in bar every interval in s, from rest."""
        x = self.at_rest(float(pressure[0]))
        result = [x]
        for q in pressure[:-1].tolist():
            x = self.step(x, q - self.load(x), self.stiffness(x), interval)
            result.append(x)
        return np.array(result)

    def at_rest(self, pressure: float) -> float:
        """Return the position that a pressure holds, by bisection."""
        low, high = 0.0, 50.0
        if self.load(low) >= pressure:
            return low
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self.load(middle) < pressure else (low, middle)
        return low


def viscosity(temperature: float) -> float:
    """Return the viscosity of the oil relative to that at 20 degC: 10.9 at -20 degC, 0.28 at 60 degC."""
    return math.exp(700.0 / (temperature + 110.0) - 700.0 / 130.0)
