"""The reactor before its simplifications: balances of mass, component and energy.

    d/dt V = F - Fo,                       Fo = F0 sqrt(V / V0)
    d/dt c = F/V (u - c) - r(T) c,         r(T) = r0 exp(-E/R (1/T - 1/T0))
    d/dt T = F/V (T0 - T) + h r(T) c - k (T - T0)

u is the inflow's concentration, F its flow, h the heat of reaction divided by the heat capacity of the volume, k the
cooling. The density is constant, and kinetic and potential energy are neglected. Cold, at rest and with flow F0 it is
the thesis's reactor with ``F0/V0 + r0 = 1/tau``, tau = 2 s.

The thesis prints the balances (5.1)-(5.3) and simplifies them at once to (5.6). The outflow by the level, E, h and k
are ours. The rate of reaction then rises threefold over the thesis's range of inputs.

Reference: hybrid thesis, section 5.2, (5.1)-(5.6).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
import sympy
from numpy.typing import ArrayLike
from scipy.integrate import solve_ivp

from relaxations.algebra.arrays import Array
from smid.data import DataError
from smid.models import Line, Measurement, Model, Parameter, signal, t
from smid.models.reactor import REACTION_RATE

__all__ = ["FULL_REACTOR", "full_reactor", "simulate_full_reactor"]

_TAU = 2.0

FULL_REACTOR: Mapping[str, tuple[float, str]] = MappingProxyType(
    {
        "V0": (1.0, "m3"),
        "F0": (1.0 / _TAU - REACTION_RATE, "m3/s"),
        "r0": (REACTION_RATE, "1/s"),
        "T0": (300.0, "K"),
        "E": (8000.0, "K"),
        "h": (40.0, "K m3/mol"),
        "k": (0.1, "1/s"),
    }
)
"""Value and unit of each constant; E stands for E/R."""


def full_reactor(*, input: str = "u", flow: str = "F", output: str = "y") -> Model:
    """Return the balances as a model with fixed constants, signals ``V``, ``c`` and ``T``, and noise ``eta``.

    Parameters
    ----------
    input, flow, output
        Channels: concentration of the inflow, its flow in m3/s, and concentration of the outflow.

    Examples
    --------
    >>> print(full_reactor().lines[0])
    d/dt V[t] = -F0*sqrt(V[t]/V0) + F[t]
    """
    parameters = {name: Parameter(name, value, value, unit) for name, (value, unit) in FULL_REACTOR.items()}
    v0, f0, r0, t0, e, h, k = (item.symbol for item in parameters.values())
    volume, c, temperature = signal("V")[t], signal("c")[t], signal("T")[t]
    u, inflow = signal(input)[t], signal(flow)[t]
    rate = r0 * sympy.exp(-e * (1 / temperature - 1 / t0)) * c
    return Model(
        "full reactor",
        tuple(parameters.values()),
        (
            Line(volume, inflow - f0 * sympy.sqrt(volume / v0), rate=True),
            Line(c, inflow / volume * (u - c) - rate, rate=True),
            Line(temperature, inflow / volume * (t0 - temperature) + h * rate - k * (temperature - t0), rate=True),
        ),
        (Measurement(output, "c", "eta"),),
    )


def simulate_full_reactor(
    u: ArrayLike, sampling_time: float, flow: ArrayLike | None = None, start: float | None = None
) -> Array:
    """Return the concentration of the outflow in mol/m3, without noise, by SciPy's LSODA, shape (n,).

    Parameters
    ----------
    u
        Shape (n,). Concentration of the inflow in mol/m3, not negative, held from each sample to the next.
    sampling_time
        In seconds.
    flow
        Shape (n,). Inflow in m3/s, positive; by default F0.
    start
        First concentration in the tank; by default that of the inflow. The tank starts cold, with the volume V0.

    Raises
    ------
    DataError
        If an input is not finite or negative, or the sampling time is not positive.

    Examples
    --------
    >>> simulate_full_reactor([0.5, 0.5, 0.5], 100.0).round(4)
    array([0.5   , 0.3331, 0.3331])
    """
    v0, f0, r0, t0, e, h, k = (value for value, _ in FULL_REACTOR.values())
    concentration = np.asarray(u, dtype=np.float64)
    inflow = np.broadcast_to(np.asarray(f0 if flow is None else flow, dtype=np.float64), concentration.shape)
    for name, series, least in (("input", concentration, 0.0), ("flow", inflow, 1e-6)):
        if series.ndim != 1 or not series.size or not (np.isfinite(series) & (series >= least)).all():
            raise DataError(f"the {name} of shape {series.shape} is refused: give finite samples of at least {least:g}")
    if not (math.isfinite(sampling_time) and sampling_time > 0):
        raise DataError(f"sampling_time = {sampling_time} is refused: give a positive number of seconds")

    def rate(_: float, state: Any, held: float, fed: float) -> list[float]:
        volume, c, temperature = state
        reacting = r0 * math.exp(-e * (1 / temperature - 1 / t0)) * c
        return [
            fed - f0 * math.sqrt(volume / v0),
            fed / volume * (held - c) - reacting,
            fed / volume * (t0 - temperature) + h * reacting - k * (temperature - t0),
        ]

    state = np.array([v0, concentration[0] if start is None else start, t0])
    result = np.empty(concentration.size)
    result[0] = state[1]
    for n, held in enumerate(zip(concentration[:-1].tolist(), inflow[:-1].tolist(), strict=True), start=1):
        run = solve_ivp(rate, (0.0, sampling_time), state, method="LSODA", rtol=1e-10, atol=1e-12, args=held)
        state = run.y[:, -1]
        result[n] = state[1]
    return result
