"""A pendulum that a torque drives, as a model and as its exact motion."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.integrate import solve_ivp

from relaxations.algebra.arrays import Array
from smid import OwnModel

H = 0.02


def pendulum(gravity: tuple[float, float], damping: tuple[float, float]) -> OwnModel:
    return OwnModel(
        ["d/dt angle[t] = speed[t]", "d/dt speed[t] = u[t] - gravity*sin(angle[t]) - damping*speed[t]"],
        {"y": "angle"},
        ["u"],
        {"gravity": gravity, "damping": damping},
        scheme="enclosed",
    )


def swung(u: Array, start: Sequence[float], *, gravity: float = 9.0, damping: float = 0.4) -> Array:
    """Return angle and speed, with steps far below the sampling time."""
    states = [np.array(start)]
    for held in u[:-1]:

        def rates(_, x, held=held):
            return x[1], held - gravity * math.sin(x[0]) - damping * x[1]

        states.append(solve_ivp(rates, (0, H), states[-1], method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1])
    return np.array(states)
