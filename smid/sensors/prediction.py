"""The computed positions of records, and their errors."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data import DataError, Dataset
from smid.display.result import Part, Result
from smid.display.table import Table

__all__ = ["Prediction"]


@dataclass(frozen=True, eq=False, repr=False)
class Prediction(Result):
    """Computed positions of records.

    Parameters
    ----------
    records
        Names of the records.
    position
        Shape (n,). In mm, one array per record.
    warnings
        Limits of the answer, such as a temperature outside the trained range.

    Examples
    --------
    >>> float(Prediction(("20C_ramp_b",), (np.array([1.0, 1.5]),)).position[0].max())
    1.5
    """

    records: tuple[str, ...]
    position: tuple[Array, ...]
    warnings: tuple[str, ...] = ()

    def _content(self) -> Iterator[Part]:
        rows = tuple(
            (name, str(x.size), f"{x.min():.4g} to {x.max():.4g}")
            for name, x in zip(self.records, self.position, strict=True)
        )
        yield Table("Computed positions.", ("record", "samples", "position [mm]"), rows, "lrr")
        yield from self.warnings

    def residuals(self, data: Dataset) -> tuple[Array, ...]:
        """Return measured minus computed positions in mm, one array per record, without the warm-up samples.

        Raises
        ------
        DataError
            If there is no position, or the records are not those of the prediction.
        """
        if "position" not in data.names:
            raise DataError("the records have no channel 'position' to compare with: give records that have it")
        if tuple((run.name, run.n_samples) for run in data.experiments) != tuple(
            (name, x.size) for name, x in zip(self.records, self.position, strict=True)
        ):
            raise DataError("the records are not those of the prediction: give the data set that was predicted")
        pairs = zip(data.experiments, self.position, strict=True)
        return tuple((run.values["position"] - x)[data.n_init :] for run, x in pairs)

    def mse(self, data: Dataset) -> float:
        """Return the mean squared error over all records, in mm^2."""
        return float(np.mean(np.concatenate(self.residuals(data)) ** 2))

    def rmse(self, data: Dataset) -> dict[str, float]:
        """Return the root mean squared error of each record, in mm."""
        residuals = self.residuals(data)
        return {name: float(np.sqrt(np.mean(e**2))) for name, e in zip(self.records, residuals, strict=True)}
