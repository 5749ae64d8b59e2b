"""Table 6: the learned responses of the networks, compared with the required ones.

For the linear mismatches of table 2, the network of an estimated model is run alone on a constant, 0.3 in series and
0.5 in parallel, from the first samples of the required response. The largest deviation in the first 2 s measures the
dynamics, that after 7 s the steady state.

Reference: hybrid thesis, table 6, appendices B and D, figures B.2 to B.6 and D.2 to D.5.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.deadline import Progress
from smid.display.result import Part, Tabular
from smid.display.table import Table, figure
from smid.hybrid.analysis import Requirement, learned_response, required
from smid.hybrid.estimate import ERRORS
from smid.theses.hybrid.plants import reactor_plant
from smid.theses.hybrid.reactor.output_errors import CELLS, estimated_reactor
from smid.theses.hybrid.reactor.records import SAMPLING_TIME, white_reactor

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["LINEAR", "Learned", "RequirementStudy", "requirement_study"]

LINEAR = ("time_constant", "factor", "two_in_succession")
AMPLITUDE = {"series": 0.3, "parallel": 0.5}
COUNT, INITIAL, STEADY = 41, 2.0, 7.0  # s

PRINTED = {
    ("time_constant", "series"): ("0.02", "zero"),
    ("factor", "series"): ("zero", "zero"),
    ("two_in_succession", "series"): ("0.02", "zero"),
    ("time_constant", "parallel"): ("0.1", "zero"),
    ("factor", "parallel"): ("0.02", "zero"),
    ("two_in_succession", "parallel"): ("0.25", "zero"),
}
"""Table 6 as printed: initial and steady."""

IN_THESIS = ("series, extra", "parallel, simple")

JOINED = tuple(column for column, (topology, _) in CELLS.items() if topology != "network only")
"""Columns with first principles."""


@dataclass(frozen=True, eq=False)
class Learned:
    """One network and its requirement.

    Parameters
    ----------
    column
        Of `CELLS`.
    error
        The trained one of `ERRORS`.
    response
        Shape (n,). Of the network.
    """

    plant: str
    column: str
    error: str
    requirement: Requirement
    response: Array

    @property
    def wanted(self) -> Array:
        """Return the required response, shape (n,)."""
        return self.requirement.step_response(self.response.size, AMPLITUDE[self.requirement.topology])

    def largest(self, start: float, stop: float) -> float:
        """Return the largest deviation after `start` until `stop`, both in seconds."""
        time = SAMPLING_TIME * np.arange(self.response.size)
        return float(np.abs(self.response - self.wanted)[(time > start) & (time <= stop)].max())


@dataclass(frozen=True, eq=False, repr=False)
class RequirementStudy(Tabular):
    """All networks of the linear mismatches, with their requirements."""

    learned: tuple[Learned, ...]

    @property
    def table(self) -> Table:
        """Return table 6, with the thesis's numbers."""
        rows = []
        for item in self.learned:
            needed = item.requirement.couplings
            given = CELLS[item.column][1]
            printed = PRINTED[item.plant, item.requirement.topology] if item.column in IN_THESIS else ("", "")
            rows.append(
                (
                    item.plant,
                    item.column,
                    f"{given.inputs}, {given.outputs}",
                    f"{needed.inputs}, {needed.outputs}",
                    item.error,
                    figure(item.largest(0.0, INITIAL)),
                    figure(item.largest(STEADY, COUNT)),
                    *printed,
                )
            )
        header = (
            "mismatch",
            "network",
            "has",
            "needs",
            "trained",
            "initial",
            "steady",
            "thesis: initial",
            "thesis: steady",
        )
        return Table(
            "Deviation of the network's response to a constant from the required one, in the first 2 s and after 7 s; "
            "past inputs and outputs that it has and needs.",
            header,
            tuple(rows),
            "lllllrrrr",
        )

    @property
    def transfers(self) -> Table:
        """Return the transfer functions that the networks must learn."""
        found = {(item.plant, item.requirement.topology): item.requirement for item in self.learned}
        rows = tuple(
            (plant, topology, str(item.transfer), f"{item.couplings.inputs}", f"{item.couplings.outputs}")
            for (plant, topology), item in found.items()
        )
        return Table(
            "Required transfer function of the network, and its number of back couplings at a sampling time of 1 s.",
            ("mismatch", "topology", "H_NN(s)", "past inputs", "past outputs"),
            rows,
            "lllrr",
        )

    def _content(self) -> Iterator[Part]:
        yield self.transfers
        yield self.table

    def plot(self) -> Figure:
        """Draw learned and required responses: figures B.3 to B.6 and D.2 to D.5."""
        from smid.theses.hybrid.reactor.figures import requirement_figure

        return requirement_figure(self)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {"networks": list(self._rows())}

    def _rows(self) -> Iterator[dict[str, Any]]:
        for item in self.learned:
            yield {
                "mismatch": item.plant,
                "network": item.column,
                "trained": item.error,
                "transfer": str(item.requirement.transfer),
                "needs": [item.requirement.couplings.inputs, item.requirement.couplings.outputs],
                "initial": item.largest(0.0, INITIAL),
                "steady": item.largest(STEADY, COUNT),
            }


def requirement_study(
    plants: Sequence[str] = LINEAR,
    columns: Sequence[str] = JOINED,
    *,
    starts: int = 3,
    iterations: int = 300,
    seed: int = 1,
    progress: Progress | None = None,
) -> RequirementStudy:
    """Fill table 6 for linear mismatches and columns of `CELLS`.

    Raises
    ------
    ModelError
        If a plant is not known, or not linear.

    Examples
    --------
    >>> study = requirement_study(["factor"], ["series, extra"], starts=1, iterations=2)
    >>> {learned.plant for learned in study.learned}
    {'factor'}
    """
    learned = []
    for plant in plants:
        for column in columns:
            topology, couplings = CELLS[column]
            needed = required(reactor_plant(plant), white_reactor(plant), topology, SAMPLING_TIME)
            amplitude = AMPLITUDE[topology]
            wanted = needed.step_response(COUNT, amplitude)
            for error in ERRORS:
                if progress is not None:
                    progress(f"{plant}: {column}, {error}")
                found = estimated_reactor(
                    plant, topology, couplings, error=error, starts=starts, iterations=iterations, seed=seed
                )
                response = learned_response(found.hybrid, wanted, COUNT, amplitude)
                learned.append(Learned(plant, column, error, needed, response))
    return RequirementStudy(tuple(learned))
