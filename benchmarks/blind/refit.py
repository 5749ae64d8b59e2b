"""Best refit of a base plant without any effect: what no parameter of the base model can explain.

The base models are linear in their gains and initial state once the poles are given, so only the poles are searched
(variable projection, Golub and Pereyra 1973) and the rest is a linear least squares problem.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import lfilter

from benchmarks.blind.plants import Plant, Twist, simulate
from relaxations.algebra.arrays import Array

__all__ = ["misfit"]


def misfit(plant: Plant, u: Array, y: Array, fixed: tuple[str, ...] = (), powers: int = 1) -> Array:
    """Return what is left of an output after the best base plant is taken away.

    Parameters
    ----------
    plant : Plant
        The base plant; its numbers are starting values, and nominal values of what is fixed.
    u, y : numpy.ndarray, shape (n,)
        Recorded input and the output to explain.
    fixed : tuple of str
        What the base model holds at nominal values: everything, or nothing when empty.
    powers : int
        Above 1, a free polynomial of this degree precedes the linear part: the rival of every static curve.

    Returns
    -------
    numpy.ndarray, shape (n,)
        Residual of the best fit over the free parameters and the initial state.

    Examples
    --------
    >>> plant = Plant("linear1", 1.0, -1, 1, "u", "y", 2.0, 10.0)
    >>> u = np.sin(np.arange(100) / 5.0)
    >>> bool(np.abs(misfit(plant, u, simulate(plant, Twist(), u))).max() < 1e-6)
    True
    """
    columns = plant.features(u)
    if powers > 1:
        scaled = u / np.max(np.abs(u))
        columns = np.stack([scaled**power for power in range(powers + 1)], axis=1)
    known = simulate(plant, Twist(), u) if fixed else None

    def residual(z: Array) -> Array:
        denominator = _denominator(plant, z)
        regressors = _regressors(plant, columns, denominator)
        if known is not None:
            regressors = regressors[:, -plant.order :]
            return _rest(regressors, y - known)
        return _rest(regressors, y)

    start = _start(plant)
    if known is not None or start.size == 0:
        return residual(start)
    best = residual(start)
    # Shorter and longer time constants beside the nominal ones: the effect may have moved the best poles far.
    for shift in (0.0, -1.2, 1.2):
        found = least_squares(residual, start + shift, x_scale=0.3, xtol=1e-10, ftol=1e-10, max_nfev=40)
        if found.cost < 0.5 * best @ best:
            best = residual(found.x)
    return best


def _start(plant: Plant) -> Array:
    """Coordinates of the nominal poles; any real number is a stable pole in them."""
    ratio = plant.sampling_time / plant.tau
    if plant.name == "arm_free":
        return np.zeros(0)
    if plant.order == 1 or plant.name == "arm_angle":
        return np.array([-np.log(np.expm1(ratio))])
    return np.array([-np.log(ratio), np.log(plant.damping)])


def _denominator(plant: Plant, z: Array) -> Array:
    if plant.name == "arm_free":
        return np.array([1.0, -1.0])
    if plant.name == "linear2":
        ratio, damping = np.exp(-np.clip(z[0], -3.0, 8.0)), np.exp(np.clip(z[1], -5.0, 3.0))
        if damping >= 1:
            spread = np.sqrt(damping**2 - 1)
            fast, slow = np.exp(-ratio * (damping + spread)), np.exp(-ratio * (damping - spread))
            return np.array([1.0, -fast - slow, fast * slow])
        radius, angle = np.exp(-ratio * damping), ratio * np.sqrt(1 - damping**2)
        return np.array([1.0, -2 * radius * np.cos(angle), radius**2])
    pole = 1 / (1 + np.exp(-z[0])) if abs(z[0]) < 30 else float(z[0] > 0)
    return np.array([1.0, -pole]) if plant.order == 1 else np.array([1.0, -1.0 - pole, pole])


def _regressors(plant: Plant, columns: Array, denominator: Array) -> Array:
    """Responses of the linear part to each column, delayed by one sample and by two, and to each initial state."""
    impulse = np.zeros(len(columns))
    impulse[0] = 1.0
    numerator = [0.0, 1.0]
    if plant.name == "arm_angle":
        # Both numerator coefficients follow from the pole: the held torque's double integral with viscous friction.
        pole = min(max(float(denominator[2]), 1e-9), 1 - 1e-9)
        tau = -1 / np.log(pole)  # in samples
        numerator = [0.0, 1 - tau * (1 - pole), tau * (1 - pole) - pole]
    forced = [lfilter(numerator, denominator, column) for column in columns.T]
    if plant.name == "linear2":
        forced += [lfilter([0.0, 0.0, 1.0], denominator, column) for column in columns.T]
    free = [lfilter([0.0] * lag + [1.0], denominator, impulse) for lag in range(plant.order)]
    return np.stack(forced + free, axis=1)


def _rest(regressors: Array, y: Array) -> Array:
    scale = np.linalg.norm(regressors, axis=0)
    scaled = regressors / np.where(scale > 0, scale, 1.0)
    weights = np.linalg.lstsq(scaled, y, rcond=1e-12)[0]
    return np.asarray(y - scaled @ weights)
