"""The base models that the diagnosis is given, with the names and the knowledge their plants come with."""

from __future__ import annotations

from benchmarks.blind.plants import THETA, TORQUE, Plant
from smid import Hammerstein, Model, OutputError, Parameter
from smid.models import Reactor
from smid.models.model import Line, Measurement
from smid.models.symbols import signal, t

__all__ = ["base_model"]


def base_model(plant: Plant, fixed: tuple[str, ...] = (), physical: bool = False) -> Model:
    """Build the model of a plant without effects.

    Parameters
    ----------
    plant : Plant
        The plant; its numbers are used where they are fixed only.
    fixed : tuple of str
        "gain" and "tau" where the model holds its nominal values, as parameters whose box is one point.
    physical : bool
        Whether a first order plant is written as a differential equation instead of as an output-error model. Fixed
        ones, the angle and the arm without friction always are.

    Returns
    -------
    Model
        Some values of its parameters give the plant, up to the fourth order of its integration.

    Examples
    --------
    >>> plant = Plant("linear1", 1.0, -1, 1, "u", "y", 2.0, 10.0)
    >>> [parameter.name for parameter in base_model(plant).parameters]
    ['a1', 'b0']
    """
    if plant.name == "clutch":
        return Hammerstein(
            poles=1,
            powers=(5, 4, 3),
            input_scale=0.01,
            unit_dc_gain=True,
            stable=True,
            input=plant.input,
            output=plant.output,
        )
    if plant.name in ("arm_angle", "arm_free") or (plant.name == "arm_speed" and physical):
        return _arm(plant)
    if plant.name == "cstr" and (physical or fixed):
        return Reactor(
            plant.tau if "tau" in fixed else None,
            1.0 if "gain" in fixed else None,
            input=plant.input,
            output=plant.output,
            sampling_time=plant.sampling_time,
        )
    if plant.name == "linear1" and (physical or fixed):
        return _lag(plant, fixed)
    return OutputError(plant.order, plant.order - 1, input=plant.input, output=plant.output, stable=True)


def _lag(plant: Plant, fixed: tuple[str, ...]) -> Model:
    tau = _parameter("tau", plant.tau, "s", "tau" in fixed)
    gain = _parameter("K", plant.gain, "", "gain" in fixed)
    u, w = signal(plant.input)[t], signal("w")[t]
    line = Line(w, (gain.symbol * u - w) / tau.symbol, rate=True)
    measurements = (Measurement(plant.output, "w", "eta"),)
    return Model("first order lag", (tau, gain), (line,), measurements, sampling_time=plant.sampling_time)


def _parameter(name: str, value: float, unit: str, is_fixed: bool) -> Parameter:
    """Give a box of one point, or one of a factor ten around the value."""
    lower, upper = (value, value) if is_fixed else sorted((value / 10, value * 10))
    return Parameter(name, lower, upper, unit)


def _arm(plant: Plant) -> Model:
    """Give Newton's law, hybrid thesis, eq. 5.14, with a viscous term d unless the plant has none."""
    u, w, phi = signal(plant.input)[t], signal("w")[t], signal("phi")[t]
    theta = _parameter("theta", THETA, "1/(kg m2)", False)
    c = _parameter("c", TORQUE, "Nm/V", True)
    torque = c.symbol * u
    parameters: tuple[Parameter, ...] = (theta, c)
    if plant.name != "arm_free":
        viscous = Parameter("d", 0.01, 10.0, "Nm s/rad")
        torque, parameters = torque - viscous.symbol * w, (*parameters, viscous)
    lines: tuple[Line, ...] = (Line(w, theta.symbol * torque, rate=True),)
    if plant.name == "arm_angle":
        lines = (*lines, Line(phi, w, rate=True))
    measurements = (Measurement(plant.output, "phi" if plant.name == "arm_angle" else "w", "eta"),)
    return Model("rotating arm", parameters, lines, measurements, sampling_time=plant.sampling_time)
