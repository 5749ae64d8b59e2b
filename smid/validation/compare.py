"""Comparison of several models by their free runs over one record, all on the same samples."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

import numpy as np

from smid.data import DataError, Dataset
from smid.data.given import Given
from smid.data.reference import identity, referred
from smid.display.from_plain import Plain, read
from smid.display.result import Part, Tabular
from smid.display.table import Table
from smid.identification.estimate import Estimate
from smid.models import Model, ModelError
from smid.validation.fit import ModelFit
from smid.validation.scores import Score, Validation
from smid.validation.validate import Candidate, bound_model, validate

if TYPE_CHECKING:
    from matplotlib.figure import Figure

M = TypeVar("M")
T = TypeVar("T")
D = TypeVar("D")


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Tabular):
    """Free runs of several models over one record.

    Parameters
    ----------
    validations
        By name of the model, the best mean fit first.
    """

    SCHEMA: ClassVar = "smid.comparison/1"

    data: Dataset
    validations: Mapping[str, Validation]

    def __len__(self) -> int:
        return len(self.validations)

    def __iter__(self) -> Iterator[str]:
        return iter(self.validations)

    def __getitem__(self, name: str) -> Validation:
        return self.validations[name]

    @property
    def best(self) -> str:
        """Return the name of the model with the best mean fit."""
        return next(iter(self.validations))

    @property
    def _scores(self) -> Iterator[tuple[str, Score]]:
        """Yield name and score, experiment by experiment and output by output, the best fit first."""
        for scores in zip(*(run.scores for run in self.validations.values()), strict=True):
            yield from sorted(zip(self.validations, scores, strict=True), key=lambda one: -one[1].fit_percent)

    @property
    def table(self) -> Table:
        """Return a table with one row for each experiment, output and model, the best fit first."""
        rows = tuple(
            (
                name,
                f"{s.fit_percent:.2f}",
                f"{s.rmse:.4g} {s.unit}".rstrip(),
                f"{s.largest:.4g} {s.unit}".rstrip(),
                s.channel,
                s.experiment,
                str(s.samples),
            )
            for name, s in self._scores
        )
        return Table("", ("model", "fit %", "RMSE", "largest", "output", "experiment", "samples"), rows, "lrrrllr")

    def _content(self) -> Iterator[Part]:
        yield self.table
        yield self.sentence

    @property
    def sentence(self) -> str:
        """Return the best model and its mean fit, in one sentence."""
        means = {name: mean_fit(run) for name, run in self.validations.items()}
        of = "" if len(self.validations[self.best].scores) == 1 else "mean "
        others = ", ".join(f"{name} {fit:.2f} %" for name, fit in list(means.items())[1:])
        return f"Best {of}fit: {self.best}, {means[self.best]:.2f} %{f' ({others})' if others else ''}."

    def _rows(self) -> Iterator[dict[str, Any]]:
        return ({"model": name, **asdict(score)} for name, score in self._scores)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data: the ``comparison`` of the versioned JSON schema in docs/json.md."""
        return {
            "schema": self.SCHEMA,
            "data": identity(self.data),
            "order": list(self.validations),
            "validations": {name: run.to_dict() for name, run in self.validations.items()},
        }

    @staticmethod
    def from_dict(content: Mapping[str, Any], data: Dataset | None = None) -> Comparison:
        """Return the comparison that `to_dict` described; the free runs are repeated if the record is given."""
        record = referred(read(content, "data", Plain), data)
        runs = read(content, "validations", Plain)
        validations = {
            name: Validation.from_dict(read(runs, name, Plain), data)
            for name in read(content, "order", tuple[str, ...])
        }
        return Comparison(record, validations)

    def plot(self, number: int = 0) -> Figure:
        """Return a figure of measured output, all free runs and errors, for the score of this number.

        Scores count outputs within experiments, as in each validation.
        """
        from smid.validation.figures import comparison_figure

        return comparison_figure(self, number)


def mean_fit(run: Validation) -> float:
    """Return the mean fit over all experiments and outputs, in percent."""
    return float(np.mean([score.fit_percent for score in run.scores]))


def compare(models: Mapping[str, Candidate] | Sequence[Candidate], data: Given) -> Comparison:
    """Compare the free runs of several models over one record.

    Every model is scored on the same samples: those after the longest start that one of the models needs.

    Parameters
    ----------
    models
        With parameter values. An estimate stands for its central model, a fit for its model. A mapping gives the names;
        a model of a sequence has its own name, with a number if another one has it too.
    data
        As for :func:`smid.identify`.

    Raises
    ------
    ModelError, DataError
        If a model has no values or does not fit the data, or if an output is constant, which has no fit.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> u, y = [1.0, 0, 1, 1, 0, 0, 1], [0.0, 1, 0.5, 1.25, 1.6, 0.8, 0.4]
    >>> data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    >>> slow = OutputError(na=1).with_values({"a1": -0.9, "b0": 0.3})
    >>> fast = OutputError(na=1).with_values({"a1": -0.5, "b0": 1.0})
    >>> compare({"slow": slow, "fast": fast}, data).best
    'fast'
    """
    named = _named(models)
    name, given = next(iter(named.items()))
    _, data = _told(name, bound_model, given, data)  # the first model names the channels of arrays
    bound = {}
    for name, given in named.items():
        bound[name], own = _told(name, bound_model, given, data)
        for here, there in zip(data.channels, own.channels, strict=True):
            if here.unit and here.unit != there.unit:
                raise ModelError(f"model {name!r} was estimated with {there}, not {here}: compare models in one unit")
    # Score all models on the same samples.
    start = max(data.n_init, *(model.max_lag for model in bound.values()))
    for run in data.experiments:
        if run.n_samples <= start:
            raise DataError(
                f"experiment {run.name!r} has {run.n_samples} samples, none after the first {start} that start the "
                "simulations: take a longer record"
            )
    scored = data.with_n_init(start)
    found = {name: _told(name, validate, model, scored) for name, model in bound.items()}
    first = next(iter(found.values()))
    for name, other in found.items():
        if other.model.output_channels != first.model.output_channels:
            raise ModelError(
                f"model {name!r} has the outputs {', '.join(other.model.output_channels)}, not "
                f"{', '.join(first.model.output_channels)}: compare models of the same outputs"
            )
    for score in first.scores:  # the measured output is the same for all
        if not np.isfinite(score.fit_percent):
            raise DataError(
                f"output {score.channel!r} is constant in experiment {score.experiment!r}, so it has no fit: "
                "leave the experiment out"
            )
    ranked = sorted(found.items(), key=lambda one: -mean_fit(one[1]))
    return Comparison(data, dict(ranked))


def _told(name: str, work: Callable[[M, D], T], model: M, data: D) -> T:
    """Return what the work returns; its errors name the model."""
    try:
        return work(model, data)
    except (ModelError, DataError) as error:
        raise type(error)(f"model {name!r}: {error}") from None


def _named(models: Mapping[str, Candidate] | Sequence[Candidate]) -> dict[str, Candidate]:
    """Return the candidates by name; those of a sequence that share one are numbered."""
    if isinstance(models, Model | Estimate | ModelFit):
        raise TypeError(f"a single {type(models).__name__} was given: give a list or a mapping of models")
    if isinstance(models, Mapping):
        named = dict(models)
    else:
        own = [
            one.model.name if isinstance(one, Estimate | ModelFit) else getattr(one, "name", "model") for one in models
        ]
        numbered = [f"{name} {own[: k + 1].count(name)}" if own.count(name) > 1 else name for k, name in enumerate(own)]
        named = dict(zip(numbered, models, strict=True))
    if not named:
        raise ModelError("no model to compare: give at least one")
    return named
