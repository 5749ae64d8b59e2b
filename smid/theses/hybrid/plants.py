"""The simulated plants of the hybrid thesis, and their first-principles models.

The reactors of its table 2 obey ``tau y' + a y^x = (1 - r tau) u`` with r = 0.12 1/s. In two of them ``z = f(y)`` is
measured, and one feeds a second tank. The first-principles model is the same reactor with a = x = 1 and nothing after
it. The arm is (5.7)-(5.8), its first-principles model Newton's law (5.14).

The plants do not use the models' integrators. The reactors use SciPy's LSODA at tight tolerances from sample to
sample, with the input held. The arm, whose friction jumps, uses steps of at most 0.1 ms. As in listing K.1 the reactor
starts at the first sample of the input.

All numbers of table 2 and of section 5.3 are the thesis's. Ours: the plant of (5.12), "a combination of the tau-type
and the a-type", has tau and a from these two rows of table 2.

Reference: hybrid thesis, sections 5.2 to 5.4, table 2, listings K.1 to K.3.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import sympy
from numpy.typing import ArrayLike
from scipy.integrate import solve_ivp

from relaxations.algebra.arrays import Array
from smid.models import VALUE, Model, Reactor, RotatingArm, signal, t
from smid.models.errors import refuse_unknown
from smid.models.reactor import REACTION_RATE
from smid.models.rotating_arm import DRAG, FRICTION, MOTOR
from smid.theses.series import finite_series

__all__ = [
    "MISMATCHES",
    "Mismatch",
    "arm_base",
    "arm_friction",
    "reactor_base",
    "reactor_plant",
    "simulate_arm",
    "simulate_reactor",
]

ARM_STEP = 1e-4  # s; sticking decays at 870 1/s


@dataclass(frozen=True)
class Mismatch:
    """One row of table 2: the difference between a reactor and its first-principles model.

    Parameters
    ----------
    tau, a, x
        Of the plant; tau in seconds.
    base_tau
        Time constant of the first-principles model, in seconds.
    second_tau
        Time constant of a second tank that the first one feeds, in seconds.
    curve
        Measured function of the last concentration, an expression in ``smid.models.VALUE``.

    Examples
    --------
    >>> Mismatch(tau=4.0).base_tau  # the plant is slower than its first principles
    2.0
    """

    tau: float = 2.0
    a: float = 1.0
    x: float = 1.0
    base_tau: float = 2.0
    second_tau: float | None = None
    curve: sympy.Expr | None = None


MISMATCHES: dict[str, Mismatch] = {
    "time_constant": Mismatch(base_tau=4.0),
    "factor": Mismatch(a=2.0),
    "power": Mismatch(x=3.0),
    "two_in_succession": Mismatch(second_tau=4.0),
    "sine": Mismatch(curve=sympy.Rational(2, 5) * sympy.sin(10 * VALUE) + sympy.Rational(1, 2)),
    "square_root": Mismatch(curve=sympy.sqrt(VALUE)),
    "time_constant_and_factor": Mismatch(a=2.0, base_tau=4.0),
}
"""Table 2, row by row, and the plant of (5.12)."""


def reactor_base(mismatch: str) -> Model:
    """Return the first-principles model of one of `MISMATCHES`: a `Reactor` with a = x = 1 and fixed parameters.

    Raises
    ------
    ModelError
        If there is no such mismatch.

    Examples
    --------
    >>> reactor_base("time_constant").parameter("tau").lower
    4.0
    """
    refuse_unknown("mismatch", [mismatch], MISMATCHES)
    return Reactor(MISMATCHES[mismatch].base_tau)


def reactor_plant(mismatch: str | Mismatch) -> Model:
    """Return the plant of a mismatch as a model; a second tank is the signal ``second``, a measured curve ``seen``.

    Parameters
    ----------
    mismatch
        One of `MISMATCHES`, or your own.

    Raises
    ------
    ModelError
        If there is no such mismatch.

    Examples
    --------
    >>> print(reactor_plant("two_in_succession").lines[1].expression)
    -second[t]/4 + 13*w[t]/100
    """
    if isinstance(mismatch, str):
        refuse_unknown("mismatch", [mismatch], MISMATCHES)
        mismatch = MISMATCHES[mismatch]
    model, last = Reactor(mismatch.tau, mismatch.a, mismatch.x), "w"
    if mismatch.second_tau is not None:
        inverse = 1 / sympy.Rational(repr(mismatch.second_tau))
        feed = inverse - sympy.Rational(repr(REACTION_RATE))
        model = model.with_line("second", feed * signal("w")[t] - inverse * signal("second")[t], rate=True)
        last = "second"
    if mismatch.curve is not None:
        model, last = model.with_line("seen", mismatch.curve.xreplace({VALUE: signal(last)[t]})), "seen"
    return replace(model, measurements=(replace(model.measurements[0], signal=last),))


def simulate_reactor(mismatch: str | Mismatch, u: ArrayLike, sampling_time: float, start: float | None = None) -> Array:
    """Return the measured output of a mismatched reactor, without noise, shape (n,).

    Parameters
    ----------
    mismatch
        One of `MISMATCHES`, or your own.
    u
        Shape (n,). Inflow concentration, not negative, held from each sample to the next.
    sampling_time
        In seconds.
    start
        First concentration in the tank (in both of them); by default that of the inflow.

    Raises
    ------
    ModelError
        If there is no such mismatch.
    DataError
        If the input is not a finite series, or the sampling time is not positive.

    Examples
    --------
    >>> simulate_reactor("factor", [0.5, 0.5, 0.5], 100.0).round(4)
    array([0.5 , 0.19, 0.19])
    """
    if isinstance(mismatch, str):
        refuse_unknown("mismatch", [mismatch], MISMATCHES)
        mismatch = MISMATCHES[mismatch]
    inputs = finite_series(u, sampling_time)
    first = float(inputs[0]) if start is None else float(start)
    y = _tank(inputs, sampling_time, mismatch.tau, mismatch.a, mismatch.x, mismatch.second_tau, first)
    return y if mismatch.curve is None else np.asarray(sympy.lambdify(VALUE, mismatch.curve, "numpy")(y))


def _tank(
    u: Array, sampling_time: float, tau: float, a: float, x: float, second_tau: float | None, first: float
) -> Array:
    """Integrate one tank, or two at once so that the second one receives the first between samples."""
    state = np.array([first] if second_tau is None else [first, first])
    result = np.empty(len(u))
    result[0] = first

    def rate(_: float, y: Any, held: float) -> list[float]:
        # Rounding can make a concentration negative; its power keeps the sign.
        rates = [(1 / tau - REACTION_RATE) * held - a * math.copysign(abs(y[0]) ** x, y[0]) / tau]
        if second_tau is not None:
            rates.append((1 / second_tau - REACTION_RATE) * y[0] - y[1] / second_tau)
        return rates

    for k, held in enumerate(u[:-1].tolist(), start=1):
        run = solve_ivp(rate, (0.0, sampling_time), state, method="LSODA", rtol=1e-10, atol=1e-12, args=(held,))
        state = run.y[:, -1]
        result[k] = state[-1]
    return result


def arm_base(measured: str = "angle") -> Model:
    """Return Newton's law for the arm, (5.14): a `RotatingArm` without friction and drag, all parameters fixed.

    Parameters
    ----------
    measured
        Signal of the output channel, "angle" or "speed".

    Raises
    ------
    ModelError
        If `measured` is something else.

    Examples
    --------
    >>> arm_base("speed").measurements[0].signal
    'speed'
    """
    return RotatingArm(measured=measured)


def arm_friction(speed: float, ws: float, eps: float, wd: float, b: float) -> float:
    """Return friction and drag of the arm in Nm, (5.7)-(5.8).

    Parameters
    ----------
    speed
        In rad/s.
    ws, eps, wd, b
        Sticking and its largest speed, gliding, drag: in Nm, rad/s, Nm and Nm s2/rad2.

    Examples
    --------
    >>> arm_friction(-10.0, 1.2, 0.03, 0.43, 0.0027)
    -0.7
    """
    held = ws * speed / eps if abs(speed) < eps else math.copysign(wd, speed)
    return held + b * speed * abs(speed)


def simulate_arm(
    u: ArrayLike,
    sampling_time: float,
    measured: str = "angle",
    *,
    friction: bool = True,
    drag: bool = True,
    start: tuple[float, float] = (0.0, 0.0),
) -> Array:
    """Return the angle in rad, or the speed in rad/s, of the arm with friction and drag, (5.7)-(5.8), shape (n,).

    Parameters
    ----------
    u
        Shape (n,). Motor voltage, held from each sample to the next; within 1 V in the thesis.
    sampling_time
        In seconds.
    measured
        Signal to return, "angle" or "speed".
    friction, drag
        Sticking and gliding friction, and aerodynamic resistance, act.
    start
        Angle in rad and speed in rad/s at the first sample.

    Raises
    ------
    DataError
        If the input is not a finite series, or the sampling time is not positive.
    ModelError
        If `measured` is something else.

    Examples
    --------
    >>> simulate_arm([0.05, 0.05, 0.05], 0.1, "speed").round(5)
    array([0.     , 0.01995, 0.01995])
    """
    refuse_unknown("signal", [measured], ("angle", "speed"))
    inputs = finite_series(u, sampling_time)
    theta, c = MOTOR["theta"][0], MOTOR["c"][0]
    ws, eps, wd = (FRICTION[name][0] if friction else 0.0 for name in ("Ws", "eps", "Wd"))
    b = DRAG["b"][0] if drag else 0.0

    # Fourth-order Runge-Kutta steps of at most ARM_STEP.
    def rate(speed: float, torque: float) -> float:
        return theta * (torque - arm_friction(speed, ws, eps, wd, b))

    steps = math.ceil(sampling_time / ARM_STEP)
    h = sampling_time / steps
    angle, speed = start
    states = [(angle, speed)]
    for held in inputs[:-1].tolist():
        torque = c * held
        for _ in range(steps):
            k1 = rate(speed, torque)
            k2 = rate(speed + h / 2 * k1, torque)
            k3 = rate(speed + h / 2 * k2, torque)
            k4 = rate(speed + h * k3, torque)
            angle += h * speed + h * h / 6 * (k1 + k2 + k3)
            speed += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        states.append((angle, speed))
    return np.array(states)[:, ("angle", "speed").index(measured)]
