"""Input error: the motor's torque, computed from the measured motion, compared with the applied torque.

    r = a / theta + N(v) - c u,    v, a, u: the first and second derivative of the angle, and the voltage, all filtered

No simulation is needed: 1/J enters linearly and the network reads measured signals. A step costs a thousandth of a step
in free-run error, and nothing can diverge. The result is a prediction model. Three shapes of network occur: right, too
smooth (no jump at rest) and wrong (a jump in the other direction).

All three signals pass the same modulating filter, as in figure 6.10, which cancels in the linear terms. It does not
cancel for N(v), because the mean of N is not N of the mean.

Reference: hybrid thesis, sections 3.1 and 6.3.5, figures 6.10 and 6.11, listings K.23 and K.24.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from relaxations.algebra.arrays import Array
from smid.data import DataError, Dataset
from smid.networks import (
    Descent,
    NormalEquations,
    TanhNetwork,
    descend,
    levenberg_marquardt,
    stacked_normal_equations,
    sum_normal_equations,
)
from smid.signals import ModulatingFilter
from smid.theses.hybrid.arm.embedded_arm import SPEED_UNIT, TORQUE_UNIT
from smid.theses.hybrid.arm.exact_motion import ARM

__all__ = ["INERTIA_UNIT", "InputError", "Motion", "estimate_by_input_error", "modulate_motion", "quiet_filter"]

Rows = NDArray[np.intp]

ACCELERATION_UNIT = 400.0  # rad/s2
INERTIA_UNIT = TORQUE_UNIT / ACCELERATION_UNIT  # kg m2


@dataclass(frozen=True, eq=False)
class Motion:
    """Speed (rad/s), acceleration (rad/s2) and motor torque (Nm) at the same instants, each of shape (n,)."""

    speed: Array
    acceleration: Array
    torque: Array


def quiet_filter(noise_bound: float, sampling_time: float) -> ModulatingFilter:
    """Return the filter of least width for which noise on the angle changes accelerations by at most 1 % of 400 rad/s2.

    Two differences over the width w = m T of an average over m samples give the RMS error ``sqrt(6 / m) sigma / w^2``.

    Parameters
    ----------
    noise_bound
        Of the uniform noise, in rad.
    sampling_time
        T, in seconds.

    Examples
    --------
    >>> quiet_filter(0.0, 0.02).width, quiet_filter(0.002, 0.02).width, quiet_filter(1.0, 0.02).width
    (2, 2, 16)
    """
    noise = math.sqrt(6.0) * noise_bound / math.sqrt(3.0) / (sampling_time**2 * 0.01 * ACCELERATION_UNIT)
    return ModulatingFilter(width=max(2, 2 * math.ceil(noise**0.4 / 2.0)))


def modulate_motion(data: Dataset, modulating: ModulatingFilter | None = None) -> Motion:
    """Return speed and acceleration of measured records, and the torque filtered alike, all records in a row.

    Parameters
    ----------
    data
        Input ``u`` in V, held between samples, and output ``y``, the angle in rad.
    modulating
        By default of order 3 and the least width.

    Raises
    ------
    DataError
        If a record is too short.

    Examples
    --------
    >>> from smid.theses.hybrid.arm.records import held_record
    >>> from smid.signals import TABLE_F1
    >>> record = held_record(TABLE_F1["one_sine"])
    >>> motion = modulate_motion(record)
    >>> bool(np.abs(motion.speed - record.experiments[0].values["speed"][3:-3]).max() < 0.5)
    True
    """
    chosen, step = modulating or ModulatingFilter(), data.sampling_time
    speeds, accelerations, torques = [], [], []
    for record in data.experiments:
        y, u = record.values["y"], record.values["u"]
        # A held voltage jumps at the samples: its value at one is the mean of before and after.
        middle = np.concatenate([u[:1], (u[1:] + u[:-1]) / 2.0])
        speeds.append(chosen.derivative(y, step, 1))
        accelerations.append(chosen.derivative(y, step, 2))
        torques.append(ARM["c"] * chosen.derivative(middle, step, 0))
    return Motion(np.concatenate(speeds), np.concatenate(accelerations), np.concatenate(torques))


@dataclass(frozen=True, eq=False)
class InputError:
    """The input error as a least-squares problem in (J, weights), scaled as the embedded arm's network.

    Parameters
    ----------
    hidden
        Neurons of each hidden layer.

    Examples
    --------
    >>> v = np.linspace(-80.0, 80.0, 81)
    >>> problem = InputError(Motion(v, np.zeros(81), np.zeros(81)), hidden=(1,))
    >>> problem.error(np.zeros(5))
    0.0
    """

    motion: Motion
    hidden: tuple[int, ...] = (3,)

    @property
    def sizes(self) -> tuple[int, ...]:
        """Return the sizes of the network."""
        return (1, *self.hidden)

    def error(self, theta: Array) -> float:
        """Return the mean squared error in (16 Nm)^2."""
        network = TanhNetwork(self.sizes, theta[1:])
        return float(np.mean((theta[0] * self.pull + network(self.speed) - self.torque) ** 2))

    def normal_equations(self, theta: Array) -> NormalEquations:
        """Return the normal equations."""
        part = TanhNetwork(self.sizes, theta[1:]).linearise(self.speed)
        residual = theta[0] * self.pull + part.outputs - self.torque
        jacobian = np.column_stack([self.pull, part.by_weights])
        return sum_normal_equations([(residual, jacobian)])

    def points(self, thetas: Array) -> InputErrors:
        """Return the input error at many points, shape (B, p), for `smid.networks.lockstep`."""
        return InputErrors(self, thetas)

    @property
    def speed(self) -> Array:
        """Return the scaled speed, shape (n, 1)."""
        return self.motion.speed[:, None] / SPEED_UNIT

    @property
    def pull(self) -> Array:
        """Return the scaled torque of one unit of inertia, shape (n,)."""
        return INERTIA_UNIT / TORQUE_UNIT * self.motion.acceleration

    @property
    def torque(self) -> Array:
        """Return the scaled motor torque, shape (n,)."""
        return self.motion.torque / TORQUE_UNIT

    def reciprocal_inertia(self, theta: Array) -> float:
        """Return 1/J in 1/(kg m2)."""
        return float(1.0 / (theta[0] * INERTIA_UNIT))


@dataclass(frozen=True, eq=False)
class InputErrors:
    """The input error at many points, shape (B, p)."""

    problem: InputError
    thetas: Array

    @cached_property
    def residuals(self) -> Array:
        """Return the residuals in 16 Nm, shape (B, n)."""
        network = TanhNetwork(self.problem.sizes, self.thetas[:, 1:])
        return self.thetas[:, :1] * self.problem.pull + network(self.problem.speed) - self.problem.torque

    @property
    def errors(self) -> Array:
        """Return the mean squared errors, shape (B,)."""
        return np.asarray(np.mean(self.residuals**2, axis=1))

    def jacobian(self, rows: Rows) -> Array:
        """Return the derivatives of the residuals of some points, shape (K, n, p)."""
        part = TanhNetwork(self.problem.sizes, self.thetas[rows, 1:]).linearise(self.problem.speed)
        pull = np.broadcast_to(self.problem.pull[:, None], (*part.by_weights.shape[:2], 1))
        return np.concatenate([pull, part.by_weights], axis=2)

    def normal_equations(self, rows: Rows) -> tuple[Array, Array]:
        """Return ``J'r / n``, shape (K, p), and ``J'J / n``, shape (K, p, p), of some of the points."""
        return stacked_normal_equations(self.residuals, self.jacobian, rows)


def estimate_by_input_error(problem: InputError, start: Array, *, iterations: int = 300) -> Descent:
    """Descend in input error from one start.

    Parameters
    ----------
    start
        Shape (p,). J in 0.04 kg m2, then the weights.

    Raises
    ------
    DataError
        If there are more variables than samples.

    Examples
    --------
    >>> v = np.linspace(-80.0, 80.0, 81)
    >>> a = 100.0 * np.cos(v)
    >>> problem = InputError(Motion(v, a, a / 20.0 + 4.0 * np.tanh(v / 80.0)), hidden=(1,))
    >>> found = estimate_by_input_error(problem, np.array([1.0, 0.5, 0.0, 0.5, 0.0]))
    >>> problem.error(found.theta) < 1e-6
    True
    """
    if start.size > problem.motion.speed.size:
        raise DataError(
            f"{start.size} numbers but {problem.motion.speed.size} samples: give more samples, or fewer neurons"
        )
    return descend(levenberg_marquardt, problem, start, iterations=iterations, patience=iterations)
