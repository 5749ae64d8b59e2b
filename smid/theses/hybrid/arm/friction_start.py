"""Starts in free-run error from a white arm: its inertia, and a network fitted to its friction and drag.

    16 Nm N(v) ~ Wd sign(v) + b v |v|      over the speeds that the white arm reaches, and the opposite speeds

The constants are estimates, or the centres of the intervals that `prove_arm` proves without a start value. The network
is not fitted to sticking: within eps of rest the free run determines it.

Reference: hybrid thesis, section 7.4 and appendix F.1.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data import Dataset
from smid.networks import NetworkError, levenberg_marquardt, multistart
from smid.theses.hybrid.arm.embedded_arm import INERTIA_START, SPEED_UNIT, TORQUE_UNIT, true_friction
from smid.theses.hybrid.arm.exact_motion import exact_motion
from smid.theses.hybrid.arm.global_start import jump_start
from smid.theses.hybrid.arm.proven import prove_arm
from smid.theses.hybrid.arm.white import estimate_white

__all__ = ["certified_start", "friction_start", "white_start"]

Seeds = Iterable[int | np.random.Generator]

GRID, STARTS, ITERATIONS = 400, 2, 100


def friction_start(data: Dataset, constants: Mapping[str, float], hidden: int = 5, *, seeds: Seeds) -> Array:
    """Return 1/J and the weights of networks fitted to a white arm's friction, shape (B, 3 hidden + 2).

    They are scaled for `embedded_error` with as many neurons.

    Parameters
    ----------
    data
        One record with input ``u`` in V.
    constants
        theta, b, Ws and Wd, in the units of `smid.theses.hybrid.arm.ARM`.
    hidden
        Number of neurons.
    seeds
        One network for each, the better of two that start as in `multistart_start`.

    Examples
    --------
    >>> from smid.theses.hybrid.arm.exact_motion import ARM
    >>> from smid.theses.hybrid.arm.records import held_record
    >>> from smid.signals import TABLE_F1
    >>> constants = {name: ARM[name] for name in ("theta", "b", "Ws", "Wd")}
    >>> start = friction_start(held_record(TABLE_F1["one_sine"]), constants, 3, seeds=[1])
    >>> start.shape, float(INERTIA_START * start[0, 0])
    ((1, 11), 21.7391)
    """
    motion = exact_motion(data.experiments[0].values["u"], data.sampling_time, values=dict(constants))
    speed = np.abs(motion[:, 1]).max() * np.linspace(-1.0, 1.0, GRID)
    gliding = true_friction(speed, {**constants, "eps": 0.0})
    problem = NetworkError((1, hidden), speed[:, None] / SPEED_UNIT, gliding / TORQUE_UNIT)
    rows = []
    for seed in seeds:
        generator = np.random.default_rng(seed)
        starts = [jump_start(hidden, generator) for _ in range(STARTS)]
        found = multistart(levenberg_marquardt, problem, starts, iterations=ITERATIONS, patience=ITERATIONS)
        rows.append(np.append(constants["theta"] / INERTIA_START, found.theta))
    return np.array(rows)


def white_start(data: Dataset, hidden: int = 5, *, seeds: Seeds) -> Array:
    """Return starts as `friction_start`, from the white arm estimated by its exact motion.

    Parameters
    ----------
    data
        One record with input ``u`` in V and output ``y``, the angle in rad.

    Examples
    --------
    >>> from smid.theses.hybrid.arm.records import held_record
    >>> from smid.signals import TABLE_F1
    >>> start = white_start(held_record(TABLE_F1["one_sine"]), 3, seeds=[1])
    >>> round(float(INERTIA_START * start[0, 0]), 3)
    21.739
    """
    return friction_start(data, estimate_white(data).values, hidden, seeds=seeds)


def certified_start(data: Dataset, noise_bound: float, hidden: int = 5, *, seeds: Seeds) -> Array:
    """Return starts as `friction_start`, from the centres of the certified intervals of 1/J, b and Wd.

    Parameters
    ----------
    data
        One record with input ``u`` in V and output ``y``, the angle in rad.
    noise_bound
        Largest error of a measured angle, in rad.

    Raises
    ------
    EmptyFeasibleSetError
        If no arm explains the record within the bound.

    Examples
    --------
    >>> from smid.theses.hybrid.arm.records import held_record
    >>> from smid.signals import TABLE_F1
    >>> record = held_record(TABLE_F1["six_unequal"].signal(150, 0.02), noise_bound=0.001, seed=1)
    >>> start = certified_start(record, 0.001, 3, seeds=[1])
    >>> bool(abs(INERTIA_START * start[0, 0] - 21.74) < 0.2)
    True
    """
    record = Dataset.from_arrays(
        input={"u": data.experiments[0].values["u"]},
        output={"y": data.experiments[0].values["y"]},
        sampling_time=data.sampling_time,
    )
    proven = prove_arm(record, noise_bound)
    constants = {name: proven[name].centre for name in ("theta", "b", "Wd")}
    # Often only the lower end of Ws is narrow.
    constants["Ws"] = max(proven["Ws"].lower, constants["Wd"])
    return friction_start(data, constants, hidden, seeds=seeds)
