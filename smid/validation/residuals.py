"""Residuals of a model's free run: whiteness, independence of the inputs, spectrum.

The residual is the measured output minus the free run, after the warm-up. A model that is right leaves a residual as
white as the noise of the sensor, and independent of the inputs. Each test counts the lags outside the 99 % band; one in
a hundred is there by chance. A test is failed if chance gives such a correlation in less than 1 % of records; see
`Correlation.chance`. Correlation with an input at positive lags shows dynamics that the model lacks; at negative lags
only, it shows feedback from output to input.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from relaxations.algebra.arrays import Array
from smid.data import DataError, Dataset, Experiment
from smid.data.given import Given
from smid.display.from_plain import Plain, fields_from_plain, read
from smid.display.result import Part, Tabular
from smid.display.table import Table
from smid.signals.spectrum import Spectrum, spectrum
from smid.validation.correlation import FEWEST, SIGNIFICANT, Correlation, autocorrelation, cross_correlation
from smid.validation.scores import Validation
from smid.validation.validate import Candidate, validate

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False, repr=False)
class OutputResiduals(Tabular):
    """Tests of the residual of one output.

    Parameters
    ----------
    own
        Correlation with its own past.
    with_inputs
        Correlations with the inputs that are not constant.
    sampling_time
        In seconds.
    """

    channel: str
    unit: str
    samples: int
    rmse: float
    mean: float
    own: Correlation
    with_inputs: tuple[Correlation, ...]
    sampling_time: float

    @property
    def is_white(self) -> bool:
        """Tell whether the residual passes the test of whiteness."""
        return self.own.chance >= SIGNIFICANT

    @property
    def depends_on(self) -> tuple[str, ...]:
        """Return the inputs with which the residual is correlated."""
        return tuple(one.against for one in self.with_inputs if one.chance < SIGNIFICANT)

    @property
    def sentences(self) -> tuple[str, ...]:
        """Return the verdicts, one sentence for each test."""
        size = f"{self.channel}: RMSE {self.rmse:.4g} {self.unit}".rstrip()
        size += f", mean {self.mean:.4g} {self.unit}".rstrip()
        verdict = "The residual is white" if self.is_white else "The residual is not white"
        found = [f"{size}. {verdict}: {self._counted(self.own)}"]
        for one in self.with_inputs:
            if one.chance >= SIGNIFICANT:
                verdict = f"No significant dependence on {one.against}"
            elif not np.any(one.outside & (one.lags >= 0)):
                verdict = f"It is followed by {one.against}, which is feedback"
            else:
                verdict = f"It depends on {one.against}, which the model does not explain"
            found.append(f"{verdict}: {self._counted(one)}")
        return tuple(found)

    @staticmethod
    def _counted(one: Correlation) -> str:
        count, chance = int(one.outside.sum()), 0.01 * one.lags.size
        return f"{count} of {one.lags.size} lags are outside the 99 % band; chance gives {chance:.2g}."

    def _rows(self) -> Iterator[dict[str, Any]]:
        for one in (self.own, *self.with_inputs):
            lag, value = one.strongest, float(np.abs(one.values).max())
            yield {
                "output": self.channel,
                "with": one.against or "own past",
                "lags": int(one.lags.size),
                "outside": int(one.outside.sum()),
                "share": float(one.outside.mean()),
                "band": float(one.band),
                "largest": value,
                "lag": lag * self.sampling_time,
                "chance": one.chance,
            }

    @property
    def table(self) -> Table:
        """Return a table with one row for each test."""
        return _table(self._rows())

    def _content(self) -> Iterator[Part]:
        yield self.table
        yield from self.sentences

    def to_dict(self) -> dict[str, Any]:
        """Return plain data: the ``output residuals`` of docs/json.md."""
        return {
            "channel": self.channel,
            "unit": self.unit,
            "samples": self.samples,
            "rmse": self.rmse,
            "mean": self.mean,
            "white": self.is_white,
            "depends_on": list(self.depends_on),
            "tests": [
                {**row, "lag_samples": one.lags.tolist(), "correlation": one.values.tolist()}
                for row, one in zip(self._rows(), (self.own, *self.with_inputs), strict=True)
            ],
        }

    @staticmethod
    def from_dict(content: Mapping[str, Any], sampling_time: float) -> OutputResiduals:
        """Return the tests that `to_dict` described."""
        own, *others = read(content, "tests", tuple[Plain, ...])
        found: OutputResiduals = fields_from_plain(
            OutputResiduals,
            content,
            own=_correlation(own, ""),
            with_inputs=tuple(_correlation(test, read(test, "with", str)) for test in others),
            sampling_time=sampling_time,
        )
        return found


def _correlation(test: Mapping[str, Any], against: str) -> Correlation:
    lags = read(test, "lag_samples", NDArray[np.int64])
    return Correlation(against, lags, read(test, "correlation", Array), read(test, "band", float))


def _table(rows: Iterator[dict[str, Any]]) -> Table:
    cells = tuple(
        (
            row["output"],
            row["with"],
            "passed" if row["chance"] >= SIGNIFICANT else "failed",
            f"{row['outside']} of {row['lags']}",
            f"{0.01 * row['lags']:.2g}",
            f"{row['largest']:.3f}",
            f"{row['band']:.3f}",
            f"{row['lag']:.4g}",
            f"{row['chance']:.2g}" if row["chance"] >= 1e-4 else "< 0.0001",
        )
        for row in rows
    )
    header = ("residual", "with", "test", "outside 99 %", "by chance", "largest", "band", "at lag [s]", "probability")
    return Table("", header, cells, "lllrrrrrr")


@dataclass(frozen=True, eq=False, repr=False)
class Residuals(Tabular):
    """Tests of the residuals of a model's free run.

    Parameters
    ----------
    validation
        The free run, and its scores.
    errors
        The residuals as outputs, beside the inputs: an experiment for each stretch of samples that are scored.
    outputs
        One entry for each output of the model.
    spectrum
        Of the residuals and the inputs, with their coherence.
    """

    SCHEMA: ClassVar = "smid.residual-analysis/1"

    validation: Validation
    errors: Dataset
    outputs: tuple[OutputResiduals, ...]
    spectrum: Spectrum

    @property
    def is_white(self) -> bool:
        """Tell whether the residual of every output is white and independent of every input."""
        return all(one.is_white and not one.depends_on for one in self.outputs)

    @property
    def conclusion(self) -> str:
        """Return the verdict on all outputs in one sentence."""
        tests = [row["chance"] >= SIGNIFICANT for row in self._rows()]
        if all(tests):
            return "The residuals pass all tests: they are white, and show no significant dependence on the inputs."
        return f"The residuals fail {tests.count(False)} of {len(tests)} tests: the model or its noise lacks something."

    @property
    def sentences(self) -> tuple[str, ...]:
        """Return the verdicts, one sentence for each test."""
        return tuple(sentence for one in self.outputs for sentence in one.sentences)

    @property
    def table(self) -> Table:
        """Return a table with one row for each output and test."""
        return _table(self._rows())

    def _content(self) -> Iterator[Part]:
        yield self.table
        yield from self.sentences
        yield self.conclusion

    def _rows(self) -> Iterator[dict[str, Any]]:
        return (row for one in self.outputs for row in one._rows())

    def to_dict(self) -> dict[str, Any]:
        """Return plain data: the ``residual analysis`` of the versioned JSON schema in docs/json.md."""
        return {
            "schema": self.SCHEMA,
            "validation": self.validation.to_dict(),
            "outputs": [one.to_dict() for one in self.outputs],
            "spectrum": self.spectrum.to_dict(),
        }

    @staticmethod
    def from_dict(content: Mapping[str, Any], data: Dataset | None = None) -> Residuals:
        """Return the analysis that `to_dict` described; the residuals are computed again if the record is given."""
        run = Validation.from_dict(read(content, "validation", Plain), data)
        errors = run.data if data is None else _errors(run)
        told = read(content, "outputs", tuple[Plain, ...])
        outputs = tuple(OutputResiduals.from_dict(one, run.data.sampling_time) for one in told)
        return Residuals(run, errors, outputs, Spectrum.from_dict(read(content, "spectrum", Plain), errors))

    def plot(self, number: int = 0) -> Figure:
        """Return a figure of the residual, its correlations, spectrum and coherences, for the output of this number."""
        from smid.validation.figures import residuals_figure

        return residuals_figure(self, number)


def residuals(model: Candidate, data: Given) -> Residuals:
    """Test the residuals of a model's free run: whiteness, independence of the inputs, spectrum.

    Parameters
    ----------
    model
        With parameter values. An estimate stands for its central model, and a fit for its model.
    data
        As for :func:`smid.identify`.

    Raises
    ------
    ModelError, DataError
        If the model has no values or does not fit the data, or if a residual is constant or has fewer than 40 samples.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> rng = np.random.default_rng(0)
    >>> u, w = rng.standard_normal(300), np.zeros(300)
    >>> for k in range(1, 300):
    ...     w[k] = 0.8 * w[k - 1] + u[k - 1]
    >>> data = Dataset.from_arrays(input={"u": u}, output={"y": w + rng.standard_normal(300)}, sampling_time=1.0)
    >>> found = [residuals(OutputError().with_values({"a1": a, "b0": 1.0}), data).is_white for a in (-0.8, -0.5)]
    >>> found
    [True, False]
    """
    run = validate(model, data)
    data = run.data
    errors = _errors(run)
    outputs = []
    for channel in run.model.output_channels:
        parts = [experiment.values[channel] for experiment in errors.experiments]
        whole = np.concatenate(parts)
        if whole.size < FEWEST:
            raise DataError(
                f"the residual of {channel!r} has {whole.size} samples after the warm-up: its tests need {FEWEST}"
            )
        own = autocorrelation(parts)
        if own is None or np.ptp(whole) <= 1e-12 * np.nanmax(np.abs(data.stacked(channel))):
            raise DataError(
                f"the residual of {channel!r} is constant, as of a record without noise or of a constant output: there "
                "is nothing to test"
            )
        inputs = {name: [one.values[name] for one in errors.experiments] for name in errors.inputs}
        tested = (cross_correlation(parts, values, name) for name, values in inputs.items())
        outputs.append(
            OutputResiduals(
                channel,
                data.channel(channel).unit,
                whole.size,
                float(np.sqrt(np.mean(whole**2))),
                float(whole.mean()),
                own,
                tuple(one for one in tested if one is not None),
                data.sampling_time,
            )
        )
    return Residuals(run, errors, tuple(outputs), spectrum(errors))


def _errors(run: Validation) -> Dataset:
    """Return the residuals as outputs, beside the inputs: the stretches of samples that are scored."""
    inputs, outputs = run.model.exogenous_channels, run.model.output_channels
    experiments = []
    for k, measured in enumerate(run.data.experiments):
        errors = {name: run.error(k * len(outputs) + j) for j, name in enumerate(outputs)}
        start = int(np.argmax(~np.isnan(list(errors.values())).any(axis=0)))
        values = {name: measured.values[name] for name in inputs} | errors
        cut = {name: samples[start:] for name, samples in values.items()}
        experiments.append(Experiment(measured.name, cut, float(run.data.time(k)[start])))
    errors_alone = replace(
        run.data,
        experiments=tuple(experiments),
        channels=tuple(run.data.channel(name) for name in (*inputs, *outputs)),
        inputs=inputs,
        outputs=outputs,
        n_init=0,
        resampling=(),
        normalisation=None,
    )
    return errors_alone.without_gaps()
