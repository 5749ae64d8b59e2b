"""Free runs of several models over the same records."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from smid.data import Dataset
from smid.display.result import Part, Tabular
from smid.display.table import Table
from smid.models import Model, ModelError
from smid.validation import Validation, validate

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["FreeRuns", "free_runs"]


@dataclass(frozen=True, eq=False, repr=False)
class FreeRuns(Tabular):
    """Free runs by the name of the model, all over the same records."""

    validations: Mapping[str, Validation]

    @property
    def data(self) -> Dataset:
        """Return the records."""
        return next(iter(self.validations.values())).data

    @property
    def records(self) -> tuple[str, ...]:
        """Return the names of the records."""
        return tuple(run.name for run in self.data.experiments)

    def rmse(self, model: str) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        """Return the RMSE of a model on each record, in the output's unit, shape (n_records,)."""
        return np.array([score.rmse for score in self.validations[model].scores])

    @property
    def table(self) -> Table:
        """Return a row per record and a column per model."""
        columns = [self.rmse(name) for name in self.validations]
        rows = tuple((record, *(f"{column[k]:.3f}" for column in columns)) for k, record in enumerate(self.records))
        unit = self.data.channel(self.data.output).unit
        header = ("record", *self.validations)
        return Table(f"RMSE of the free runs [{unit}].", header, rows, "l" + "r" * len(columns))

    def _content(self) -> Iterator[Part]:
        yield self.table

    def _rows(self) -> Iterator[dict[str, Any]]:
        """Return a row for each model and record."""
        for name, validation in self.validations.items():
            yield from ({"model": name, **row} for row in validation._rows())

    def plot(self) -> Figure:
        """Draw the RMSE of every model on every record."""
        from smid.theses.clutch.hammerstein.figures import free_runs_figure

        return free_runs_figure(self)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {name: validation.to_dict() for name, validation in self.validations.items()}


def free_runs(models: Mapping[str, Model], records: Dataset, noise_bound: float | None = None) -> FreeRuns:
    """Return free runs of models over records; ModelError if there is no model."""
    if not models:
        raise ModelError("there is nothing to simulate: give at least one model")
    return FreeRuns({name: validate(model, records, noise_bound) for name, model in models.items()})
