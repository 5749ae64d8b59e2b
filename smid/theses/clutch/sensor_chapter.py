"""Chapter 5 of the thesis as a whole: its tables and figures, and the single sensor and the interval that it lacks."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from matplotlib.figure import Figure

from smid.display.result import Part, Result
from smid.theses.clutch.sensor_study import (
    THESIS_FIGURES,
    ErrorTable,
    IntervalStudy,
    SensorTraces,
    SingleSensorStudy,
    StructureTable,
    cross_errors,
    interval_study,
    sensor_traces,
    single_sensor_study,
    table_5_1,
    table_5_2,
    table_5_3,
    table_5_4,
    train_thesis_sensors,
)

__all__ = ["SensorChapter", "sensor_chapter"]


@dataclass(frozen=True, eq=False, repr=False)
class SensorChapter(Result):
    """All studies of the virtual sensors.

    Parameters
    ----------
    tables
        Tables 5.1 to 5.4.
    cross
        The thesis's sensors on every record.
    traces
        By number of the thesis's figure.
    single
        One sensor for all temperatures, with hysteresis.
    intervals
        Of its position.
    """

    tables: tuple[StructureTable, ...]
    cross: ErrorTable
    traces: Mapping[str, SensorTraces]
    single: SingleSensorStudy
    intervals: IntervalStudy

    def _content(self) -> Iterator[Part]:
        yield from (*self.tables, self.cross, self.single, self.intervals)

    def plot(self) -> Figure:
        """Draw the errors on the records that the single sensor has not seen."""
        return self.single.plot()

    def to_dict(self) -> dict[str, Any]:
        """Return plain data; of each figure its errors, not its curves."""
        return {
            "tables": [table.to_dict() for table in self.tables],
            "cross": self.cross.to_dict(),
            "figures": {number: traces.rmse for number, traces in self.traces.items()},
            "single_sensor": self.single.to_dict(),
            "intervals": self.intervals.to_dict(),
        }


def sensor_chapter(seed: int = 1, *, progress: Callable[[str], None] | None = None) -> SensorChapter:
    """Train and compare every sensor of chapter 5, and the one that the thesis asks for; it takes some minutes.

    Parameters
    ----------
    seed
        Of splits and starts.
    progress
        Called with a line of text now and then.

    References
    ----------
    Clutch thesis, chapter 5 and section 6.2.
    """
    tables = tuple(table(seed, report=progress) for table in (table_5_1, table_5_2, table_5_3, table_5_4))
    sensors = train_thesis_sensors(seed=seed, report=progress)
    single = single_sensor_study(seed=seed, report=progress)
    return SensorChapter(
        tables,
        cross_errors(sensors),
        {number: sensor_traces(number, sensors, seed) for number in THESIS_FIGURES},
        single,
        interval_study(single.sensor),
    )
