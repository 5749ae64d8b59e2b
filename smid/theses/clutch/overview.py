"""The bundled records at a glance."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from matplotlib.figure import Figure

from smid.data import Dataset
from smid.data.bundled import load_clutch
from smid.display.result import Part, Tabular
from smid.display.table import Table

__all__ = ["RecordOverview", "record_overview"]


@dataclass(frozen=True, eq=False, repr=False)
class RecordOverview(Tabular):
    """Records of the actuator, a row for each.

    Parameters
    ----------
    data
        With the channels of `smid.theses.clutch.load_clutch`.
    """

    data: Dataset

    @property
    def rows(self) -> tuple[dict[str, Any], ...]:
        """Name, temperature in degC, samples, seconds and the ranges of current, pressure and position."""
        ranged = ("current", "pressure", "position")
        return tuple(
            {
                "record": run.name,
                "temperature": float(run.values["temperature"].mean()),
                "samples": run.n_samples,
                "seconds": (run.n_samples - 1) * self.data.sampling_time,
                **{name: [float(run.values[name].min()), float(run.values[name].max())] for name in ranged},
            }
            for run in self.data.experiments
        )

    @property
    def table(self) -> Table:
        """Return the rows as text."""
        ranged = ("current", "pressure", "position")
        header = ("record", "degC", "samples", "seconds", *(str(self.data.channel(name)) for name in ranged))
        cells = tuple(
            (
                row["record"],
                f"{row['temperature']:.0f}",
                str(row["samples"]),
                f"{row['seconds']:g}",
                *(f"{row[name][0]:.3g} to {row[name][1]:.3g}" for name in ranged),
            )
            for row in self.rows
        )
        return Table("Simulated records of the clutch actuator.", header, cells, "lrrrrrr")

    def _content(self) -> Iterator[Part]:
        yield self.table

    def _rows(self) -> Iterator[dict[str, Any]]:
        for row in self.rows:
            numbers = {name: value for name, value in row.items() if not isinstance(value, list)}
            ends = [(name, value) for name, value in row.items() if isinstance(value, list)]
            yield numbers | {
                f"{name} {k}": end for name, pair in ends for k, end in zip(("from", "to"), pair, strict=True)
            }

    def plot(self) -> Figure:
        """Draw current, pressure and position of each record."""
        from smid.theses.clutch.overview_figure import overview_figure

        return overview_figure(self.data)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {"records": list(self.rows)}


def record_overview() -> RecordOverview:
    """Give the bundled records at a glance.

    Examples
    --------
    >>> len(record_overview().rows)
    11

    References
    ----------
    Clutch thesis, sections 3.1 and 5.1.
    """
    return RecordOverview(load_clutch())
