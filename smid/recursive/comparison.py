"""Comparison of several recursive estimators."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from smid.data import Dataset
from smid.display.result import Part, Tabular
from smid.display.table import Table, figure
from smid.models import ModelError
from smid.recursive.arx import Arx
from smid.recursive.method import Method
from smid.recursive.tracking import Tracking, track

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Comparison", "compare"]


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Tabular):
    """The three errors of several estimators on one or more records, all in the same unit."""

    trackings: tuple[Tracking, ...]

    @property
    def table(self) -> Table:
        """Return a row for each run."""
        unit = f", RMSE [{self.trackings[0].unit}]" if self.trackings[0].unit else ", RMSE"
        header = ("record", "model", "method", "a posteriori", "one step", "free run", "held", "remarks")
        rows = tuple(
            (
                t.record,
                str(t.arx),
                str(t.method),
                *(figure(residual.rmse) for residual in (*t.residuals.values(), t.held)),
                "; ".join(t.remarks),
            )
            for t in self.trackings
        )
        return Table(f"{len(rows)} runs{unit}", header, rows, "lllrrrrl")

    def _content(self) -> Iterator[Part]:
        yield self.table

    def _rows(self) -> Iterator[dict[str, Any]]:
        for t in self.trackings:
            errors = {name: residual.rmse for name, residual in {**t.residuals, "held": t.held}.items()}
            yield {"record": t.record, "model": str(t.arx), "method": str(t.method), **errors}

    def plot(self) -> Figure:
        """Draw the three errors of every method on every record, on one logarithmic scale."""
        from smid.recursive.figures import comparison_figure

        return comparison_figure(self)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {"trackings": [tracking.to_dict() for tracking in self.trackings]}


def compare(models: Sequence[Arx], methods: Sequence[Method], data: Dataset) -> Comparison:
    """Return the results of every method with every model on every run of the data.

    The results are sorted by run, then by model, then by method.

    Parameters
    ----------
    data
        With one input and one output.

    Raises
    ------
    ModelError, DataError
        As `track` does, and if there is no model or no method.

    Examples
    --------
    >>> from smid.recursive import ForgettingFactor, NormalisedGradient
    >>> data = Dataset.from_arrays(input=[1, 0, 2, 1], output=[0, 1, 0.5, 2.2], sampling_time=1)
    >>> len(compare([Arx()], [ForgettingFactor(), NormalisedGradient()], data).trackings)
    2
    """
    if not models or not methods:
        raise ModelError("there is nothing to compare: give at least one model and one method")
    return Comparison(
        tuple(
            track(arx, method, data, experiment=experiment)
            for experiment in range(len(data.experiments))
            for arx in models
            for method in methods
        )
    )
