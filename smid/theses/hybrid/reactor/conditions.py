"""Table 5 under other conditions: other training records, and validation at other levels and with other inputs.

The thesis trains on records without noise and validates under the constant 0.5. Here the free-run models of table 5 are
trained on the noisy staircase, on the same with noise on the output, on a sine, on white noise and on the QPRTS of
tables 1 and 3; and validated under three constants, a sine and another staircase, all without noise. Figure 6.2 shows
some of these models.

Reference: hybrid thesis, sections 6.2.1 and 6.2.3, table 5, figure 6.2.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.deadline import Progress
from smid.display.result import Part, Tabular, plain
from smid.display.table import Table
from smid.theses.hybrid.reactor.output_errors import AXIS, CELLS, estimated_reactor, largest_error, shown_error
from smid.theses.hybrid.reactor.records import PLANTS, first_principles, free_run, reactor_record

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["TRAININGS", "VALIDATIONS", "OtherConditions", "other_conditions"]

TRAININGS: Mapping[str, tuple[str, float]] = {
    "staircase": ("noisy_staircase", 0.0),
    "staircase, 1 % noise": ("noisy_staircase", 0.01),
    "sine": ("sine", 0.0),
    "white noise": ("noise", 0.0),
    "QPRTS": ("qprts", 0.0),
}
"""Signal, and bound of the noise as a share of the output's span."""

VALIDATIONS: Mapping[str, tuple[str, float]] = {
    "constant 0.5": ("constant", 0.5),
    "constant 0.2": ("constant", 0.2),
    "constant 0.8": ("constant", 0.8),
    "sine": ("sine", 0.5),
    "another staircase": ("noisy_staircase", 0.5),
}
"""Signal and its level; the other staircase has another seed."""

FIGURE_6_2 = ("two_in_succession", "parallel, simple", "constant 0.5")


@dataclass(frozen=True, eq=False, repr=False)
class OtherConditions(Tabular):
    """Largest output errors by training, column of `CELLS` and validation, in mol/m3.

    Parameters
    ----------
    largest
        Shape (n_plants,). Infinite where the model diverges.
    runs
        Shape (n,). Of figure 6.2, by training: plant, first principles and hybrid model.
    """

    plants: tuple[str, ...]
    largest: Mapping[tuple[str, str, str], Array]
    runs: Mapping[str, tuple[Array, Array, Array]]

    @property
    def table(self) -> Table:
        """Return the median and the largest error over the plants."""
        rows = []
        for training, validation in itertools.product(TRAININGS, VALIDATIONS):
            cells = (self.largest[training, column, validation] for column in CELLS)
            rows.append(
                (training, validation, *(f"{np.median(values):.2g}, {shown_error(values.max())}" for values in cells))
            )
        return Table(
            f"Output error, trained in free run: median and largest over {len(self.plants)} plants; "
            f"'bad' beyond {AXIS:g}.",
            ("trained on", "validated under", *CELLS),
            tuple(rows),
            "ll" + "r" * len(CELLS),
        )

    def _content(self) -> Iterator[Part]:
        yield self.table

    def _rows(self) -> Iterator[dict[str, Any]]:
        for (training, column, validation), values in self.largest.items():
            for plant, largest in zip(self.plants, values.tolist(), strict=True):
                yield {
                    "plant": plant,
                    "network": column,
                    "trained_on": training,
                    "validated_under": validation,
                    "largest": largest,
                }

    def plot(self) -> Figure:
        """Draw figure 6.2: a parallel network that was trained by a sine or by the staircase."""
        from smid.theses.hybrid.reactor.figures import training_figure

        return training_figure(self)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "plants": list(self.plants),
            "largest": [row | {"largest": plain(row["largest"])} for row in self._rows()],
        }


def other_conditions(
    plants: Sequence[str] = PLANTS,
    *,
    starts: int = 3,
    iterations: int = 300,
    seed: int = 1,
    progress: Progress | None = None,
) -> OtherConditions:
    """Estimate the models of table 5 from each training record and validate them.

    Raises
    ------
    ModelError
        If a plant is not known.

    Examples
    --------
    >>> found = other_conditions(["factor"], starts=1, iterations=1)
    >>> found.largest["sine", "series, extra", "constant 0.8"].shape
    (1,)
    """
    checks = {
        (plant, name): reactor_record(plant, signal, seed + 1, level=level)
        for plant in plants
        for name, (signal, level) in VALIDATIONS.items()
    }
    largest: dict[tuple[str, str, str], list[float]] = {}
    runs = {}
    for training, plant, column in itertools.product(TRAININGS, plants, CELLS):
        if progress is not None:
            progress(f"{plant}: {column}, trained on {training}")
        signal, noise = TRAININGS[training]
        found = estimated_reactor(
            plant,
            *CELLS[column],
            error="simulation",
            starts=starts,
            iterations=iterations,
            seed=seed,
            signal=signal,
            noise_share=noise,
        )
        for name in VALIDATIONS:
            data = checks[plant, name]
            run = free_run(found.hybrid, data)
            largest.setdefault((training, column, name), []).append(largest_error(run, data))
            if (plant, column, name) == FIGURE_6_2:
                runs[training] = (data.values("y"), first_principles(plant, data), run)
    return OtherConditions(tuple(plants), {key: np.array(values) for key, values in largest.items()}, runs)
