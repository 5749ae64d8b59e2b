"""Table 5: the largest output error of series and parallel models under a constant input.

All mismatches are combined with each topology, with simple and with extra back couplings, and in parallel also with the
number that the analysis requires. Each model is estimated twice: one step ahead, as in the thesis, and in free run. All
are validated in free run, under the constant input 0.5, on a tank that starts out of equilibrium.

The thesis trains each cell with its best signal; here all are trained with the noisy staircase. The network has three
neurons in series and alone, two in parallel. The numbers of the thesis's table are missing in our copy. The axis of its
figure 6.7, which shows the models that were not "bad", ends at 0.25.

Reference: hybrid thesis, section 6.2.3, table 5, figure 6.7, appendices A and C.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.deadline import Progress
from smid.data import Dataset
from smid.display.result import Part, Tabular, plain
from smid.display.table import Table, figure
from smid.hybrid.back_couplings import EXTRA, SIMPLE, BackCouplings
from smid.hybrid.estimate import ERRORS, estimate
from smid.hybrid.hybrid_estimate import HybridEstimate
from smid.hybrid.hybrid_model import HybridModel
from smid.hybrid.network_only import network_only
from smid.hybrid.parallel import parallel
from smid.hybrid.series import series
from smid.models import Model
from smid.theses.hybrid.reactor.records import PLANTS, first_principles, free_run, reactor_record, white_reactor

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["AXIS", "CELLS", "OutputErrors", "estimated_reactor", "largest_error", "output_errors", "shown_error"]

AXIS = 0.25
ASKED = BackCouplings(2, 2)
CELLS: Mapping[str, tuple[str, BackCouplings]] = {
    "series, simple": ("series", SIMPLE),
    "series, extra": ("series", EXTRA),
    "parallel, simple": ("parallel", SIMPLE),
    "parallel, extra": ("parallel", EXTRA),
    "parallel, as analysed": ("parallel", ASKED),
    "network alone": ("network only", ASKED),
}
"""Columns of the table; the analysis requires (1, 1) in series, which is "extra", and (2, 2) in parallel. The network
alone, without first principles, is the baseline of the thesis's observation (d)."""

_JOINS: Mapping[str, Callable[[Model, BackCouplings], HybridModel]] = {
    "series": series,
    "parallel": parallel,
    "network only": network_only,
}
_WORDS = {"prediction": "one step ahead, as the thesis", "simulation": "free run"}


@dataclass(frozen=True, eq=False, repr=False)
class OutputErrors(Tabular):
    """Largest output errors under a constant input, in mol/m3.

    Parameters
    ----------
    largest
        Shape (n_plants,). By the trained error and the column of `CELLS`; infinite where the model diverges.
    alone
        Shape (n_plants,). Of the first principles alone.
    runs
        Shape (n,). By plant, then plant, first principles, and the columns of `CELLS`, trained in free run.
    """

    plants: tuple[str, ...]
    largest: Mapping[tuple[str, str], Array]
    alone: Array
    runs: Mapping[str, Mapping[str, Array]]

    def table(self, error: str) -> Table:
        """Return the table for one of `ERRORS`."""
        rows = tuple(
            (plant, shown_error(self.alone[k]), *(shown_error(self.largest[error, column][k]) for column in CELLS))
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
        """Return the results of the table in a few sentences."""

        def worst(error: str, column: str) -> str:
            return f"{float(np.max(self.largest[error, column])):.2g}"

        ahead = {column: worst("prediction", column) for column in CELLS}
        free = {column: worst("simulation", column) for column in CELLS}
        return (
            f"Largest errors over {len(self.plants)} plants. In series, trained one step ahead as in the thesis: "
            f"{ahead['series, simple']} with simple and {ahead['series, extra']} with extra back couplings. In series, "
            f"trained in free run: {free['series, simple']} and {free['series, extra']}. In parallel, trained in free "
            f"run: {free['parallel, simple']} with simple back couplings, {free['parallel, extra']} with extra ones, "
            f"and {free['parallel, as analysed']} with the number that the analysis requires."
        )

    def _content(self) -> Iterator[Part]:
        yield from map(self.table, ERRORS)
        yield self.conclusion

    def _rows(self) -> Iterator[dict[str, Any]]:
        """Return a row for each plant, network and trained error."""
        for (error, column), values in self.largest.items():
            for plant, largest in zip(self.plants, values.tolist(), strict=True):
                yield {"plant": plant, "network": column, "trained": error, "largest": largest}

    def plot(self) -> Figure:
        """Draw figure 6.7: the largest errors on a logarithmic axis."""
        from smid.theses.hybrid.reactor.figures import output_error_figure

        return output_error_figure(self)

    def plot_runs(self) -> Figure:
        """Draw the runs of each plant, as appendices A and C."""
        from smid.theses.hybrid.reactor.figures import mismatch_figure

        return mismatch_figure(self)

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
    """Fill table 5; `starts` and `iterations` are those of each estimate.

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
    runs = {
        plant: {"plant": data.values("y"), "first principles": first_principles(plant, data)}
        for plant, data in records.items()
    }
    largest: dict[tuple[str, str], list[float]] = {}
    for plant, error, column in itertools.product(plants, ERRORS, CELLS):
        if progress is not None:
            progress(f"{plant}: {column}, {error}")
        found = estimated_reactor(plant, *CELLS[column], error=error, starts=starts, iterations=iterations, seed=seed)
        run = free_run(found.hybrid, records[plant])
        largest.setdefault((error, column), []).append(largest_error(run, records[plant]))
        if error == "simulation":
            runs[plant][column] = run
    alone = [largest_error(runs[plant]["first principles"], data) for plant, data in records.items()]
    return OutputErrors(
        tuple(plants), {key: np.array(values) for key, values in largest.items()}, np.array(alone), runs
    )


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
    noise_share: float = 0.0,
) -> HybridEstimate:
    """Return the estimate of one cell of the table from a `reactor_record`; `error` is one of `ERRORS`."""
    return _estimated(plant, topology, couplings, error, starts, iterations, seed, signal, noise_share)


@cache  # the studies of one run share cells
def _estimated(
    plant: str,
    topology: str,
    couplings: BackCouplings,
    error: str,
    starts: int,
    iterations: int,
    seed: int,
    signal: str,
    noise_share: float,
) -> HybridEstimate:
    data = reactor_record(plant, signal, seed, noise_share=noise_share)
    hybrid = _JOINS[topology](white_reactor(plant), couplings)
    return estimate(hybrid, data, error=error, starts=starts, iterations=iterations, seed=seed)


def largest_error(run: Array, data: Dataset) -> float:
    """Return the largest deviation of a simulated output from the record's; infinite where the model diverges."""
    return float(np.nan_to_num(np.abs(run - data.values("y")), nan=np.inf).max())


def shown_error(value: float) -> str:
    """Return an error, marked as bad beyond the axis of figure 6.7."""
    return f"{figure(value)}, bad" if value > AXIS and np.isfinite(value) else figure(value) if value <= AXIS else "bad"
