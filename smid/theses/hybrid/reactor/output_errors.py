"""Table 5: the largest output error of series and parallel models under a constant input.

Every mismatch, each topology with simple and with extra back couplings, and with as many as the analysis asks for in
parallel, where extra ones are too few.  Each is estimated twice: one step ahead, as in the thesis, and in free run.
All are validated as simulators, under the constant input 0.5, on a tank that starts out of equilibrium.

The thesis trains each cell with the signal that served it best; here all are trained with the noisy staircase.  The
network has three neurons in series, two in parallel.  The numbers of its table are lost in the copy that is left of it;
the axis of its figure 6.7, which shows those of its models that were not "bad", ends at 0.25.

Reference: hybrid thesis, section 6.2.3, table 5, figure 6.7, appendices A and C.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from relaxations.search.hierarchy import Progress
from smid.display.result import Part, Tabular, plain
from smid.display.table import Table, figure
from smid.hybrid.back_couplings import EXTRA, SIMPLE, BackCouplings
from smid.hybrid.estimate import ERRORS, HybridEstimate, estimate
from smid.hybrid.parallel import parallel
from smid.hybrid.series import series
from smid.theses.hybrid.reactor.records import PLANTS, free_run, reactor_record, white_reactor

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["CELLS", "OutputErrors", "estimated_reactor", "output_errors"]

AXIS = 0.25
ASKED = BackCouplings(2, 2)
CELLS: Mapping[str, tuple[str, BackCouplings]] = {
    "series, simple": ("series", SIMPLE),
    "series, extra": ("series", EXTRA),
    "parallel, simple": ("parallel", SIMPLE),
    "parallel, extra": ("parallel", EXTRA),
    "parallel, as analysed": ("parallel", ASKED),
}
"""Columns of the table; the analysis asks for (1, 1) in series, which is "extra", and for (2, 2) in parallel."""

_WORDS = {"prediction": "one step ahead, as the thesis", "simulation": "free run"}


@dataclass(frozen=True, eq=False, repr=False)
class OutputErrors(Tabular):
    """Largest output errors under a constant input.

    Parameters
    ----------
    largest
        Shape (n_plants,).
        By the error that was lowered and the column of `CELLS`, in mol/m3; infinite where the model runs away.
    alone
        Shape (n_plants,). Of the first principles alone.
    """

    plants: tuple[str, ...]
    largest: Mapping[tuple[str, str], np.ndarray[Any, np.dtype[np.float64]]]
    alone: np.ndarray[Any, np.dtype[np.float64]]

    def table(self, error: str) -> Table:
        """Return the table for one of `ERRORS`."""
        rows = tuple(
            (plant, _cell(self.alone[k]), *(_cell(self.largest[error, column][k]) for column in CELLS))
            for k, plant in enumerate(self.plants)
        )
        return Table(
            f"Largest output error under a constant input, trained {_WORDS[error]}; "
            f"'bad' beyond {AXIS:g}, where the axis of the thesis's figure 6.7 ends.",
            ("plant", "first principles", *CELLS),
            rows,
            "l" + "r" * (len(CELLS) + 1),
        )

    @property
    def conclusion(self) -> str:
        """Return in a few sentences what the table shows."""

        def worst(error: str, column: str) -> str:
            return f"{float(np.max(self.largest[error, column])):.2g}"

        ahead = {column: worst("prediction", column) for column in CELLS}
        free = {column: worst("simulation", column) for column in CELLS}
        return (
            f"Over {len(self.plants)} plants the largest error in series is {ahead['series, simple']} with simple and "
            f"{ahead['series, extra']} with extra back couplings when trained one step ahead, as in the thesis, and "
            f"{free['series, simple']} and {free['series, extra']} when trained in free run. In parallel it is, in "
            f"free run, {free['parallel, simple']} with simple back couplings, {free['parallel, extra']} with extra "
            f"ones and {free['parallel, as analysed']} with those that the analysis asks for."
        )

    def _content(self) -> Iterator[Part]:
        yield from map(self.table, ERRORS)
        yield self.conclusion

    def _rows(self) -> Iterator[dict[str, Any]]:
        """Give a row for each plant, network and error that was lowered."""
        for (error, column), values in self.largest.items():
            for plant, largest in zip(self.plants, values.tolist(), strict=True):
                yield {"plant": plant, "network": column, "trained": error, "largest": largest}

    def plot(self) -> Figure:
        """Draw figure 6.7: the largest errors as bars, on a logarithmic axis."""
        from smid.theses.hybrid.reactor.figures import output_error_figure

        return output_error_figure(self)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "plants": list(self.plants),
            "first_principles": self.alone.tolist(),
            "largest": [
                {"error": error, "column": column, "values": plain(values)}
                for (error, column), values in self.largest.items()
            ],
            "conclusion": self.conclusion,
        }


def output_errors(
    plants: Sequence[str] = PLANTS,
    *,
    starts: int = 3,
    iterations: int = 300,
    seed: int = 1,
    progress: Progress | None = None,
) -> OutputErrors:
    """Fill table 5.

    Parameters
    ----------
    plants
        Of `PLANTS`.
    starts, iterations
        Of each estimate.
    seed
        Of the input's noise and of the starts.

    Raises
    ------
    ModelError
        If a plant is not known.

    Examples
    --------
    >>> table = output_errors(["factor"], starts=1, iterations=1)
    >>> table.plants, bool(table.alone[0] > 0.01)
    (('factor',), True)
    """
    records = {plant: reactor_record(plant, "constant") for plant in plants}
    largest: dict[tuple[str, str], list[float]] = {}
    for plant, error, column in itertools.product(plants, ERRORS, CELLS):
        if progress is not None:
            progress(f"{plant}: {column}, {error}")
        found = estimated_reactor(plant, *CELLS[column], error=error, starts=starts, iterations=iterations, seed=seed)
        deviation = np.abs(free_run(found.hybrid, records[plant]) - records[plant].values("y"))
        largest.setdefault((error, column), []).append(float(np.nan_to_num(deviation, nan=np.inf).max()))
    alone = []
    for plant in plants:
        data = records[plant]
        run = white_reactor(plant).simulate(data, initial={"w": data.values("u")[:1]}).outputs[0]["y"]
        alone.append(float(np.abs(run - data.values("y")).max()))
    return OutputErrors(tuple(plants), {key: np.array(values) for key, values in largest.items()}, np.array(alone))


def estimated_reactor(
    plant: str,
    topology: str,
    couplings: BackCouplings,
    *,
    error: str,
    starts: int = 3,
    iterations: int = 300,
    seed: int = 1,
    signal: str = "noisy_staircase",
) -> HybridEstimate:
    """Estimate one cell of the table.

    Parameters
    ----------
    plant
        Of `PLANTS`.
    topology
        One of {"series", "parallel"}.
    error
        One of `ERRORS`.
    seed
        Of the input's noise and of the starts.
    signal
        To train with.
    """
    join = {"series": series, "parallel": parallel}[topology]
    data = reactor_record(plant, signal, seed)
    hybrid = join(white_reactor(plant), couplings)
    return estimate(hybrid, data, error=error, starts=starts, iterations=iterations, seed=seed)


def _cell(value: float) -> str:
    return f"{figure(value)}, bad" if value > AXIS and np.isfinite(value) else figure(value) if value <= AXIS else "bad"
