"""The exact motion of the arm: each regime of its friction has a closed solution, from event to event.

While the speed v stays in glide or in stick, on one side of rest, at a constant torque T, (5.7)-(5.8) are a Riccati
equation

    v' = p - q v - r v^2,     r = theta b sign(v)
    glide:  p = theta (T - Wd sign(v)),  q = 0             stick:  p = theta T,  q = theta Ws / eps

With D = sqrt(q^2 + 4 p r), ``C = cosh(D t / 2)``, ``S = sinh(D t / 2) / D`` and v the first speed,

    v(t) = (v (C - q S) + 2 p S) / (C + (q + 2 r v) S)
    angle(t) = (log(C + (q + 2 r v) S) - q t / 2) / r
    v(t) = v1  where  S / C = (v1 - v) / (2 p - q (v + v1) - 2 r v v1)

The last line gives the time at which the speed reaches an edge of its regime, 0 or +-eps: an event. Where D is
imaginary, cosh and sinh become cos and sin. There is no approximation, so this is the reference for every integrator of
the arm. It is also the fastest simulation, because events are few.

Safeguards: Ws >= Wd is required; otherwise the speed would chatter at eps, without a closed solution. At an edge the
next regime begins, so rounding cannot leave the speed between two regimes.

References: hybrid thesis, (5.7)-(5.9); Reid, "Riccati Differential Equations" (1972), chapter 1.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from relaxations.algebra.arrays import Array
from relaxations.algebra.compiled import compiling
from smid.models import ModelError
from smid.models.errors import refuse_unknown
from smid.models.rotating_arm import DRAG, FRICTION, MOTOR
from smid.theses.series import finite_series

__all__ = ["ARM", "exact_motion"]

ARM: dict[str, float] = {name: value for name, (value, _) in (MOTOR | DRAG | FRICTION).items()}
"""The thesis's values: theta, c, b, Ws, eps, Wd."""

compiled = compiling(__file__)

EVENTS = 10_000  # in one held interval; a motion of finitely many turns has a handful


def exact_motion(
    u: ArrayLike,
    sampling_time: float,
    *,
    values: dict[str, float] | None = None,
    start: tuple[float, float] = (0.0, 0.0),
) -> Array:
    """Return the arm's angle in rad and speed in rad/s at the samples, solved event by event, shape (n, 2).

    Parameters
    ----------
    u
        Shape (n,). Motor voltage in V, held from each sample to the next.
    sampling_time
        In seconds.
    values
        Constants that differ from `ARM`, in its units.
    start
        Angle in rad and speed in rad/s at the first sample.

    Raises
    ------
    DataError
        If the input is not a finite series, or the sampling time is not positive.
    ModelError
        If a constant is unknown, theta, b or eps is not positive, or Ws < Wd.

    Examples
    --------
    >>> exact_motion([0.05, 0.05, 0.05], 0.1)[:, 1].round(6)
    array([0.     , 0.01995, 0.01995])
    """
    inputs = finite_series(u, sampling_time)
    refuse_unknown("constant of the arm", values or (), ARM)
    arm = ARM | (values or {})
    for name in ("theta", "b", "eps"):
        if not arm[name] > 0:
            raise ModelError(f"{name} = {arm[name]:g}: the exact solution needs it positive")
    if not arm["Ws"] >= arm["Wd"] >= 0:
        raise ModelError(
            f"Ws = {arm['Ws']:g}, Wd = {arm['Wd']:g}: sticking must hold at least as firmly as gliding, "
            "or the speed chatters at eps"
        )
    constants = tuple(float(arm[name]) for name in ("theta", "c", "b", "eps", "Ws", "Wd"))
    states = np.empty((len(inputs), 2))
    states[0] = start
    if not _run(inputs, float(sampling_time), constants, states):
        raise ModelError(f"more than {EVENTS} events within one sample: check the arm's constants")
    return states


@compiled
def _run(inputs: Array, duration: float, constants: tuple[float, ...], states: Array) -> bool:
    """Write angle and speed at each sample after the first; tell whether no sample had too many events."""
    _, c, _, _, _, _ = constants
    for k in range(len(inputs) - 1):
        angle, speed, ended = _hold(states[k, 0], states[k, 1], c * inputs[k], duration, constants)
        if not ended:
            return False
        states[k + 1, 0], states[k + 1, 1] = angle, speed
    return True


@compiled
def _hold(
    angle: float, speed: float, torque: float, duration: float, constants: tuple[float, ...]
) -> tuple[float, float, bool]:
    """Return angle and speed after a duration at a constant torque, from event to event, and whether it was reached."""
    theta, _, b, eps, ws, wd = constants
    for _ in range(EVENTS):
        side, gliding = _regime(speed, torque, b, eps, wd)
        if side == 0.0:
            return angle, 0.0, True
        # By symmetry every regime is that of a speed that is not negative.
        v, drive = side * speed, side * torque
        p = theta * (drive - (wd if gliding else 0.0))
        q = 0.0 if gliding else theta * ws / eps
        r = theta * b
        edge, time = eps, _time_to(v, eps, p, q, r)
        if not gliding:
            stop = _time_to(v, 0.0, p, q, r)
            if stop <= time:
                edge, time = 0.0, stop
        if time >= duration:
            v, turned = _move(v, duration, p, q, r)
            return angle + side * turned, side * v, True
        _, turned = _move(v, time, p, q, r)
        angle, speed, duration = angle + side * turned, side * edge, duration - time
    return angle, speed, False


@compiled
def _regime(speed: float, torque: float, b: float, eps: float, wd: float) -> tuple[float, bool]:
    """Return the side of rest (0: at rest), and whether the arm glides; at an edge, those after the event."""
    if speed == 0.0:
        return float(np.sign(torque)), False
    side = 1.0 if speed > 0 else -1.0
    size = abs(speed)
    if size != eps:
        return side, size > eps
    return side, side * torque - wd - b * eps**2 > 0


@compiled
def _move(v: float, time: float, p: float, q: float, r: float) -> tuple[float, float]:
    """Return the speed after a time within one regime, and the angle turned."""
    square = q * q + 4.0 * p * r
    size = math.sqrt(abs(square))
    half = size * time / 2.0
    if size == 0.0:
        growth, cosine, sine = 0.0, 1.0, time / 2.0
    elif square > 0:  # both without their common factor exp(D t / 2), which overflows
        growth, cosine, sine = half, (1.0 + math.exp(-2.0 * half)) / 2.0, -math.expm1(-2.0 * half) / (2.0 * size)
    else:
        growth, cosine, sine = 0.0, math.cos(half), math.sin(half) / size
    below = cosine + (q + 2.0 * r * v) * sine
    turned = (growth - q * time / 2.0 + math.log(below)) / r
    return (v * (cosine - q * sine) + 2.0 * p * sine) / below, turned


@compiled
def _time_to(v: float, edge: float, p: float, q: float, r: float) -> float:
    """Return the time at which the speed reaches an edge within one regime; infinite if it never does."""
    below = 2.0 * p - q * (v + edge) - 2.0 * r * v * edge
    square = q * q + 4.0 * p * r
    size = math.sqrt(abs(square))
    if edge == v or below == 0.0:
        return math.inf
    ratio = size * (edge - v) / below
    if size == 0.0:
        time = 2.0 * (edge - v) / below
        return time if time > 0 else math.inf
    if square > 0:
        return 2.0 / size * math.atanh(ratio) if 0.0 < ratio < 1.0 else math.inf
    return 2.0 / size * (math.atan(ratio) % math.pi)
