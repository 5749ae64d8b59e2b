"""Scores of free runs against measured outputs, and the table of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from relaxations.algebra.arrays import Array, Mask
from smid.data import DataError, Dataset
from smid.data.listing import missing_notes
from smid.data.reference import identity, referred
from smid.display.from_plain import Plain, fields_from_plain, read
from smid.display.result import Part, Tabular, plain
from smid.display.table import Table
from smid.identification.estimate import open_end
from smid.models import Model
from smid.validation.free_runs import beginning, free_runs

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Score:
    """Comparison of a free run with one output of one experiment.

    Parameters
    ----------
    samples
        Number of compared samples: those after the warm-up that are not missing.
    rmse
        In the channel's unit.
    fit_percent
        NRMSE fit, ``100 (1 - ||y - y_sim|| / ||y - mean(y)||)``; minus infinity for a constant output.
    largest
        Largest absolute error, in the channel's unit.
    violations
        Number of samples whose error exceeds the noise bound.
    """

    experiment: str
    channel: str
    unit: str
    samples: int
    rmse: float
    fit_percent: float
    largest: float
    noise_bound: float | None
    violations: int | None


@dataclass(frozen=True, eq=False, repr=False)
class Validation(Tabular):
    """Scores of a model's free run on data.

    Parameters
    ----------
    scores
        One for each experiment and output channel.
    simulated
        Per experiment, the simulated output channels; none in a validation that was loaded without its record.
    """

    SCHEMA: ClassVar = "smid.validation/1"

    model: Model
    data: Dataset
    scores: tuple[Score, ...]
    simulated: tuple[Mapping[str, Array], ...]

    def __len__(self) -> int:
        return len(self.scores)

    def __iter__(self) -> Iterator[Score]:
        return iter(self.scores)

    @property
    def table(self) -> Table:
        """Return a table with one row for each score."""
        return scores_table(self.scores)

    def error(self, number: int) -> Array:
        """Return measured minus simulated output of a score, by its number, shape (n,); NaN where it is not scored."""
        channel, k = self.scores[number].channel, self.experiment(number)
        simulated = self.simulated[k][channel]
        scored = scored_samples(self.model, self.data, k, channel, simulated)
        return np.where(scored, self.data.values(channel, k) - simulated, np.nan)

    def experiment(self, number: int) -> int:
        """Return the number of the experiment of the score of this number."""
        return number // len(self.model.output_channels)

    def _content(self) -> Iterator[Part]:
        yield self.table
        yield from missing_notes(self.data)

    def _rows(self) -> Iterator[dict[str, Any]]:
        return (asdict(score) for score in self.scores)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data: the ``validation`` of the versioned JSON schema in docs/json.md."""
        return {
            "schema": self.SCHEMA,
            "model": self.model.to_dict(),
            "data": identity(self.data),
            "scores": plain(self.scores),
        }

    @staticmethod
    def from_dict(content: Mapping[str, Any], data: Dataset | None = None) -> Validation:
        """Return the validation that `to_dict` described; the free runs are repeated if the record is given."""
        model = read(content, "model", Model)
        record = referred(read(content, "data", Plain), data)
        simulated = () if data is None else free_runs(model, record)
        return Validation(model, record, scores_from(content), simulated)

    def plot(self, number: int = 0) -> Figure:
        """Return a figure of measured output, free run and error, for the score of this number."""
        from smid.validation.figures import simulation_figure

        return simulation_figure(self, number)


def scores_of(
    data: Dataset,
    simulated: Sequence[Mapping[str, Array]],
    scored: Sequence[Mapping[str, Mask]],
    noise_bound: float | Mapping[str, float] | None = None,
) -> tuple[Score, ...]:
    """Return the scores of free runs, given per experiment and output channel, on the samples that are scored.

    DataError where there is none.
    """
    scores = []
    for experiment, runs, masks in zip(data.experiments, simulated, scored, strict=True):
        for channel, mask in masks.items():
            if not mask.any():
                raise DataError(
                    f"experiment {experiment.name!r} has {experiment.n_samples} samples, none of {channel!r} after the "
                    "first ones that start the simulation: take a longer record"
                )
            measured = experiment.values[channel][mask]
            error = measured - runs[channel][mask]
            bound = noise_bound.get(channel) if isinstance(noise_bound, Mapping) else noise_bound
            deviation = np.linalg.norm(measured - measured.mean())
            with np.errstate(divide="ignore", invalid="ignore"):
                fit = 100 * (1 - np.linalg.norm(error) / deviation)
            scores.append(
                Score(
                    experiment.name,
                    channel,
                    data.channel(channel).unit,
                    len(error),
                    float(np.sqrt(np.mean(error**2))),
                    float(fit),
                    float(np.abs(error).max()),
                    bound,
                    None if bound is None else int((np.abs(error) > bound).sum()),
                )
            )
    return tuple(scores)


def scores_table(scores: Sequence[Score]) -> Table:
    """Return a table with one row for each score; violations only where there is a noise bound."""
    rows = tuple(
        (
            s.experiment,
            s.channel,
            str(s.samples),
            f"{s.rmse:.4g} {s.unit}".rstrip(),
            f"{s.fit_percent:.2f}",
            f"{s.largest:.4g} {s.unit}".rstrip(),
            "-" if s.violations is None else f"{s.violations}",
        )
        for s in scores
    )
    header = ("experiment", "output", "samples", "RMSE", "fit %", "largest", "violations")
    return Table("", header, rows, "llrrrrr")


def scores_from(content: Mapping[str, Any]) -> tuple[Score, ...]:
    """Return the scores in plain data; the fit of a constant output is minus infinity."""
    return tuple(
        fields_from_plain(Score, score, fit_percent=open_end(score, "fit_percent", -np.inf))
        for score in read(content, "scores", tuple[Plain, ...])
    )


def scored_samples(model: Model, data: Dataset, number: int, channel: str, simulated: Array) -> Mask:
    """Return which samples of an output of an experiment are compared with its free run, shape (n,).

    They are not missing, and lie after the warm-up and after the samples that start the run.
    """
    begun = max(int(np.argmax(~np.isnan(simulated))), beginning(model, len(simulated)) - model.max_lag)
    there = ~np.isnan(data.values(channel, number))
    return np.asarray(there & (np.arange(len(there)) >= max(data.n_init, begun + model.max_lag)))
