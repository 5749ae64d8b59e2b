"""A sensor on records with the measured output: error, coverage and width, also where samples are lost at random."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.deadline import Progress
from smid.data import Dataset
from smid.display.result import Part, Tabular
from smid.display.table import Table
from smid.models import ModelError
from smid.sensors.bounded import BoundedSensor, IntervalPrediction
from smid.sensors.prediction import Prediction
from smid.sensors.sensor import require_channels, trained
from smid.sensors.trained_on import Signal

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["SensorCheck", "SensorScore", "check_sensor"]


@dataclass(frozen=True)
class SensorScore:
    """What a sensor says of one record.

    Parameters
    ----------
    rmse
        In the unit of the output.
    coverage
        Share of the measured outputs inside the interval, from 0 to 1.
    mean_width
        Of the interval, in the unit of the output.
    lost
        Number of samples that were lost.

    Examples
    --------
    >>> SensorScore("run", samples=100, rmse=0.1, coverage=1.0, mean_width=0.6).lost
    0
    """

    record: str
    samples: int
    rmse: float
    coverage: float
    mean_width: float
    lost: int = 0


@dataclass(frozen=True, eq=False, repr=False)
class SensorCheck(Tabular):
    """The errors and intervals of a sensor on records.

    Parameters
    ----------
    prediction, data
        The intervals and the records, in the units of the sensor.
    """

    output: Signal
    scores: tuple[SensorScore, ...]
    prediction: IntervalPrediction
    data: Dataset

    @property
    def conclusion(self) -> str:
        """Return the result in a sentence."""
        n = sum(s.samples for s in self.scores)
        inside = sum(s.coverage * s.samples for s in self.scores) / n
        rmse = np.sqrt(sum(s.rmse**2 * s.samples for s in self.scores) / n)
        lost = sum(s.lost for s in self.scores)
        words = f" {lost} lost samples were bridged." * bool(lost)
        unit = f" {self.output.unit}".rstrip()
        return (
            f"RMSE {rmse:.4g}{unit} over {n} samples; {100 * inside:.2f} % of the measured {self.output.name} lies "
            f"inside the interval.{words}"
        )

    @property
    def table(self) -> Table:
        """Return the scores as text."""
        unit = f" [{self.output.unit}]" * bool(self.output.unit)
        rows = tuple(
            (s.record, str(s.samples), str(s.lost), f"{s.rmse:.4g}", f"{100 * s.coverage:.2f} %", f"{s.mean_width:.4g}")
            for s in self.scores
        )
        header = ("record", "samples", "lost", f"RMSE{unit}", "inside", f"mean width{unit}")
        return Table(f"The sensor of {self.output.name} on records.", header, rows, "lrrrrr")

    def _content(self) -> Iterator[Part]:
        yield self.table
        yield self.conclusion
        yield from self.prediction.warnings

    def _rows(self) -> Iterator[dict[str, Any]]:
        return (dict(vars(score)) for score in self.scores)

    def plot(self) -> Figure:
        """Draw each record with its interval, and the error."""
        from smid.sensors.figures import check_figure

        return check_figure(self)

    def to_dict(self) -> dict[str, Any]:
        """Return the scores as plain data."""
        return {"output": self.output.name, "scores": list(self._rows()), "conclusion": self.conclusion}


def check_sensor(
    sensor: BoundedSensor, data: Dataset, *, lose: float = 0.0, seed: int = 1, progress: Progress | None = None
) -> SensorCheck:
    """Return error, coverage and width of a sensor on records with the measured output.

    Parameters
    ----------
    lose
        Share of the samples of each channel that are lost at random, from 0 to below 1.
    seed
        Of the samples that are lost.

    Raises
    ------
    DataError
        As `VirtualSensor.predict`, and if there is no measured output.
    ModelError
        If the share is not from 0 to below 1.

    Examples
    --------
    >>> from smid.data.bundled import load_clutch
    >>> from smid.sensors import CFPX, bound_error
    >>> data = load_clutch("20C_ramp_a").crop(0, 300)
    >>> sensor = bound_error(CFPX(3).fit(data, seed=1), data)
    >>> check_sensor(sensor, data, lose=0.1).scores[0].coverage
    1.0
    """
    if not 0.0 <= lose < 1.0:
        raise ModelError(f"lose = {lose}: give the share of lost samples, from 0 to below 1, such as 0.1")
    told = trained(sensor.trained_on, sensor)
    require_channels(data, (*sensor.sensor.channels, told.output.name))
    found = sensor.predict(data)
    data, _ = told.read(data)
    counts = [0] * len(data.experiments)
    if lose:
        generator, parts = np.random.default_rng(seed), []
        for k, run in enumerate(data.experiments):
            inputs = {signal.name: run.values[signal.name] for signal in told.inputs}
            away = {name: generator.random(run.n_samples) < lose for name in inputs}
            for mask in away.values():
                mask[0] = False
            counts[k] = sum(int(mask.sum()) for mask in away.values())
            holed = {name: np.where(away[name], np.nan, x) for name, x in inputs.items()}
            parts.append(_streamed(sensor, holed, told.sampling_time, run.name, progress))
        position, lower, upper = zip(*parts, strict=True)
        said = found.prediction
        bare = Prediction(said.output, said.records, position, said.warnings)
        found = IntervalPrediction(bare, lower, upper)
    errors = found.prediction.rmse(data)
    inside = found.coverage(data)
    scores = tuple(
        SensorScore(
            run.name,
            run.n_samples - data.n_init,
            errors[run.name],
            inside[run.name],
            float(np.mean((high - low)[data.n_init :])),
            lost,
        )
        for run, low, high, lost in zip(data.experiments, found.lower, found.upper, counts, strict=True)
    )
    return SensorCheck(told.output, scores, found, data)


def _streamed(
    sensor: BoundedSensor, inputs: dict[str, Array], interval: float, name: str, progress: Progress | None
) -> tuple[Array, Array, Array]:
    """Return position, lower and upper of a record with NaN for lost samples."""
    stream, found = sensor.stream(), []
    n = next(iter(inputs.values())).size
    for k in range(n):
        now = stream.update(interval * k, **{channel: float(x[k]) for channel, x in inputs.items()})
        found.append((now.position, now.lower, now.upper))
        if progress is not None and k % 100 == 0:
            progress(f"{name}: sample {k} of {n}")
    position, lower, upper = np.array(found).T
    return position, lower, upper
