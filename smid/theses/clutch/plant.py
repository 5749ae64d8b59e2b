"""A simulated dual clutch actuator, from current to pressure, with effects that a Hammerstein model does not have.

    e     = u - z,   d e = d u - |d u| e / lag                rate-independent hysteresis of the current
    x     = gain(T) N(0.01 z)                                 static curve with a dead zone
    d p/dt = (x - p) / tau(p, x, T)                           one pole that depends on the operating point
    y     = p + eta,   |eta| <= 0.3 bar

Hysteresis (`smid.theses.clutch.hysteresis`): the width is one lag, so z overshoots a little where the current turns.
The current is linear between samples for the hysteresis. The static curve and the pole use z held between samples, as
in the thesis's model.

Pole: ``tau = f(T) d(x - p) (fast + (slow - fast) exp(-p / p0))``. It is slow at low pressure, where springs and slack
take the oil, and slower by a factor d when filling. Integration steps of 0.1 ms are exact for a constant tau.

From the thesis: the curve N (3.5); the pole -0.65142 at 2 ms (central estimate of section 3.2, ramps at 20 degC), which
is ``fast``; the pole 0.9562 of the steps (3.22), which is ``slow``; the units, 2 ms, three temperatures; and that gain
and pole vary with the input's range (section 3.2.4).

Our assumptions, not fitted to data: shapes and sizes of hysteresis (20 mA), level (3 bar) and direction (1.6); N held
at zero where the polynomial is negative, and at its maximum beyond it; viscosity and leakage as in ``data/README.md``;
uniform noise within 0.3 bar; the profiles of the current.

Reference: clutch thesis, sections 3.1 and 3.2.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from relaxations.algebra.arrays import Array
from smid.data import Channel, DataError, Dataset, Experiment
from smid.signals import ramp, step
from smid.theses.clutch.hysteresis import trailing
from smid.theses.series import finite_series

__all__ = ["ClutchPlant", "clutch_record", "ramp_current", "simulate_clutch", "step_current"]

SAMPLING_TIME = 2e-3  # s
INPUT_SCALE = 0.01  # 1/mA
CURVE = (-0.00272, 0.03903, -0.08172, 0.0, 0.0, 0.0)  # bar, highest power first
FAST = -SAMPLING_TIME / math.log(0.65142)  # s
SLOW = -SAMPLING_TIME / math.log(0.9562)  # s
NOISE_BOUND = 0.3  # bar
TEMPERATURES = (20.0, 60.0, -20.0)  # degC

LAG = 20.0  # mA
LEVEL = 3.0  # bar
FILLING = 1.6
SUBSTEP = 1e-4  # s


@dataclass(frozen=True)
class ClutchPlant:
    """The effects that the actuator has; without any it is the thesis's Hammerstein model.

    Parameters
    ----------
    level
        The pole depends on the pressure; else it is the fast one.
    direction
        Filling is slower than emptying.
    hysteresis
        The current acts with hysteresis.
    temperature
        Viscosity and leakage vary with temperature; else they are those of 20 degC.

    Examples
    --------
    >>> steady = simulate_clutch([500.0] * 400, plant=ClutchPlant(hysteresis=False))[-1]
    >>> bool(simulate_clutch([500.0] * 400, 60.0, ClutchPlant(hysteresis=False))[-1] < steady)  # hot oil leaks
    True
    """

    level: bool = True
    direction: bool = True
    hysteresis: bool = True
    temperature: bool = True


def oil_resistance(warmth: float) -> float:
    """Return the hydraulic resistance at `warmth` degC above 20 degC, relative to that at 20 degC."""
    return 0.8 + 0.2 * math.exp(-warmth / 25.0)


def simulate_clutch(
    current: ArrayLike,
    temperature: float = 20.0,
    plant: ClutchPlant | None = None,
    sampling_time: float = SAMPLING_TIME,
) -> Array:
    """Return the pressure of the actuator in bar, without noise, from rest, shape (n,).

    Parameters
    ----------
    current
        Shape (n,). In mA.
    temperature
        Of the oil, in degC.
    plant
        By default with all effects.
    sampling_time
        In seconds.

    Raises
    ------
    DataError
        If the current is not a finite series, or the sampling time is not positive.

    Examples
    --------
    >>> simulate_clutch([0.0, 800.0, 800.0], plant=ClutchPlant(False, False, False, False)).round(3)
    array([ 0.   ,  0.   , 10.073])
    """
    plant = ClutchPlant() if plant is None else plant
    u = finite_series(current, sampling_time, "current", "mA")
    # The sizes of the effects that are switched on.
    warmth = temperature - 20.0 if plant.temperature else 0.0
    friction = oil_resistance(warmth)
    targets = (1.0 - 0.0005 * warmth) * _curve(trailing(u, LAG, LAG) if plant.hysteresis else u)
    slow = SLOW if plant.level else FAST
    filling = FILLING if plant.direction else 1.0
    substeps = max(1, round(sampling_time / SUBSTEP))
    # Integrate in substeps with a constant time constant.
    pressure, h = 0.0, sampling_time / substeps
    result = [pressure]
    for target in targets[:-1].tolist():
        for _ in range(substeps):
            tau = friction * (FAST + (slow - FAST) * math.exp(-max(pressure, 0.0) / LEVEL))
            tau *= filling if target > pressure else 1.0
            pressure = target + (pressure - target) * math.exp(-h / tau)
        result.append(pressure)
    return np.array(result)


def _curve(current: Array) -> Array:
    """Return the static curve: zero in the dead zone, constant above the polynomial's maximum near 970 mA."""
    derivative = np.polyder(np.array(CURVE))
    top = float(np.roots(derivative).real.max())
    scaled = np.clip(INPUT_SCALE * current, 0.0, top)
    return np.asarray(np.maximum(0.0, np.polyval(CURVE, scaled)))


def ramp_current(n: int = 600, scale: float = 1.0) -> Array:
    """Return a current in mA that ramps up and down between 0 and 900 mA, every 2 ms, shape (n,).

    Raises
    ------
    DataError
        If n is not a number of samples.

    Examples
    --------
    >>> round(float(ramp_current().max()), 6)
    900.0
    """
    corners = [(0.02, 0.0), (0.22, 1.0), (0.37, 0.2), (0.45, 0.9), (0.5, 0.3), (0.75, 1.0), (0.8, 0.0), (0.9, 0.95)]
    return ramp(n, corners=[*corners, (1.15, 0.0)], sampling_time=SAMPLING_TIME, amplitude=900.0 * scale)


def step_current(n: int = 600, scale: float = 1.0) -> Array:
    """Return a current in mA of steps between 0 and 900 mA, every 2 ms, shape (n,).

    Raises
    ------
    DataError
        If n is not a number of samples.

    Examples
    --------
    >>> sorted(set(step_current().round(6).tolist()))
    [0.0, 400.0, 500.0, 600.0, 700.0, 900.0]
    """
    levels = [(0.05, 400.0), (0.2, 600.0), (0.35, 900.0), (0.5, 700.0), (0.65, 500.0), (0.8, 900.0), (0.95, 400.0)]
    return step(n, levels=[*levels, (1.1, 0.0)], sampling_time=SAMPLING_TIME, amplitude=scale)


def clutch_record(
    kind: str = "step",
    temperatures: Sequence[float] = TEMPERATURES,
    *,
    seed: int | np.random.Generator,
    n: int = 600,
    scale: float = 1.0,
    plant: ClutchPlant | None = None,
    noise_bound: float = NOISE_BOUND,
) -> Dataset:
    """Simulate measured records of current (mA), pressure (bar) and temperature (degC), one per temperature.

    Parameters
    ----------
    kind
        Profile of the current: "ramp" or "step".
    temperatures
        Of the oil, in degC.
    n
        Samples per record.
    scale
        Factor of the current, for a second record.
    plant
        By default with all effects.
    noise_bound
        Largest noise of the pressure, in bar; uniform.

    Raises
    ------
    DataError
        If the kind is unknown, a temperature occurs twice or the noise bound is negative.

    Examples
    --------
    >>> data = clutch_record("ramp", seed=1)
    >>> [run.name for run in data.experiments], data.names
    (['20C_ramp', '60C_ramp', '-20C_ramp'], ('current', 'pressure', 'temperature'))
    """
    profiles = {"ramp": ramp_current, "step": step_current}
    if kind not in profiles:
        raise DataError(f"kind = {kind!r} is no profile of the current: choose 'ramp' or 'step'")
    if not noise_bound >= 0:
        raise DataError(f"noise_bound = {noise_bound} is refused: give a number of bar, zero for none")
    current = profiles[kind](n, scale)
    generator = np.random.default_rng(seed)
    runs = []
    for temperature in temperatures:
        noise = generator.uniform(-noise_bound, noise_bound, n)
        values = {
            "current": current,
            "pressure": simulate_clutch(current, temperature, plant) + noise,
            "temperature": np.full(n, float(temperature)),
        }
        runs.append(Experiment(f"{temperature:g}C_{kind}", values))
    units = (("current", "mA"), ("pressure", "bar"), ("temperature", "degC"))
    return Dataset(
        experiments=tuple(runs),
        channels=tuple(Channel(name, unit) for name, unit in units),
        inputs=("current",),
        outputs=("pressure",),
        sampling_time=SAMPLING_TIME,
        source="simulated clutch actuator",
    )
