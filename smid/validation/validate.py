"""Validation (phase 3): score of a model's free run on other records."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from math import isclose
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from relaxations.algebra.arrays import Array, Mask
from smid.data import DataError, Dataset
from smid.data.dataset import check_dataset
from smid.data.listing import missing_notes
from smid.data.reference import identity, referred
from smid.display.from_plain import Plain, fields_from_plain, read
from smid.display.result import Part, Tabular, plain
from smid.display.table import Table
from smid.fitting.binding import bind
from smid.identification.estimate import Estimate, open_end
from smid.models import Model, ModelError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Candidate = Model | Estimate


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
            for s in self.scores
        )
        header = ("experiment", "output", "samples", "RMSE", "fit %", "largest", "violations")
        return Table("", header, rows, "llrrrrr")

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
        scores = tuple(
            fields_from_plain(Score, score, fit_percent=open_end(score, "fit_percent", -np.inf))
            for score in read(content, "scores", tuple[Plain, ...])
        )
        record = referred(read(content, "data", Plain), data)
        simulated = () if data is None else tuple(dict(run) for run in model.simulate(record).outputs)
        return Validation(model, record, scores, simulated)

    def plot(self, number: int = 0) -> Figure:
        """Return a figure of measured output, free run and error, for the score of this number."""
        from smid.validation.figures import simulation_figure

        return simulation_figure(self, number)


def bound_model(given: Candidate, data: Dataset) -> Model:
    """Return a model, or the central model of an estimate, with the channels and the sampling time of the data.

    Raises
    ------
    TypeError
        If neither a model nor an estimate is given.
    ModelError, DataError
        If an estimate has another sampling time than the data, or as `smid.bind`.
    """
    if not isinstance(given, Model | Estimate):
        raise TypeError(f"a {type(given).__name__} cannot be simulated: give a model with values, or an estimate")
    if isinstance(given, Model):
        return bind(given, data)
    check_dataset(data)
    if not isclose(given.data.sampling_time, data.sampling_time):
        raise ModelError(
            f"the estimate has a sampling time of {given.data.sampling_time:g} s, and the record one of "
            f"{data.sampling_time:g} s: resample the record"
        )
    return bind(given.model, data)


def validate(model: Candidate, data: Dataset, noise_bound: float | Mapping[str, float] | None = None) -> Validation:
    """Return the scores of a model's free run on data (phase 3 of the clutch thesis, 3.2.3).

    The free run starts from the first measured outputs. These samples, the warm-up (``n_init``) and missing samples are
    not scored.

    Parameters
    ----------
    model
        With parameter values. An estimate stands for its central model.
    noise_bound
        Bound for counting violations.

    Raises
    ------
    TypeError, ModelError, DataError
        If the model is none, has no values, or does not fit the data.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> data = Dataset.from_arrays(input={"u": [1.0, 1, 1, 1]}, output={"y": [0.0, 1, 1.5, 1.8]}, sampling_time=1.0)
    >>> score = validate(OutputError(na=1).with_values({"a1": -0.5, "b0": 1.0}), data, 0.1).scores[0]
    >>> score.violations, round(score.largest, 2)
    (0, 0.05)
    """
    bound_to = bound_model(model, data)
    simulation = bound_to.simulate(data)
    scores = []
    # Score each output of each experiment after the warm-up.
    for number, experiment in enumerate(data.experiments):
        for channel in bound_to.output_channels:
            simulated = simulation.outputs[number][channel]
            scored = scored_samples(bound_to, data, number, channel, simulated)
            if not scored.any():
                raise DataError(
                    f"experiment {experiment.name!r} has {experiment.n_samples} samples, none of {channel!r} after the "
                    "first ones that start the simulation: take a longer record"
                )
            measured = experiment.values[channel][scored]
            error = measured - simulated[scored]
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
    return Validation(bound_to, data, tuple(scores), tuple(dict(o) for o in simulation.outputs))


def scored_samples(model: Model, data: Dataset, number: int, channel: str, simulated: Array) -> Mask:
    """Return which samples of an output of an experiment are compared with its free run, shape (n,).

    They are not missing, and lie after the warm-up and after the samples that start the run.
    """
    begun = int(np.argmax(~np.isnan(simulated)))
    there = ~np.isnan(data.values(channel, number))
    return np.asarray(there & (np.arange(len(there)) >= max(data.n_init, begun + model.max_lag)))
