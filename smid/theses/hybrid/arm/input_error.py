"""Input error: the motor's torque, computed back from the measured motion, compared with the one that was applied.

    r = a / theta + N(v) - c u,    v, a, u: the first and second derivative of the angle, and the voltage, all modulated

No model is run: 1/J enters linearly and the network reads what is measured, so a step of the method costs a thousandth
of one in free-run error, and there is nothing that could run away.  What is found is a prediction model.  Three shapes
of network come out: right, too smooth (no jump at rest) and wrong (a jump that goes down).

All three signals go through the same modulating function, as in figure 6.10, which cancels in the linear terms; for
N(v) it does not, because the mean of N is not N of the mean.

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
    """Speed, acceleration and motor torque at the same instants.

    Parameters
    ----------
    speed
        Shape (n,). In rad/s.
    acceleration
        Shape (n,). In rad/s2.
    torque
        Shape (n,). In Nm.
    """

    speed: Array
    acceleration: Array
    torque: Array


def quiet_filter(noise_bound: float, sampling_time: float) -> ModulatingFilter:
    """Choose the least width at which uniform noise on the angle makes accelerations off by 1 % of 400 rad/s2 at most.

    Two differences over the width w = m T of an average over m samples: ``sqrt(6 / m) sigma / w^2``, an RMS value.

    Parameters
    ----------
    noise_bound
        In rad.
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
    """Find speed and acceleration of measured records, and the torque smoothed alike.

    Parameters
    ----------
    data
        One or more records with input ``u`` in V, held between samples, and output ``y``, the angle in rad.
    modulating
        By default of order 3 and the least width.

    Returns
    -------
    Motion
        Of all records, one after another.

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
    """The input error as a least-squares problem in (J, weights), scaled as the embedded arm's network is.

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
        """Of the network."""
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
        """Evaluate many points, shape (B, p), for `smid.networks.lockstep`."""
        return InputErrors(self, thetas)

    @property
    def speed(self) -> Array:
        """Scaled speed, shape (n, 1)."""
        return self.motion.speed[:, None] / SPEED_UNIT

    @property
    def pull(self) -> Array:
        """Scaled torque that one unit of inertia takes, shape (n,)."""
        return INERTIA_UNIT / TORQUE_UNIT * self.motion.acceleration

    @property
    def torque(self) -> Array:
        """Scaled motor torque, shape (n,)."""
        return self.motion.torque / TORQUE_UNIT

    def reciprocal_inertia(self, theta: Array) -> float:
        """Return 1/J in 1/(kg m2)."""
        return float(1.0 / (theta[0] * INERTIA_UNIT))


@dataclass(frozen=True, eq=False)
class InputErrors:
    """The input error at many points.

    Parameters
    ----------
    thetas
        Shape (B, p).
    """

    problem: InputError
    thetas: Array

    @cached_property
    def residuals(self) -> Array:
        """In 16 Nm, shape (B, n)."""
        network = TanhNetwork(self.problem.sizes, self.thetas[:, 1:])
        return self.thetas[:, :1] * self.problem.pull + network(self.problem.speed) - self.problem.torque

    @property
    def errors(self) -> Array:
        """Mean squared errors, shape (B,)."""
        return np.asarray(np.mean(self.residuals**2, axis=1))

    def jacobian(self, rows: Rows) -> Array:
        """Return the derivatives of some of the residuals by theta, shape (K, n, p)."""
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
    iterations
        Most steps.

    Raises
    ------
    DataError
        If there are more numbers than samples.

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
