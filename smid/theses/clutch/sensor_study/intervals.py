"""Coverage and width of a sensor's error bound.

Each record that did not train the sensor is left out in turn. The bound is found from the others, widened by a margin,
and tested on it.

Reference: `smid.sensors.bounded`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from smid.data import Dataset
from smid.data.bundled import load_clutch
from smid.display.result import Part, Tabular
from smid.display.table import Table
from smid.sensors import BoundedSensor, IntervalPrediction, VirtualSensor, bound_error
from smid.theses.clutch.sensor_study.single_sensor import HELD_OUT

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["IntervalRow", "IntervalStudy", "interval_study"]

MARGINS = (0.0, 0.1, 0.2, 0.3)


@dataclass(frozen=True)
class IntervalRow:
    """One record that the bound was not found from.

    Parameters
    ----------
    margin
        Relative increase of the bound.
    coverage
        Share of the record's positions inside.
    mean_width
        In mm.

    Examples
    --------
    >>> IntervalRow("20C_ramp_b", margin=0.1, coverage=0.99, mean_width=0.4).coverage
    0.99
    """

    record: str
    margin: float
    coverage: float
    mean_width: float


@dataclass(frozen=True, eq=False, repr=False)
class IntervalStudy(Tabular):
    """The error bound of a sensor, with the results for each record that was left out.

    Parameters
    ----------
    sensor
        With the bound from all records and the default margin.
    rows
        A row for each record and margin.
    """

    sensor: BoundedSensor
    rows: tuple[IntervalRow, ...]
    data: Dataset

    @property
    def table(self) -> Table:
        """Return coverage and width as text."""
        margins = sorted({row.margin for row in self.rows})
        header = ("left out", *(f"+{100 * margin:.0f} %" for margin in margins))
        cells = {
            (row.record, row.margin): f"{100 * row.coverage:.2f} % in {row.mean_width:.2f} mm" for row in self.rows
        }
        records = dict.fromkeys(row.record for row in self.rows)
        return Table(
            "Coverage and mean width on a record that neither trained the sensor nor gave the bound, by margin.",
            header,
            tuple((record, *(cells[record, margin] for margin in margins)) for record in records),
            "l" + "r" * len(margins),
        )

    @property
    def conclusion(self) -> str:
        """Return the coverage at the default margin in a few sentences."""
        chosen = [row for row in self.rows if row.margin == self.sensor.margin]
        return (
            f"With the margin of {100 * self.sensor.margin:.0f} %, at least "
            f"{100 * min(row.coverage for row in chosen):.2f} % of a left-out record lies inside the interval, and "
            f"{100 * sum(row.coverage for row in chosen) / len(chosen):.3f} % on average. The mean width is "
            f"{sum(row.mean_width for row in chosen) / len(chosen):.2f} mm. If samples were independent, at most "
            f"{100 * self.sensor.violation:.3f} % would exceed the bound without margin."
        )

    def _content(self) -> Iterator[Part]:
        yield self.table
        yield self.conclusion

    def _rows(self) -> Iterator[dict[str, Any]]:
        return (dict(vars(row)) for row in self.rows)

    def predictions(self) -> IntervalPrediction:
        """Return the intervals of the records, with the bound from all of them."""
        return self.sensor.predict(self.data)

    def plot(self) -> Figure:
        """Draw a part of each record with its interval."""
        from smid.theses.clutch.sensor_study.figures import interval_figure

        return interval_figure(self)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {"margin": self.sensor.margin, "rows": list(self._rows())}


def interval_study(sensor: VirtualSensor, records: Sequence[str] = HELD_OUT) -> IntervalStudy:
    """Test the error bound of a sensor on records that are left out in turn.

    Parameters
    ----------
    sensor
        Trained on other records.
    records
        Two or more records of the actuator.

    Examples
    --------
    >>> from smid.sensors import CFPX
    >>> sensor = CFPX(10).fit(load_clutch("20C_ramp_a"), seed=1)
    >>> study = interval_study(sensor, ["20C_ramp_b", "20C_step_b"])
    >>> len(study.rows), study.sensor.n_samples
    (8, 10002)
    """
    rows = []
    for left_out in records:
        bound = bound_error(sensor, load_clutch([name for name in records if name != left_out]))
        data = load_clutch(left_out)
        for margin in MARGINS:
            said = replace(bound, margin=margin).predict(data)
            rows.append(IntervalRow(left_out, margin, said.coverage(data)[left_out], said.mean_width))
    data = load_clutch(records)
    return IntervalStudy(bound_error(sensor, data), tuple(rows), data)
