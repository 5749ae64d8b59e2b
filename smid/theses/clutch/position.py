"""The position of the clutch: the pressure moves a piston against dry friction and springs.

    q = p - f,   d f = (friction d p - f |d p|) / (2 friction)          dry friction, rate-independent (Dahl)
    s(T) = 1 - softening (T - 20)                                       the spring is softer when warm
    q / s = preload + stiffness x + cushion max(0, x - kiss)^2          return spring, then also the cushion spring
    d x/dt = (x_static - x) / (lag r(T))                                oil is displaced, slower when cold

The K2 clutch is normally open. Up to the preload nothing moves: the dead zone from pressure to position. The return
spring yields until the facings touch at the kiss point; from there the cushion spring becomes stiffer as it is
pressed. Friction holds the piston where the pressure turns: on the way back the position is that of a pressure higher
by twice the friction. The position at a pressure therefore depends on the past, not on speed. A static virtual sensor
trained on rising pressures has large errors on falling ramps, as in figure 5.25.

From the thesis (sections 5.1 and 5.2): three dead zones, and a position that depends on temperature and has
hysteresis. It prints no sizes. Our assumptions, not fitted to data:

- Springs: 2.5 bar, 1 bar/mm, 5 mm, 2 bar/mm^2. They give 8.6 mm at the largest pressure of 37 bar, about the travel
  of a release bearing. On a piston of 12 cm^2, 1 bar is 120 N.
- Friction: 0.8 bar, so that the loop is 1.6 bar wide, 4 % of the range.
- Softening: 0.3 % per degC. Spring steel alone loses 0.03 %. A cushion spring warped by heat loses more (Cappetti),
  and seals become stiffer in the cold. This number includes all of them.
- Lag: 4 ms at 20 degC, times the oil's resistance r(T) of `smid.theses.clutch.plant`.
- Noise of the sensor: uniform within 0.05 mm.

Reference: clutch thesis, section 5.1, figures 5.14 and 5.25; Dahl, "A solid friction model", Aerospace Corporation
(1968); Cappetti, Pisaturo, Senatore, "Cushion spring sensitivity to the temperature rise in automotive dry clutch and
effects on the frictional torque characteristic", Mechanical Testing and Diagnosis 3 (2012).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike
from scipy.signal import lfilter

from relaxations.algebra.arrays import Array
from smid.data import DataError
from smid.theses.clutch.hysteresis import trailing
from smid.theses.clutch.plant import SAMPLING_TIME, oil_resistance
from smid.theses.series import finite_series

__all__ = ["POSITION_NOISE_BOUND", "ReturnSpring", "simulate_position"]

POSITION_NOISE_BOUND = 0.05  # mm


@dataclass(frozen=True)
class ReturnSpring:
    """The springs and the friction that act on the piston, in bar of pressure.

    Parameters
    ----------
    preload
        Pressure up to which nothing moves at 20 degC, in bar; larger than the friction.
    stiffness
        Of the return spring at 20 degC, in bar/mm.
    kiss_point
        Position where the facings touch, in mm.
    cushion
        Of the cushion spring at 20 degC, in bar/mm^2.
    softening
        Relative loss of preload, stiffness and cushion per degC above 20, in 1/degC.
    friction
        Dry friction, in bar.
    lag
        Time constant at 20 degC, in seconds.

    Raises
    ------
    DataError
        If a number is negative or not finite, the stiffness, cushion or lag is zero, or the preload does not exceed
        the friction.

    Examples
    --------
    >>> ReturnSpring().static_position([2.0, 7.5, 35.0]).round(3)
    array([0.   , 5.   , 8.467])
    """

    preload: float = 2.5
    stiffness: float = 1.0
    kiss_point: float = 5.0
    cushion: float = 2.0
    softening: float = 0.003
    friction: float = 0.8
    lag: float = 4e-3

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not (math.isfinite(value) and value >= 0):
                raise DataError(f"{field.name} = {value} is refused: give a number of at least 0")
            if value == 0 and field.name in ("stiffness", "cushion", "lag"):
                raise DataError(f"{field.name} = 0 is refused: give a positive number, as small as you like")
        if not self.preload > self.friction:
            raise DataError(
                f"preload = {self.preload} bar does not exceed friction = {self.friction} bar: the piston would never "
                "come back; give a larger preload"
            )

    def static_position(self, pressure: ArrayLike, temperature: float = 20.0) -> Array:
        """Return the position at rest in mm for pressures in bar, friction subtracted, shape (n,).

        Raises
        ------
        DataError
            If the temperature is not finite, or so high that no stiffness remains.
        """
        share = 1.0 - self.softening * (temperature - 20.0)
        if not (math.isfinite(temperature) and share > 0):
            raise DataError(f"temperature = {temperature} degC leaves no spring: give degC, around -20 to 60")
        load = np.maximum(0.0, np.asarray(pressure, dtype=np.float64) / share - self.preload)
        pressed = np.maximum(0.0, load - self.stiffness * self.kiss_point)
        compression = (np.sqrt(self.stiffness**2 + 4.0 * self.cushion * pressed) - self.stiffness) / (
            2.0 * self.cushion
        )
        return np.asarray(np.minimum(load / self.stiffness, self.kiss_point) + compression)


def simulate_position(
    pressure: ArrayLike,
    temperature: float = 20.0,
    spring: ReturnSpring | None = None,
    sampling_time: float = SAMPLING_TIME,
) -> Array:
    """Return the position of the clutch in mm, without noise, from rest at the first pressure, shape (n,).

    Parameters
    ----------
    pressure
        Shape (n,). In bar, without noise; held between samples.
    temperature
        Of oil and spring, in degC.
    spring
        By default that of the bundled records.
    sampling_time
        In seconds.

    Raises
    ------
    DataError
        If the pressure is not a finite series, the sampling time is not positive, or the temperature is not valid.

    Examples
    --------
    >>> simulate_position(np.repeat([0.0, 2.0, 6.0, 35.0], 50))[[49, 99, 149, 199]].round(2)
    array([0.  , 0.  , 2.72, 8.41])
    """
    spring = ReturnSpring() if spring is None else spring
    p = finite_series(pressure, sampling_time, "pressure", "bar")
    target = spring.static_position(trailing(p, spring.friction, 2.0 * spring.friction), temperature)
    decay = math.exp(-sampling_time / (spring.lag * oil_resistance(temperature - 20.0)))
    position, _ = lfilter([0.0, 1.0 - decay], [1.0, -decay], target, zi=target[:1])
    return np.asarray(position)
