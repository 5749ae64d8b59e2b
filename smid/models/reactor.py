"""The continuous stirred tank reactor, a first-order process from first principles."""

from __future__ import annotations

import sympy

from smid.models.edit_lines import rename_channels
from smid.models.errors import ModelError
from smid.models.model import Line, Measurement, Model, Parameter
from smid.models.symbols import number, signal, t

__all__ = ["Reactor"]

REACTION_RATE = 0.12  # 1/s, hybrid thesis, section 5.2
A_BOX, X_BOX = (0.1, 10.0), (0.5, 4.0)  # around the one of the first principles
LEAST_TAU = 0.1  # s


def Reactor(
    tau: float | None = None,
    a: float | None = 1.0,
    x: float | None = 1.0,
    *,
    reaction_rate: float = REACTION_RATE,
    input: str = "u",
    output: str = "y",
    scheme: str = "rk4",
    substeps: int = 1,
    sampling_time: float | None = None,
) -> Model:
    r"""Return the reactor of the hybrid thesis, equation (5.6), with the mismatches of its table 2 as parameters.

    ``d/dt w = (1/tau - r) u - a w^x / tau``, ``y[t] = w[t] + eta[t]``: a concentration of gain ``1 - r tau``.  First
    principles have a = x = 1.

    Every one of tau, a and x is a parameter.  One given as a number has a box of that one point, which
    `Model.bound` widens; one given as None is free.  Intervals need polynomial lines: for them put
    ``substitute("tau", 1 / k, [k])`` with k the reciprocal, use the Euler scheme and fix x at a whole number.

    Parameters
    ----------
    tau
        Time constant in seconds; free in 0.1 s to 1/r, where the gain vanishes.
    a
        Factor before w; free in 0.1 to 10.
    x
        Power of w; free in 0.5 to 4.  Powers that are not whole need w >= 0.
    reaction_rate
        r, in 1/s.
    input, output
        Channels of the data: concentrations of inflow and outflow.
    scheme, substeps, sampling_time
        How the rate is integrated; see `Model`.

    Returns
    -------
    Model
        Signals ``u`` (the input channel) and ``w``; parameters ``tau``, ``a``, ``x``; noise ``eta``.

    Raises
    ------
    ModelError
        If r is not positive, or tau does not lie between 0 and 1/r.

    Examples
    --------
    >>> print(Reactor(2.0, reaction_rate=0.125, scheme="euler", sampling_time=0.5).discretised().lines[0])
    w[t] = 3*u[t - 1]/16 + 3*w[t - 1]/4
    """
    if not reaction_rate > 0:
        raise ModelError(f"reaction_rate = {reaction_rate} is refused: give a positive number, in 1/s")
    if tau is not None and not 0 < tau < 1 / reaction_rate:
        raise ModelError(
            f"tau = {tau} gives the gain 1 - r tau no positive value: take 0 < tau < {1 / reaction_rate:g}"
        )
    parameters = (
        _parameter("tau", tau, (LEAST_TAU, 1 / number(reaction_rate)), "s", None),
        _parameter("a", a, A_BOX, "", 1.0),
        _parameter("x", x, X_BOX, "", 1.0),
    )
    time, factor, power = (item.symbol for item in parameters)
    w, u = signal("w")[t], signal("u")[t]
    rate = (1 / time - number(reaction_rate)) * u - factor * w**power / time
    model = Model(
        "reactor",
        parameters,
        (Line(w, sympy.sympify(rate), rate=True),),
        (Measurement("y", "w", "eta"),),
        scheme=scheme,
        substeps=substeps,
        sampling_time=sampling_time,
    )
    return rename_channels(model, {"u": input, "y": output})


def _parameter(name: str, value: float | None, box: tuple[float, float], unit: str, null: float | None) -> Parameter:
    lower, upper = box if value is None else (value, value)
    return Parameter(name, lower, upper, unit, null)
