"""Read the sensors and the records that the user names."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from smid.cli.loading import load_named
from smid.cli.options import Columns, Reading, group, option
from smid.data import DataError, Dataset
from smid.reports import load
from smid.reports.chapter import together
from smid.sensors import BoundedSensor, VirtualSensor

__all__ = ["SensorColumns", "load_records", "load_sensor"]


@dataclass(frozen=True)
class SensorColumns:
    """The time stamps of records whose other columns are those of the sensor."""

    sampling_time: float | None = option(
        type=float, metavar="S", help="Sampling time in seconds. [default: that of the sensor, or from the time stamps]"
    )
    time: str | None = option(
        metavar="COL", help="Column of time stamps. [default: the column named time, or the only one of dates]"
    )
    reading: Reading = group(Reading)


def load_sensor(path: str) -> BoundedSensor:
    """Return the sensor in a file that ``smid sensor train --save`` wrote; DataError for any other file."""
    found = load(path)
    if isinstance(found, VirtualSensor):
        raise DataError(
            f"{path} holds a sensor without error bound: give one that smid sensor train wrote, or use bound_error"
        )
    if not isinstance(found, BoundedSensor):
        raise DataError(f"{path} holds a {type(found).__name__}: give a sensor that smid sensor train --save wrote")
    return found


def load_records(paths: Sequence[str], columns: Columns, channels: Sequence[str]) -> Dataset:
    """Return records of the same channels as one data set, each under the name of its file, without gaps."""
    records = load_named(paths, columns, channels=channels)
    return together({name: data.without_gaps() for name, data in records.items()})
