"""The rotating arm, a motor that turns a cylinder with friction: a second-order process from first principles."""

from __future__ import annotations

import sympy

from smid.models.edit_lines import rename_channels
from smid.models.errors import ModelError
from smid.models.model import Line, Measurement, Model, Parameter
from smid.models.symbols import signal, t

__all__ = ["RotatingArm"]

MOTOR = {"theta": (21.7391, "1/(kg m2)"), "c": (15.96, "Nm/V")}
DRAG = {"b": (0.0027, "Nm s2/rad2")}
FRICTION = {"Ws": (1.2, "Nm"), "eps": (0.03, "rad/s"), "Wd": (0.43, "Nm")}
"""Values of the hybrid thesis, section 5.3.  It prints N s2/rad for b; a torque over a squared speed is meant."""

THETA_BOX, C_BOX = (1.0, 1000.0), (0.1, 1000.0)


def RotatingArm(
    theta: float | None = MOTOR["theta"][0],
    c: float | None = MOTOR["c"][0],
    *,
    friction: bool = False,
    drag: bool = False,
    measured: str = "angle",
    input: str = "u",
    output: str = "y",
    scheme: str = "rk4",
    substeps: int = 1,
    sampling_time: float | None = None,
) -> Model:
    r"""Return the arm of the hybrid thesis, equations (5.7)-(5.9); without options Newton's law alone, (5.14).

    ``d/dt angle = speed``, ``d/dt speed = theta (c u - W - b speed |speed|)``, with the friction (5.8)
    ``W = Ws speed / eps`` where ``|speed| < eps`` (sticking) and ``W = Wd sign(speed)`` elsewhere (gliding).

    theta and c are parameters: one given as a number has a box of that one point, which `Model.bound` widens; one
    given as None is free.  Only their product can be found without friction and drag.  The constants of friction and
    drag are the thesis's, as parameters fixed the same way.

    Parameters
    ----------
    theta
        Reciprocal inertia in 1/(kg m2); free in 1 to 1000.
    c
        Torque per voltage in Nm/V; free in 0.1 to 1000.
    friction
        Whether W acts.  Sticking has a rate of theta Ws / eps = 870 1/s, so an explicit scheme needs steps below
        3 ms: raise `substeps`, or take the scheme "rosenbrock"; for intervals, the scheme "enclosed".
    drag
        Whether the aerodynamic resistance acts.
    measured
        One of {"angle", "speed"}. What the output channel shows, in rad or rad/s.
    input, output
        Channels of the data.
    scheme, substeps, sampling_time
        How the rates are integrated; see `Model`.

    Returns
    -------
    Model
        Signals ``u`` (the input channel), ``angle``, ``speed``; parameters ``theta``, ``c``, then ``Ws``, ``eps``,
        ``Wd`` with friction and ``b`` with drag; noise ``eta``.

    Raises
    ------
    ModelError
        If `measured` is something else.

    Examples
    --------
    >>> print(RotatingArm(theta=20.0, c=16.0))
    rotating arm
      d/dt angle[t] = speed[t]
      d/dt speed[t] = c*theta*u[t]
      y[t] = angle[t] + eta[t]
      theta in [20, 20] 1/(kg m2)
      c in [16, 16] Nm/V
      integrated by rk4, 1 step per sample, inputs held
    """
    if measured not in ("angle", "speed"):
        raise ModelError(f"measured = {measured!r} is not a signal of the arm: choose 'angle' or 'speed'")
    parameters = [
        Parameter("theta", *(THETA_BOX if theta is None else (theta, theta)), MOTOR["theta"][1]),
        Parameter("c", *(C_BOX if c is None else (c, c)), MOTOR["c"][1]),
    ]
    speed = signal("speed")[t]
    inertia, motor = (item.symbol for item in parameters)
    torque = motor * signal("u")[t]
    if friction:
        ws, eps, wd = added = _fixed(FRICTION)
        parameters += added
        # One where the arm glides, zero where it sticks: the model's language has no cases.
        gliding = (1 + sympy.sign(sympy.Abs(speed) - eps.symbol)) / 2
        # Cut off where it does not act: so the enclosure of a speed in doubt holds no larger friction than Ws.
        sticking = sympy.Max(sympy.Min(speed / eps.symbol, 1), -1)
        torque -= gliding * wd.symbol * sympy.sign(speed) + (1 - gliding) * ws.symbol * sticking
    if drag:
        added = _fixed(DRAG)
        parameters += added
        torque -= added[0].symbol * speed * sympy.Abs(speed)
    model = Model(
        "rotating arm",
        tuple(parameters),
        (Line(signal("angle")[t], speed, rate=True), Line(speed, inertia * torque, rate=True)),
        (Measurement("y", measured, "eta"),),
        scheme=scheme,
        substeps=substeps,
        sampling_time=sampling_time,
    )
    return rename_channels(model, {"u": input, "y": output})


def _fixed(constants: dict[str, tuple[float, str]]) -> list[Parameter]:
    """Return parameters whose box is one point; 0 is the null value of all but `eps`."""
    return [
        Parameter(name, value, value, unit, None if name == "eps" else 0.0) for name, (value, unit) in constants.items()
    ]
