"""Names for the parameters and signals that an effect adds, free however often the effect is applied."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace

from smid.models import Measurement, Model, Parameter
from smid.models.chains import signal_of
from smid.models.edit_lines import free_name

__all__ = ["find", "free_name", "fresh", "quantity", "read_channel", "signal_of"]


def fresh(model: Model, wanted: str, box: tuple[float, float], unit: str = "", null: float | None = None) -> Parameter:
    """Return a parameter with a free name.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> fresh(OutputError(), "gap", (0, 2), "A", 0.0)
    Parameter(name='gap', lower=0.0, upper=2.0, unit='A', null=0.0)
    """
    return Parameter(free_name(model, wanted), float(box[0]), float(box[1]), unit, null)


def find(values: Mapping[str, float], stem: str) -> float | None:
    """Return the value whose name is the stem, or ends in it, either with or without a number.

    For names that the effect chose. A name that holds one of the user's is given to `Extension.describe` instead.

    Examples
    --------
    >>> find({"gap2": 0.5}, "gap"), find({"gap2": 0.5}, "upper")
    (0.5, None)
    """
    for name, value in values.items():
        if re.fullmatch(rf"(.*_)?{re.escape(stem)}\d*", name):
            return value
    return None


def read_channel(model: Model, channel: str) -> tuple[Model, str]:
    """Return the model and the signal under which its lines can read a channel of the data.

    A channel with the name of a parameter is measured as a signal of another name.
    """
    name = signal_of(model, channel)
    if name not in {p.name for p in model.parameters}:
        return model, name
    name = free_name(model, channel)
    return replace(model, measurements=(*model.measurements, Measurement(channel, name, None))), name


def quantity(value: float, unit: str = "", signed: bool = False) -> str:
    """Return a value with three digits and its unit.

    Examples
    --------
    >>> quantity(0.31415, "A")
    '0.314 A'
    >>> quantity(0.4213, "bar", signed=True)
    '+0.421 bar'
    """
    return f"{value:{'+' if signed else ''}.3g} {unit}".rstrip()
