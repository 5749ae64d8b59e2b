r"""Fit of a model's free run to a record by least squares or by the least largest error, with standard errors.

With J the derivative of the free run by the fitted parameters and initial states, standard errors are the roots of

.. math::  (J' J)^{-1} J' \Sigma J (J' J)^{-1}, \qquad
           \sigma_c^2 = \frac{\|e_c\|^2}{n_c} \, \frac{n}{n - p},

with the residuals e_c of output c on the diagonal of Sigma. They hold for white residuals, and for a minimum inside the
prior bounds: elsewhere none is given, and the reason is told.

Reference: Ljung, System Identification, 2nd ed., section 9.4.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from numbers import Integral
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data import Dataset
from smid.data.given import Given, as_dataset
from smid.data.listing import missing_notes
from smid.data.reference import identity, referred
from smid.display.from_plain import NotPlainError, Plain, read
from smid.display.result import Part, Tabular, plain
from smid.display.table import Table
from smid.feasible.feasible_set import check_samples
from smid.fitting.binding import bind
from smid.fitting.constraints import Constraints, constrained
from smid.fitting.fit import best_of_starts
from smid.fitting.minimax import minimax
from smid.fitting.problem import Fitting
from smid.models import Model, ModelError
from smid.models.sensitivities import Initial
from smid.validation.correlation import SIGNIFICANT, autocorrelation
from smid.validation.scores import Score, scores_from, scores_of, scores_table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FitMethod = Literal["least_squares", "minimax"]
METHODS: Mapping[str, str] = {"least_squares": "least squares", "minimax": "least largest error"}
_END = 1e-6  # of the width: a value nearer than that to an end of its box lies at the end
_SINGULAR = 1e-8  # smallest singular value of the scaled derivative, by the largest


@dataclass(frozen=True, eq=False, repr=False)
class ModelFit(Tabular):
    """A model fitted to data: a local minimum, without proof.

    Parameters
    ----------
    model
        With the fitted values.
    method
        "least_squares" or "minimax".
    scores
        One for each experiment and output channel, on the fitted samples.
    initial
        Per experiment, the fitted states before the first sample.
    standard_errors
        By parameter; NaN where there is none.
    reason
        Why there are no standard errors; empty where there are some.
    simulated
        Per experiment, the simulated output channels; none in a fit that was loaded without its record.
    """

    SCHEMA: ClassVar = "smid.model-fit/1"

    model: Model
    data: Dataset
    method: FitMethod
    scores: tuple[Score, ...]
    initial: tuple[Initial, ...]
    standard_errors: Mapping[str, float]
    reason: str
    simulated: tuple[Mapping[str, Array], ...]

    def __len__(self) -> int:
        return len(self.parameters)

    def __iter__(self) -> Iterator[str]:
        return iter(self.parameters)

    def __getitem__(self, name: str) -> float:
        if name not in self.parameters:
            raise KeyError(f"no parameter {name!r}: the model has {', '.join(self.parameters)}")
        return self.parameters[name]

    @property
    def parameters(self) -> dict[str, float]:
        """Return the values of the parameters, known ones included."""
        return {p.name: self.model.values.get(p.name, p.lower) for p in self.model.parameters}

    @property
    def table(self) -> Table:
        """Return a row for each parameter."""
        rows = tuple(
            (
                row["name"],
                f"{row['value']:.6g}",
                f"{row['standard_error']:.2g}" if row["standard_error"] >= 0 else "-",
                row["unit"],
                {"lower": "at the lower end", "upper": "at the upper end"}.get(row["prior"], row["prior"]),
            )
            for row in self._rows()
        )
        header = ("parameter", "value", "std. error", "unit", "prior")
        samples = f"{sum(s.samples for s in self.scores)} samples"
        return Table(f"{self.model.name} fitted to {samples} by {METHODS[self.method]}", header, rows, "lrrll")

    @property
    def score_table(self) -> Table:
        """Return a row for each experiment and output."""
        whole = scores_table(self.scores)
        return Table("", whole.header[:-1], tuple(row[:-1] for row in whole.rows), whole.align[:-1])

    @property
    def sentence(self) -> str:
        """Return the fit of the worst output, in one sentence."""
        worst = min(self.scores, key=lambda score: score.fit_percent)
        what = "Fit" if len(self.scores) == 1 else f"Lowest fit, of {worst.channel} in {worst.experiment}:"
        return f"{what} {worst.fit_percent:.2f} %, RMSE {worst.rmse:.4g} {worst.unit}".rstrip() + "."

    @property
    def notes(self) -> tuple[str, ...]:
        """Return what the numbers mean, in sentences."""
        given = self.reason or (
            "Standard errors hold for white noise at the output; they are no bounds. smid.identify certifies intervals."
        )
        return (given, "A fit is a local minimum from several starts, without proof.")

    def error(self, number: int) -> Array:
        """Return measured minus simulated output of a score, by its number, shape (n,); NaN where it is not fitted."""
        channel, k = self.scores[number].channel, self.experiment(number)
        error = self.data.values(channel, k) - self.simulated[k][channel]
        return np.where(np.arange(len(error)) >= self.data.n_init, error, np.nan)

    def experiment(self, number: int) -> int:
        """Return the number of the experiment of the score of this number."""
        return number // len(self.model.output_channels)

    def _content(self) -> Iterator[Part]:
        yield self.table
        yield self.score_table
        yield from missing_notes(self.data)
        yield from self.notes

    def _rows(self) -> Iterator[dict[str, Any]]:
        for p in self.model.parameters:
            value = self.parameters[p.name]
            error = self.standard_errors.get(p.name, np.nan)
            yield {"name": p.name, "unit": p.unit, "value": value, "standard_error": error, "prior": _place(p, value)}

    def to_dict(self) -> dict[str, Any]:
        """Return plain data: the ``model fit`` of the versioned JSON schema in docs/json.md."""
        return {
            "schema": self.SCHEMA,
            "model": self.model.to_dict(),
            "data": identity(self.data),
            "method": self.method,
            "parameters": plain(list(self._rows())),
            "scores": plain(self.scores),
            "initial": [{f"{name}[-{lag}]": value for (name, lag), value in one.items()} for one in self.initial],
            "reason": self.reason,
        }

    @staticmethod
    def from_dict(content: Mapping[str, Any], data: Dataset | None = None) -> ModelFit:
        """Return the fit that `to_dict` described; the free runs are repeated if the record is given."""
        model, record = read(content, "model", Model), referred(read(content, "data", Plain), data)
        initial = tuple(
            {_reference(text): value for text, value in one.items()}
            for one in read(content, "initial", tuple[Mapping[str, float], ...])
        )
        simulated: tuple[Mapping[str, Array], ...] = ()
        if data is not None:
            problem = _problem(model, data)
            simulated = tuple(problem.simulate(problem.at(model.values, initial)))
        errors = {
            read(row, "name", str): read(row, "standard_error", float)
            for row in read(content, "parameters", tuple[Plain, ...])
        }
        return ModelFit(
            model,
            record,
            read(content, "method", Literal["least_squares", "minimax"]),
            scores_from(content),
            initial,
            errors,
            read(content, "reason", str),
            simulated,
        )

    def plot(self, number: int = 0) -> Figure:
        """Return a figure of measured output, free run and error, for the score of this number."""
        from smid.validation.figures import simulation_figure

        return simulation_figure(self, number)


def fit(model: Model, data: Given, method: FitMethod = "least_squares", *, starts: int = 6, seed: int = 0) -> ModelFit:
    """Fit the free run of a model to data, by least squares or by the least largest error.

    Parameters and initial states are fitted together, to all experiments. The prior bounds and the constraints of the
    model are kept. A missing sample is not fitted.

    Parameters
    ----------
    model
        Parameter values that it carries are the first start.
    data
        As for :func:`smid.identify`.
    method
        "least_squares" minimises the sum of squares over all outputs, each divided by its standard deviation;
        "minimax" the largest error in these units, from the least-squares fit.
    starts
        How many starting points: the values of the model, a one-step-ahead fit, then random values.
    seed
        Of the random values.

    Raises
    ------
    ModelError, DataError
        If the model does not fit the data, cannot be simulated on them, or the method is unknown.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> rng = np.random.default_rng(0)
    >>> u, w = rng.standard_normal(200), np.zeros(200)
    >>> for k in range(1, 200):
    ...     w[k] = 0.5 * w[k - 1] + u[k - 1]
    >>> y = w + 0.1 * rng.standard_normal(200)
    >>> found = fit(OutputError(), Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0))
    >>> abs(found["a1"] + 0.5) < 3 * found.standard_errors["a1"] < 0.05
    True
    """
    if method not in METHODS:
        raise ModelError(f"method = {method!r} is unknown: take {' or '.join(METHODS)}")
    if not (isinstance(starts, Integral) and starts >= 1):
        raise ModelError(f"starts = {starts}: give a whole number of at least 1")
    data = as_dataset(data, model)
    bound = bind(model, data)
    if not bound.output_channels:
        raise ModelError("a fit needs a model with a measured output: it compares free runs")
    check_samples(bound, data)
    # Fit, and keep the constraints of the parameters.
    problem = _problem(bound, data)
    constraints = Constraints.of(problem)
    vector, _ = best_of_starts(problem, starts, seed)
    if constraints.violated(vector):
        vector = constrained(problem, vector, constraints)
    if constraints.violated(vector):
        raise ModelError("no fit was found that keeps the constraints of the model: give start values that keep them")
    if method == "minimax":
        vector, _ = minimax(problem, vector)
    # Judge it on the fitted samples.
    found = problem.result(vector, 0.0)
    fitted = [
        {channel: mask & ~np.isnan(run.values[channel]) for channel in bound.output_channels}
        for run, mask in zip(data.experiments, problem.used, strict=True)
    ]
    scores = scores_of(data, found.simulated, fitted)
    reason = _no_errors(problem, vector, method, constraints)
    errors, reason = ({}, reason) if reason else _standard_errors(problem, vector)
    return ModelFit(found.model, data, method, scores, found.initial, errors, reason, found.simulated)


def _problem(model: Model, data: Dataset) -> Fitting:
    return Fitting(model, data, [np.arange(run.n_samples) >= data.n_init for run in data.experiments])


def _no_errors(problem: Fitting, vector: Array, method: FitMethod, constraints: Constraints) -> str:
    """Return why the fit has no standard errors; empty where it has."""
    if method == "minimax":
        return "No standard errors: they belong to least squares."
    if constraints.active(vector):
        return "No standard errors: the fit lies at a constraint of the model."
    for channel in (m.channel for m in problem.outputs):
        found = autocorrelation(_stretches(problem, vector, channel))
        if found is not None and found.chance < SIGNIFICANT:
            return (
                f"No standard errors: the residual of {channel} is not white, and they would be too small. "
                "smid.residuals shows what it contains."
            )
    return ""


def _stretches(problem: Fitting, vector: Array, channel: str) -> list[Array]:
    """Return the residual of a channel, between missing samples."""
    found = []
    for e, name, error, _ in problem.errors(vector, False):
        if name == channel:
            kept = np.where(problem.used[e][: len(error)], error, np.nan)
            cuts = np.flatnonzero(np.isnan(kept))
            found += [part[~np.isnan(part)] for part in np.split(kept, cuts) if not np.isnan(part).all()]
    return found


def _standard_errors(problem: Fitting, vector: Array) -> tuple[dict[str, float], str]:
    """Return the standard error of each parameter inside its box, and why there is none."""
    lower, upper = problem.box
    inside = (vector - lower > _END * (upper - lower)) & (upper - vector > _END * (upper - lower))
    inside |= ~np.isfinite(upper - lower) & (vector > lower) & (vector < upper)
    count = int(inside.sum())
    # Gather derivatives and noise powers of each output.
    slopes: dict[str, list[Array]] = {m.channel: [] for m in problem.outputs}
    squares = dict.fromkeys(slopes, 0.0)
    for e, channel, error, slope in problem.errors(vector, True):
        kept = problem.used[e][: len(error)] & ~np.isnan(error)
        slopes[channel].append(slope[kept][:, inside] / problem.scale[channel])
        squares[channel] += float(np.sum((error[kept] / problem.scale[channel]) ** 2))
    blocks = {channel: np.concatenate(parts) for channel, parts in slopes.items()}
    total = sum(map(len, blocks.values()))
    whole = np.concatenate(list(blocks.values()))
    size = np.linalg.norm(whole, axis=0)
    if total <= count or not np.isfinite(whole).all() or not size.all():
        return {}, "No standard errors: the data do not determine every parameter and initial state."
    _, singular, turn = np.linalg.svd(whole / size, full_matrices=False)
    if singular[-1] < _SINGULAR * singular[0]:
        return {}, "No standard errors: the data do not determine every parameter and initial state."
    inverse = (turn.T / singular**2) @ turn
    power = sum(
        squares[channel] / len(block) * total / (total - count) * (block / size).T @ (block / size)
        for channel, block in blocks.items()
    )
    variances = np.full(len(vector), np.nan)
    variances[inside] = np.diag(inverse @ power @ inverse) / size**2
    names = problem.run.parameters
    return dict(zip(names, np.sqrt(variances[: len(names)]).tolist(), strict=True)), ""


def _place(parameter: Any, value: float) -> str:
    """Return where a value lies in the box of its parameter: "known", "lower", "upper", or "" for inside."""
    width = parameter.upper - parameter.lower
    if width == 0:
        return "known"
    near = _END * width if np.isfinite(width) else 0.0
    return "lower" if value - parameter.lower <= near else "upper" if parameter.upper - value <= near else ""


def _reference(text: str) -> tuple[str, int]:
    found = re.fullmatch(r"(\w+)\[-(\d+)\]", text)
    if found is None:
        raise NotPlainError("initial", f"{text!r} is no state before the first sample")
    return found[1], int(found[2])
