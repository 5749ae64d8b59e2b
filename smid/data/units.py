"""Records in the units of others: a channel is converted where the units measure the same, and refused elsewhere."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from smid.data.channel import Channel
from smid.data.dataset import Dataset
from smid.data.errors import DataError
from smid.models.units import conversion

__all__ = ["factor_to", "in_units", "in_units_of"]


def factor_to(wanted: str, given: str, channel: str, who: str) -> float:
    """Return the number that converts a channel to another unit; 1 where one of them is not stated.

    Parameters
    ----------
    channel, who
        For the message: the channel's name, and who has the wanted unit, as in "the sensor was trained on records".

    Raises
    ------
    DataError
        If the units measure different things, or are not known.

    Examples
    --------
    >>> factor_to("bar", "kPa", "pressure", "run.csv has it"), factor_to("bar", "", "pressure", "run.csv has it")
    (0.01, 1.0)
    """
    if not given or not wanted:
        return 1.0
    found = conversion(given, wanted)
    if found is None:
        raise DataError(f"{channel} is in {given}, but {who} in {wanted}: convert the column, or correct its unit")
    return found


def in_units(data: Dataset, units: Mapping[str, str], who: str) -> Dataset:
    """Return records in other units; where the record or ``units`` states none, the samples stay as they are.

    Parameters
    ----------
    units
        By channel.
    who
        See `factor_to`.

    Raises
    ------
    DataError
        If a unit cannot be converted.

    Examples
    --------
    >>> data = Dataset.from_arrays(
    ...     input={"u": [1.0, 2]}, output={"y": [100.0, 250]}, units={"u": "mA", "y": "kPa"}, sampling_time=1.0
    ... )
    >>> found = in_units(data, {"y": "bar"}, "run.csv has it")
    >>> found.stacked("y"), str(found.channel("y")), str(found.channel("u"))
    (array([1. , 2.5]), 'y [bar]', 'u [mA]')
    """
    wanted = {c.name: units.get(c.name) or c.unit for c in data.channels}
    factors = {c.name: factor_to(wanted[c.name], c.unit, c.name, who) for c in data.channels}
    runs = data.experiments
    if any(factor != 1.0 for factor in factors.values()):
        runs = tuple(replace(run, values={name: factors[name] * x for name, x in run.values.items()}) for run in runs)
    return replace(data, experiments=runs, channels=tuple(Channel(name, unit) for name, unit in wanted.items()))


def in_units_of(data: Dataset, other: Dataset) -> Dataset:
    """Return records in the units of another data set.

    Raises
    ------
    DataError
        If a unit cannot be converted.

    Examples
    --------
    >>> samples = {"input": {"u": [1.0, 2]}, "output": {"y": [1.0, 2]}}
    >>> bar, mm = (Dataset.from_arrays(**samples, units={"y": unit}, sampling_time=1.0) for unit in ("bar", "mm"))
    >>> in_units_of(mm, bar)
    Traceback (most recent call last):
        ...
    smid.data.errors.DataError: y is in mm, but the other record has it in bar: convert the column, or correct its unit
    """
    who = f"{other.source or 'the other record'} has it"
    return in_units(data, {c.name: c.unit for c in other.channels}, who)
