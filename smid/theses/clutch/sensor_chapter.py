"""Chapter 5 of the thesis: virtual sensors of the position, their tables and figures, one sensor for all temperatures.

Reference: clutch thesis, chapter 5 and section 6.2.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from relaxations.deadline import Progress
from smid.data import Dataset
from smid.data.bundled import load_clutch
from smid.display.table import Table
from smid.theses.chapter import Chapter, Drawing, Topic
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

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["SensorChapter", "sensor_chapter"]


@dataclass(frozen=True, eq=False, repr=False)
class SensorChapter(Chapter):
    """All studies of the virtual sensors.

    Parameters
    ----------
    tables
        Tables 5.1 to 5.4.
    cross
        The thesis's sensors on every record.
    traces
        By number of the thesis's figure.
    intervals
        Of the position that the single sensor predicts.
    """

    title = "Clutch, chapter 5: virtual sensors of the position"
    command = "clutch sensors"
    not_compared = (
        "The thesis's records are confidential. Its positions and errors are normalised by a scale that it does not "
        "state. Ours are in mm, on simulated records with assumed sizes between pressure and position. Only the ratios "
        "of errors within a table can be compared.",
        "The thesis does not state the size of the hysteresis, nor the duration of its steps. Ours last about 0.25 s. "
        "A median over 250 samples, 0.5 s, removes such steps. CFPX with that filter is poor here; this says nothing "
        "about the thesis's sensor.",
        "The thesis does not print the thresholds of its dead zones. Ours are found from the records.",
        "The thesis computes its errors on whole records, of which 70 % trained the sensor. So do we in tables 5.1 to "
        "5.4. The single sensor is tested on held-out records.",
    )

    tables: tuple[StructureTable, ...]
    cross: ErrorTable
    traces: Mapping[str, SensorTraces]
    single: SingleSensorStudy
    intervals: IntervalStudy

    @property
    def conclusion(self) -> str:
        """Return the results of the single sensor and of its intervals."""
        return f"{self.single.conclusion} {self.intervals.conclusion}"

    def records(self) -> Dataset:
        """Return all bundled records."""
        return load_clutch()

    def topics(self) -> Iterator[Topic]:
        """Return the thesis's tables and figures, then the single sensor and its intervals."""
        for table in self.tables:
            caption = f"Errors of table {table.number}, ours and the thesis's, each divided by its first error."
            yield Topic(f"Table {table.number}: {table.subject}", table, Drawing(table.plot, caption))
        plain, treated = (
            self.cross.only([name for name in self.cross.sensors if (" " in name) == named]) for named in (False, True)
        )
        yield Topic(
            "Temperature and hysteresis",
            "A sensor trained at one temperature has large errors at other temperatures. A sensor trained without "
            "hysteresis has large errors on the records with hysteresis: 20C_step_b, 60C_step_c and m20C_step_c.",
            self.cross,
            Drawing(plain.plot, "The sensors without filter, on every record."),
            Drawing(treated.plot, "With median filter or dead zone, on every record."),
        )
        yield Topic(
            "Figures 5.2 to 5.29",
            "Figures 5.1, 5.10 and 5.15 of the thesis are drawings of structures.",
            self._figure_errors(),
            *(
                Drawing(
                    traces.plot,
                    f"Figure {number}: {', '.join(traces.simulated) or 'position over pressure'}; "
                    f"{', '.join(traces.records)}.",
                )
                for number, traces in self.traces.items()
            ),
        )
        yield Topic(
            "One sensor for all temperatures, with hysteresis",
            "It reads pressure and temperature. Play operators, whose thresholds are trained, give the branch of the "
            "loop.",
            self.single,
            Drawing(self.single.plot, "Errors on the held-out records, by sensor."),
        )
        yield Topic(
            "An interval for the position",
            self.intervals,
            Drawing(self.intervals.plot, "A part of each held-out record with its interval."),
        )

    def _figure_errors(self) -> Table:
        rows = tuple(
            (number, name, ", ".join(traces.records), f"{error:.3f}")
            for number, traces in self.traces.items()
            for name, error in traces.rmse.items()
        )
        return Table("RMSE of each figure's sensors [mm].", ("figure", "sensor", "records", "RMSE"), rows, "lllr")

    def plot(self) -> Figure:
        """Draw the errors on the held-out records of the single sensor."""
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


def sensor_chapter(seed: int = 1, *, progress: Progress | None = None) -> SensorChapter:
    """Train and compare every sensor of chapter 5, and the single sensor; it takes some minutes."""
    tables = tuple(table(seed, progress=progress) for table in (table_5_1, table_5_2, table_5_3, table_5_4))
    sensors = train_thesis_sensors(seed=seed, progress=progress)
    single = single_sensor_study(seed=seed, progress=progress)
    return SensorChapter(
        tables,
        cross_errors(sensors),
        {number: sensor_traces(number, sensors, seed) for number in THESIS_FIGURES},
        single,
        interval_study(single.sensor),
    )
