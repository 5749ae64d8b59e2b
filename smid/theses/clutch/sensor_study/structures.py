"""Tables 5.1 to 5.4 of the thesis on simulated records: the errors of sensor structures.

The thesis's errors are of normalised, confidential data. Only their ratios can be compared with ours, which are in mm^2
on simulated records. Each error is over the whole record that trained the sensor, as in the thesis.

Reference: clutch thesis, tables 5.1 to 5.4.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from relaxations.deadline import Progress
from smid.data import Dataset
from smid.data.bundled import load_clutch
from smid.display.result import Part, Tabular
from smid.display.table import Table
from smid.sensors import CFPX, CPX, PX, DeadZone, MedianFiltered, VirtualSensor

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Loader", "StructureRow", "StructureTable", "table_5_1", "table_5_2", "table_5_3", "table_5_4"]

Loader = Callable[[str | Sequence[str]], Dataset]

CPX_PRINTED = {
    (2,): 0.098,
    (5,): 0.029,
    (10,): 0.016,
    (20,): 0.016,
    (100,): 0.022,
    (10, 5): 0.012,
    (10, 10): 0.012,
    (10, 10, 10): 0.011,
    (15, 5, 15): 0.011,
}
PX_PRINTED = {
    (2,): 0.06,
    (5,): 0.04,
    (10,): 0.039,
    (20,): 0.039,
    (100,): 0.038,
    (10, 5): 0.038,
    (10, 10): 0.038,
    (10, 10, 10): 0.037,
    (15, 10, 15): 0.037,
}
CFPX_PRINTED = {5: 0.2458, 10: 0.0821, 20: 0.0431, 50: 0.0420, 100: 0.0419}
FINAL_PRINTED = {"CPX20": 0.0156, "PX20": 0.0387, "CFPX20": 0.0491}
CPX_ORDER, CFPX_ORDER = 50, 250


@dataclass(frozen=True)
class StructureRow:
    """One sensor of a table.

    Parameters
    ----------
    name
        Its structure.
    n_parameters
        Number of trained parameters.
    mse
        Mean squared error on our record, in mm^2.
    printed
        Mean squared error that the thesis prints, of normalised data.

    Examples
    --------
    >>> StructureRow("CPX20", n_parameters=121, mse=0.005, printed=None).n_parameters
    121
    """

    name: str
    n_parameters: int
    mse: float
    printed: float | None


@dataclass(frozen=True, eq=False, repr=False)
class StructureTable(Tabular):
    """Sensors of several structures, trained on one record.

    Parameters
    ----------
    number
        Of the thesis's table.
    subject
        What is compared.
    record
        That trained the sensors.
    """

    number: str
    subject: str
    record: str
    rows: tuple[StructureRow, ...]

    @property
    def table(self) -> Table:
        """Return the rows as text."""
        return Table(
            f"Table {self.number}: {self.subject}, on {self.record} (simulated).",
            ("structure", "parameters", "MSE [mm^2]", "thesis, normalised"),
            tuple(
                (row.name, str(row.n_parameters), f"{row.mse:.4f}", "" if row.printed is None else f"{row.printed:g}")
                for row in self.rows
            ),
            "lrrr",
        )

    def _content(self) -> Iterator[Part]:
        yield self.table

    def _rows(self) -> Iterator[dict[str, Any]]:
        return (
            {"structure": r.name, "parameters": r.n_parameters, "mse": r.mse, "thesis": r.printed} for r in self.rows
        )

    def plot(self) -> Figure:
        """Draw our errors and the thesis's, each divided by the error of its first row."""
        from smid.theses.clutch.sensor_study.figures import structure_figure

        return structure_figure(self)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {"table": self.number, "record": self.record, "rows": list(self._rows())}


def _compare(
    number: str,
    subject: str,
    record: str,
    sensors: Sequence[tuple[str, VirtualSensor, float | None]],
    seed: int,
    progress: Progress | None,
    load: Loader,
) -> StructureTable:
    data = load(record)
    rows = []
    for name, sensor, printed in sensors:
        if progress is not None:
            progress(f"table {number}: {name}")
        mse = sensor.fit(data, seed=seed).predict(data).mse(data)
        rows.append(StructureRow(name, sensor.n_parameters, mse, printed))
    return StructureTable(number, subject, record, tuple(rows))


def _layers(hidden: tuple[int, ...]) -> str:
    return " - ".join(map(str, hidden))


def table_5_1(
    seed: int = 1,
    structures: Sequence[tuple[int, ...]] = tuple(CPX_PRINTED),
    progress: Progress | None = None,
    load: Loader = load_clutch,
) -> StructureTable:
    """Compare networks for CPX.

    Parameters
    ----------
    structures
        Neurons of each hidden layer, among those of the thesis.
    load
        Returns the record of a name.

    Examples
    --------
    >>> table_5_1(structures=[(2,)]).rows[0].n_parameters
    13
    """
    sensors = [(_layers(hidden), CPX(hidden), CPX_PRINTED[hidden]) for hidden in structures]
    return _compare("5.1", "neurons of CPX", "m20C_step_a", sensors, seed, progress, load)


def table_5_2(
    seed: int = 1,
    structures: Sequence[tuple[int, ...]] = tuple(PX_PRINTED),
    progress: Progress | None = None,
    load: Loader = load_clutch,
) -> StructureTable:
    """Compare networks for PX; the parameters are those of `table_5_1`.

    Examples
    --------
    >>> table_5_2(structures=[(2,)]).rows[0].n_parameters
    7
    """
    sensors = [(_layers(hidden), PX(hidden), PX_PRINTED[hidden]) for hidden in structures]
    return _compare("5.2", "neurons of PX", "20C_step_a", sensors, seed, progress, load)


def table_5_3(seed: int = 1, progress: Progress | None = None, load: Loader = load_clutch) -> StructureTable:
    """Compare orders of the polynomial of CFPX.

    Examples
    --------
    >>> [row.n_parameters for row in table_5_3().rows]
    [6, 11, 21, 51, 101]
    """
    sensors = [(f"order {order}", CFPX(order), printed) for order, printed in CFPX_PRINTED.items()]
    return _compare("5.3", "orders of CFPX", "20C_step_a", sensors, seed, progress, load)


def table_5_4(seed: int = 1, progress: Progress | None = None, load: Loader = load_clutch) -> StructureTable:
    """Compare CPX20, PX20 and CFPX20 with the median filter and the dead zone enforced.

    The thesis does not count the two parameters of the dead zone. Its median of order 250 takes half a second, as
    long as our records hold a level, so CFPX20 is also shown without it.

    Examples
    --------
    >>> [row.name for row in table_5_4().rows][0]
    'CPX20'
    """
    sensors: list[tuple[str, VirtualSensor, float | None]] = [
        ("CPX20", final_form(CPX(), CPX_ORDER), FINAL_PRINTED["CPX20"]),
        ("PX20", final_form(PX(), None), FINAL_PRINTED["PX20"]),
        ("CFPX20", final_form(CFPX(20), CFPX_ORDER), FINAL_PRINTED["CFPX20"]),
        ("CFPX20 without median", final_form(CFPX(20), None), None),
    ]
    return _compare("5.4", "sensors with median filter and dead zone", "20C_step_a", sensors, seed, progress, load)


def final_form(sensor: VirtualSensor, order: int | None) -> VirtualSensor:
    """Return a sensor with the median filter of an order, if any, and the dead zone enforced after it."""
    return DeadZone(sensor if order is None else MedianFiltered(sensor, order))
