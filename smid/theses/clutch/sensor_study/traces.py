"""Figures 5.2 to 5.29 of the thesis on the bundled records: measured and simulated positions.

Figures 5.1, 5.10 and 5.15 are drawings of structures. The "combined data sets" of a temperature are its ``step_a`` and
its ``ramp_a``, one after the other.

Reference: clutch thesis, figures 5.2 to 5.29.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.deadline import Progress
from smid.data.bundled import load_clutch
from smid.data.channel import name_hint
from smid.display.result import Part, Tabular
from smid.display.table import Table
from smid.models import ModelError
from smid.sensors import VirtualSensor
from smid.theses.clutch.sensor_study.sensors import train_thesis_sensors
from smid.theses.clutch.sensor_study.structures import Loader

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["THESIS_FIGURES", "SensorTraces", "sensor_traces"]

_COMBINED = {t: (f"{t}C_step_a", f"{t}C_ramp_a") for t in ("20", "60", "m20")}

THESIS_FIGURES: Mapping[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "5.2": (("CPX20",), ("20C_step_a",)),
    "5.3": (("CPX20",), ("60C_step_a",)),
    "5.4": (("CPX20",), ("m20C_step_a",)),
    "5.5": (("CPX60",), ("60C_step_a",)),
    "5.6": (("CPXm20",), ("m20C_step_a",)),
    "5.7": (("CPX20",), ("20C_step_b",)),
    "5.8": (("CPX20H",), ("20C_step_b",)),
    "5.9": (("CPX20",), _COMBINED["20"]),
    "5.11": (("CPX20 filtered",), _COMBINED["20"]),
    "5.12": (("CPX60 filtered",), _COMBINED["60"]),
    "5.13": (("CPXm20 filtered",), _COMBINED["m20"]),
    "5.14": ((), ("20C_step_a",)),
    "5.16": (("PX20",), ("20C_step_a",)),
    "5.17": (("PX60",), ("60C_step_a",)),
    "5.18": (("PXm20",), ("m20C_step_a",)),
    "5.19": (("PX20 enforced",), ("20C_step_a",)),
    "5.20": (("PX60 enforced",), ("60C_step_a",)),
    "5.21": (("PXm20 enforced",), ("m20C_step_a",)),
    "5.22": (("PX20 enforced",), _COMBINED["20"]),
    "5.23": (("PX60 enforced",), _COMBINED["60"]),
    "5.24": (("PXm20 enforced",), _COMBINED["m20"]),
    "5.25": (("PX20 enforced",), ("20C_ramp_a",)),
    "5.26": (("PX20H",), ("20C_step_b",)),
    "5.27": (("PX20 enforced", *(f"CFPX20 order {order}" for order in (5, 10, 20))), ("20C_step_a",)),
    "5.28": (("CFPX20 filtered",), ("20C_step_a",)),
    "5.29": (("CPX20 filtered", "PX20 enforced", "CFPX20 filtered"), ("20C_step_a",)),
}
"""Number to the sensors and the records; figure 5.14 is the curve of position over pressure."""


@dataclass(frozen=True, eq=False, repr=False)
class SensorTraces(Tabular):
    """The data of one figure, its records one after the other.

    Parameters
    ----------
    number
        Of the thesis's figure.
    time
        Shape (n,). In seconds from the start of the first record.
    pressure
        Shape (n,). Measured, in bar.
    measured
        Shape (n,). Position in mm.
    simulated
        Shape (n,). Position in mm by each sensor.
    """

    number: str
    records: tuple[str, ...]
    time: Array
    pressure: Array
    measured: Array
    simulated: Mapping[str, Array]

    @property
    def rmse(self) -> dict[str, float]:
        """Return the RMSE of each sensor, in mm."""
        return {name: float(np.sqrt(np.mean((x - self.measured) ** 2))) for name, x in self.simulated.items()}

    @property
    def table(self) -> Table:
        """Return the errors as text."""
        rows = tuple((name, f"{error:.4f}") for name, error in self.rmse.items())
        return Table(f"Figure {self.number}: {' and '.join(self.records)}.", ("sensor", "RMSE [mm]"), rows, "lr")

    def _content(self) -> Iterator[Part]:
        yield self.table

    def _rows(self) -> Iterator[dict[str, Any]]:
        return ({"sensor": name, "rmse": error} for name, error in self.rmse.items())

    def plot(self) -> Figure:
        """Draw position over time; figure 5.14 over pressure."""
        from smid.theses.clutch.sensor_study.figures import traces_figure

        return traces_figure(self)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "figure": self.number,
            "records": list(self.records),
            "time": self.time.tolist(),
            "pressure": self.pressure.tolist(),
            "measured": self.measured.tolist(),
            "simulated": {name: x.tolist() for name, x in self.simulated.items()},
            "rmse": self.rmse,
        }


def sensor_traces(
    number: str,
    sensors: Mapping[str, VirtualSensor] | None = None,
    seed: int = 1,
    progress: Progress | None = None,
    load: Loader = load_clutch,
) -> SensorTraces:
    """Return the data of one figure of chapter 5.

    Parameters
    ----------
    number
        Among `THESIS_FIGURES`.
    sensors
        Trained, from `train_thesis_sensors`; those that are missing are trained.
    load
        Returns the records of the names.

    Raises
    ------
    ModelError
        If there is no such figure.

    Examples
    --------
    >>> sensor_traces("5.14").measured.shape
    (5001,)
    """
    if number not in THESIS_FIGURES:
        raise ModelError(f"no figure {number!r}; {name_hint(number, THESIS_FIGURES)}")
    names, records = THESIS_FIGURES[number]
    given = dict(sensors or {})
    missing = tuple(name for name in names if name not in given)
    given |= train_thesis_sensors(missing, seed, progress, load)
    data = load(records)
    return SensorTraces(
        number=number,
        records=records,
        time=np.arange(data.n_samples, dtype=np.float64) * data.sampling_time,
        pressure=data.stacked("pressure"),
        measured=data.stacked("position"),
        simulated={name: np.concatenate(given[name].predict(data).position) for name in names},
    )
