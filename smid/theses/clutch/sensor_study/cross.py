"""Errors of every sensor of chapter 5 on every record, at all temperatures, with and without hysteresis.

Reference: clutch thesis, 5.2.3, 5.2.5 and 5.3.5.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data import Dataset
from smid.data.bundled import load_clutch
from smid.display.result import Part, Tabular
from smid.display.table import Table
from smid.models import ModelError
from smid.sensors import VirtualSensor

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["ErrorTable", "cross_errors"]


@dataclass(frozen=True, eq=False, repr=False)
class ErrorTable(Tabular):
    """Errors of sensors on records.

    Parameters
    ----------
    rmse
        Shape (records, sensors). In mm.
    """

    caption: str
    sensors: tuple[str, ...]
    records: tuple[str, ...]
    rmse: Array

    @property
    def table(self) -> Table:
        """Return the errors as text, with the longer list, sensors or records, in the rows."""
        first, down, across, errors = "record", self.records, self.sensors, self.rmse
        if len(across) > len(down):
            first, down, across, errors = "sensor", across, down, errors.T
        rows = tuple((name, *(f"{error:.3f}" for error in row)) for name, row in zip(down, errors, strict=True))
        return Table(self.caption, (first, *across), rows, "l" + "r" * len(across))

    def only(self, sensors: Sequence[str]) -> ErrorTable:
        """Return the errors of some of the sensors."""
        places = [self.sensors.index(name) for name in sensors]
        return ErrorTable(self.caption, tuple(sensors), self.records, self.rmse[:, places])

    def _content(self) -> Iterator[Part]:
        yield self.table

    def _rows(self) -> Iterator[dict[str, Any]]:
        for record, errors in zip(self.records, self.rmse.tolist(), strict=True):
            for sensor, rmse in zip(self.sensors, errors, strict=True):
                yield {"record": record, "sensor": sensor, "rmse": rmse}

    def plot(self) -> Figure:
        """Draw the errors as shades."""
        from smid.theses.clutch.sensor_study.figures import error_figure

        return error_figure(self)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {"sensors": list(self.sensors), "records": list(self.records), "rmse": self.rmse.tolist()}


def cross_errors(
    sensors: Mapping[str, VirtualSensor],
    data: Dataset | None = None,
    caption: str = "RMSE of each sensor on each record, in mm.",
) -> ErrorTable:
    """Return the errors of trained sensors on records.

    Parameters
    ----------
    data
        With the position; by default all records of the actuator.

    Raises
    ------
    ModelError
        If there is no sensor, or one is not trained.

    Examples
    --------
    >>> from smid.sensors import CFPX
    >>> sensor = CFPX(5).fit(load_clutch("20C_step_a"), seed=1)
    >>> cross_errors({"CFPX": sensor}).rmse.shape
    (11, 1)
    """
    if not sensors:
        raise ModelError("no sensor is given: give one or more, trained")
    data = load_clutch() if data is None else data
    columns = [list(sensor.predict(data).rmse(data).values()) for sensor in sensors.values()]
    return ErrorTable(caption, tuple(sensors), tuple(run.name for run in data.experiments), np.array(columns).T)
