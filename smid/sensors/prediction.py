"""The computed positions of records, and their errors."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data import Channel, DataError, Dataset
from smid.display.result import Part, Result
from smid.display.table import Table
from smid.sensors.trained_on import Signal

__all__ = ["Prediction"]


@dataclass(frozen=True, eq=False, repr=False)
class Prediction(Result):
    """Computed positions of records.

    Parameters
    ----------
    output
        The channel that was computed.
    records
        Names of the records.
    position
        Shape (n,). In the unit of the output, one array per record.
    warnings
        Limits of the answer, such as a temperature outside the trained range.

    Examples
    --------
    >>> from smid.sensors import CFPX
    >>> from smid.data.bundled import load_clutch
    >>> data = load_clutch("20C_ramp_b")
    >>> CFPX(10).fit(data, seed=1).predict(data).position[0].shape
    (5001,)
    """

    output: Signal
    records: tuple[str, ...]
    position: tuple[Array, ...]
    warnings: tuple[str, ...] = ()

    def _content(self) -> Iterator[Part]:
        rows = tuple(
            (name, str(x.size), f"{x.min():.4g} to {x.max():.4g}")
            for name, x in zip(self.records, self.position, strict=True)
        )
        shown = str(Channel(self.output.name, self.output.unit))
        yield Table("Computed by the sensor.", ("record", "samples", shown), rows, "lrr")
        yield from self.warnings

    def measured(self, data: Dataset) -> tuple[Array, ...]:
        """Return the measured output of records, in the unit of the sensor, one array per record.

        Raises
        ------
        DataError
            If there is no such channel, its unit does not match, or the records are not those of the prediction.
        """
        name = self.output.name
        if name not in data.names:
            raise DataError(f"the records have no channel {name!r} to compare with: give records that have it")
        if tuple((run.name, run.n_samples) for run in data.experiments) != tuple(
            (name, x.size) for name, x in zip(self.records, self.position, strict=True)
        ):
            raise DataError("the records are not those of the prediction: give the data set that was predicted")
        factor = self.output.factor(data.channel(name).unit)
        return tuple(factor * run.values[name] for run in data.experiments)

    def residuals(self, data: Dataset) -> tuple[Array, ...]:
        """Return measured minus computed positions, one array per record, without the warm-up samples.

        Raises
        ------
        DataError
            As `measured`.
        """
        pairs = zip(self.measured(data), self.position, strict=True)
        return tuple((y - x)[data.n_init :] for y, x in pairs)

    def mse(self, data: Dataset) -> float:
        """Return the mean squared error over all records, in the squared unit of the output."""
        return float(np.mean(np.concatenate(self.residuals(data)) ** 2))

    def rmse(self, data: Dataset) -> dict[str, float]:
        """Return the root mean squared error of each record, in the unit of the output."""
        residuals = self.residuals(data)
        return {name: float(np.sqrt(np.mean(e**2))) for name, e in zip(self.records, residuals, strict=True)}
