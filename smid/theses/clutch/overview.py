"""Overview of the bundled records of the whole actuator.

Reference: clutch thesis, sections 3.1 and 5.1.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from smid.data import Dataset
from smid.data.bundled import load_clutch
from smid.display.result import Tabular
from smid.display.table import Table
from smid.theses.chapter import Chapter, Drawing, Topic

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["RecordOverview", "record_overview"]

RANGED = ("current", "pressure", "position")


@dataclass(frozen=True, eq=False, repr=False)
class RecordOverview(Chapter, Tabular):
    """The records of the actuator, with the channels of `smid.data.bundled.load_clutch`."""

    title = "Clutch: the simulated records"
    command = "clutch records"
    not_compared = (
        "The thesis's records are confidential and its figures are normalised. Our records have the names of its data "
        "sets. The profiles of their current, and all sizes between pressure and position, are our assumptions.",
    )

    data: Dataset

    @property
    def conclusion(self) -> str:
        """Return the number of records and their channels."""
        return (
            f"{len(self.data.experiments)} records of current, pressure, position and temperature. All are simulated."
        )

    def topics(self) -> Iterator[Topic]:
        """Return the only section: the table and the figure."""
        caption = "Current, pressure and position of each record, in percent of the largest value."
        yield Topic("Records", self.table, Drawing(self.plot, caption))

    def records(self) -> Dataset:
        """Return the records."""
        return self.data

    @property
    def rows(self) -> tuple[dict[str, Any], ...]:
        """Return a row per record: name, degC, samples, seconds, and the ranges of current, pressure and position."""
        return tuple(
            {
                "record": run.name,
                "temperature": float(run.values["temperature"].mean()),
                "samples": run.n_samples,
                "seconds": (run.n_samples - 1) * self.data.sampling_time,
                **{name: [float(run.values[name].min()), float(run.values[name].max())] for name in RANGED},
            }
            for run in self.data.experiments
        )

    @property
    def table(self) -> Table:
        """Return the rows as text."""
        header = ("record", "degC", "samples", "seconds", *(str(self.data.channel(name)) for name in RANGED))
        cells = tuple(
            (
                row["record"],
                f"{row['temperature']:.0f}",
                str(row["samples"]),
                f"{row['seconds']:g}",
                *(f"{row[name][0]:.3g} to {row[name][1]:.3g}" for name in RANGED),
            )
            for row in self.rows
        )
        return Table("Simulated records of the clutch actuator.", header, cells, "lrrrrrr")

    def _rows(self) -> Iterator[dict[str, Any]]:
        for row in self.rows:
            numbers = {name: value for name, value in row.items() if name not in RANGED}
            yield numbers | {f"{n} {word}": row[n][k] for n in RANGED for k, word in enumerate(("from", "to"))}

    def plot(self) -> Figure:
        """Draw current, pressure and position of each record."""
        from smid.theses.clutch.overview_figure import overview_figure

        return overview_figure(self.data)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {"records": list(self.rows)}


def record_overview() -> RecordOverview:
    """Return the overview of the bundled records.

    Examples
    --------
    >>> len(record_overview().rows)
    11
    """
    return RecordOverview(load_clutch())
