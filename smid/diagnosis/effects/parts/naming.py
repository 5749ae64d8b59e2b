"""Names of what an effect brings in, free however often it is applied, and how a description finds them again."""

from __future__ import annotations

import re
from collections.abc import Mapping

from smid.models import Model, Parameter

__all__ = ["find", "free_name", "fresh", "is_brought", "is_helper", "quantity"]

_HELPERS = (
    *("time", "play", "stop", "slew", "gone", "mean", "lag", "mode", "pair", "memory", "direction", "step"),
    *("effective", "limited", "curved", "delayed", "joined"),
)
_BROUGHT = (
    *("dead_zone", "input_limit", "backlash", "input_curve", "delay_samples", "slew_time", "factor", "power"),
    *("with", "change", "drift", "directional", "friction", "damping", "drag", "missing", "overflow", "bias"),
)


def free_name(model: Model, wanted: str) -> str:
    """Give a name that stands for nothing in the model yet: the wanted one, numbered from 2 where it is taken.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> free_name(OutputError(), "gap"), free_name(OutputError(), "w")
    ('gap', 'w2')
    """
    taken = {*model.inputs, *model.channels, *(line.signal for line in model.lines)}
    taken |= {parameter.name for parameter in model.parameters}
    taken |= {measurement.noise for measurement in model.measurements if measurement.noise}
    name, count = wanted, 1
    while name in taken:
        count += 1
        name = f"{wanted}{count}"
    return name


def fresh(model: Model, wanted: str, box: tuple[float, float], unit: str = "", null: float | None = None) -> Parameter:
    """Give a parameter with a free name.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> fresh(OutputError(), "gap", (0, 2), "A", 0.0)
    Parameter(name='gap', lower=0.0, upper=2.0, unit='A', null=0.0)
    """
    return Parameter(free_name(model, wanted), float(box[0]), float(box[1]), unit, null)


def is_helper(signal: str) -> bool:
    """Tell whether an effect made this signal, by its name: a lag at the sensor is no part of the plant.

    Examples
    --------
    >>> is_helper("u_play2"), is_helper("w")
    (True, False)
    """
    return re.search(rf"(^|_)({'|'.join(_HELPERS)})\d*$", signal) is not None


def is_brought(parameter: str) -> bool:
    """Tell whether an effect brought in this parameter, by its name: what changes with time is the plant's own.

    Examples
    --------
    >>> is_brought("a1_drift"), is_brought("tau")
    (True, False)
    """
    return re.search(rf"(^|_)({'|'.join(_BROUGHT)})(_|\d*$)", parameter) is not None


def find(values: Mapping[str, float], stem: str) -> float | None:
    """Find the value whose name is the stem, or ends in it, or either with a number behind.

    Examples
    --------
    >>> find({"gap2": 0.5}, "gap"), find({"gap2": 0.5}, "upper")
    (0.5, None)
    """
    for name, value in values.items():
        if re.fullmatch(rf"(.*_)?{re.escape(stem)}\d*", name):
            return value
    return None


def signal_of(model: Model, channel: str) -> str:
    """Name the signal that a channel shows; an input taken as exact is its own."""
    return next((m.signal for m in model.measurements if m.channel == channel), channel)


def quantity(value: float, unit: str = "", signed: bool = False) -> str:
    """Write a value with three digits and its unit.

    Examples
    --------
    >>> quantity(0.31415, "A")
    '0.314 A'
    >>> quantity(0.4213, "bar", signed=True)
    '+0.421 bar'
    """
    return f"{value:{'+' if signed else ''}.3g} {unit}".rstrip()
