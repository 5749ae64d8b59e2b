"""Range of the inputs that a network was trained on, and a guard that tells when a record leaves it.

A network says nothing outside the inputs that it has seen, which a small error on the training record does not
show. There use the law that was read (`smid.hybrid.learned_law`), or train the network again.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from relaxations.algebra.arrays import Array
from smid.data import Dataset
from smid.display.result import Part, Tabular
from smid.display.table import Table
from smid.fitting.problem import Fitting
from smid.hybrid.hybrid_model import HybridModel
from smid.models import Line, Model, signal, t
from smid.models.expressions import shown
from smid.models.sensitivities import Initial

if TYPE_CHECKING:
    from smid.hybrid.hybrid_estimate import HybridEstimate

__all__ = ["Extrapolation", "TrainedRange", "extrapolation", "network_inputs"]


_MARGIN = 0.02


@dataclass(frozen=True)
class TrainedRange:
    """Least and largest value of a network input on the fitted samples.

    Parameters
    ----------
    network
        Name of the network.
    input
        The input, as in the model.

    Examples
    --------
    >>> TrainedRange("N", "v[t]", 0.0, 1.0).outside(np.array([0.5, 1.01, 1.5])).tolist()
    [False, False, True]
    """

    network: str
    input: str
    lower: float
    upper: float

    def outside(self, samples: Array) -> NDArray[np.bool_]:
        """Return which samples, shape (n,), lie outside by more than 2 % of the range."""
        margin = _MARGIN * (self.upper - self.lower)
        return np.asarray(~((samples >= self.lower - margin) & (samples <= self.upper + margin)))


@dataclass(frozen=True, eq=False, repr=False)
class Extrapolation(Tabular):
    """Where a record leaves the range that the networks were trained on.

    Parameters
    ----------
    trained
        Of each network input.
    outside
        Shape (n,). Per experiment, whether an input lies outside its range.
    reached
        Of each network input, least and largest value on the record.
    """

    trained: tuple[TrainedRange, ...]
    outside: tuple[NDArray[np.bool_], ...]
    reached: tuple[tuple[float, float], ...]

    @property
    def share(self) -> float:
        """Return the share of the samples outside."""
        return float(np.mean(np.concatenate(self.outside)))

    @property
    def sentence(self) -> str:
        """Return in a sentence whether the networks extrapolate."""
        if not self.share:
            return "Every input of the networks stays within the range that they were trained on."
        return (
            f"Inputs of the networks leave the trained range in {100 * self.share:.3g} % of the samples: do not trust "
            "the simulation there. Train on a record with such samples, or use the law that was learned."
        )

    @property
    def table(self) -> Table:
        """Return a row for each network input."""
        rows = tuple(
            (row["network"], row["input"], *(f"{row[end]:.4g}" for end in ("lower", "upper", "least", "largest")))
            for row in self._rows()
        )
        header = ("network", "input", "trained from", "to", "here from", "to")
        return Table("", header, rows, "llrrrr")

    def _rows(self) -> Iterator[dict[str, Any]]:
        for known, (least, largest) in zip(self.trained, self.reached, strict=True):
            yield {
                "network": known.network,
                "input": known.input,
                "lower": known.lower,
                "upper": known.upper,
                "least": least,
                "largest": largest,
            }

    def _content(self) -> Iterator[Part]:
        yield self.table
        yield self.sentence


def extrapolation(found: HybridEstimate, data: Dataset) -> Extrapolation:
    """Return where a record leaves the range that the networks of an estimate were trained on.

    The model runs freely over the record, from the initial states that fit its first samples.

    Parameters
    ----------
    data
        With the channels of the training record.

    Examples
    --------
    >>> from smid.hybrid import EXTRA, estimate, parallel
    >>> from smid.models import Reactor
    >>> u = np.sin(np.arange(60.0)) + 2.0
    >>> data = Dataset.from_arrays(input={"u": u}, output={"y": u**2}, sampling_time=1.0)
    >>> found = estimate(parallel(Reactor(2.0), EXTRA, ()), data, starts=1, seed=1)
    >>> further = Dataset.from_arrays(input={"u": 2.0 * u}, output={"y": u**2}, sampling_time=1.0)
    >>> extrapolation(found, data).share, extrapolation(found, further).share > 0.3
    (0.0, True)
    """
    nothing = [np.zeros(run.n_samples, bool) for run in data.experiments]
    problem = Fitting(found.model, data, nothing)
    begun = found.fit if data is found.data else problem.result(problem.start(found.model.values), 0.0)
    inputs = network_inputs(
        found.hybrid, lambda model: Fitting(model, data, nothing), found.model.values, begun.initial
    )
    outside = [np.zeros(run.n_samples, bool) for run in data.experiments]
    for k, known in enumerate(found.trained):
        for mask, columns in zip(outside, inputs, strict=True):
            mask |= known.outside(columns[:, k])
    together = np.concatenate(inputs)
    reached = tuple(zip(together.min(axis=0).tolist(), together.max(axis=0).tolist(), strict=True))
    return Extrapolation(found.trained, tuple(outside), reached)


def network_inputs(
    hybrid: HybridModel,
    prepare: Callable[[Model], Fitting],
    values: Mapping[str, float],
    initial: Sequence[Initial] | None = None,
) -> list[Array]:
    """Return the inputs of all networks, one after the other, per experiment, shape (n, k).

    Parameters
    ----------
    prepare
        Returns the fit of a model: of its free run, or of its one-step-ahead prediction.
    initial
        Per experiment, the states before the first sample; by default guessed.
    """
    inputs = [item for placed in hybrid.networks for item in placed.term.inputs]
    names = [f"network_input{k}" for k in range(len(inputs))]
    lines = tuple(Line(signal(name)[t], item) for name, item in zip(names, inputs, strict=True))
    fitting = prepare(replace(hybrid.model, lines=(*hybrid.model.lines, *lines)))
    given = {name: float(values[name]) for name in fitting.run.parameters}
    begun = initial if initial is not None else fitting.initial(fitting.start(values))
    found = []
    for samples, before in zip(fitting.inputs, begun, strict=True):
        run, _ = fitting.run.run(samples, given, before, jacobian=False)
        found.append(np.stack([run[name] for name in names], axis=1))
    return found


def trained_ranges(
    hybrid: HybridModel, inputs: Sequence[Array], used: Sequence[NDArray[np.bool_]]
) -> tuple[TrainedRange, ...]:
    """Return the ranges of the network inputs over the used samples."""
    together = np.concatenate([columns[mask] for columns, mask in zip(inputs, used, strict=True)])
    low, high = together.min(axis=0).tolist(), together.max(axis=0).tolist()
    named = [(placed.term.name, shown(item)) for placed in hybrid.networks for item in placed.term.inputs]
    return tuple(TrainedRange(*name, *ends) for name, *ends in zip(named, low, high, strict=True))
