"""The recursive estimators of the clutch thesis on all its record sets.

The models from current to pressure are the thesis's, one pole and one gain (3.24), and Hammerstein regressors with its
powers (3.5). Every setting is the thesis's or follows from the record ``20C_ramp_a`` alone:

- forgetting factor 0.995, normalised gradient with gain 1 and bias 2.2e-16, input scale 0.01 per mA: the thesis's;
- scale of a parameter: the value at which its regressor alone gives the RMS pressure; the start uncertainty is ten
  scales, and the Kalman filter's drift is a thousandth of a scale per sample;
- noise of the Kalman filter: that of the sensor, uniform within 0.3 bar;
- gain of the unnormalised gradient: half of the limit of its stability rule; the thesis's gain 1 exceeds the limit.

The forgetting factor and the Kalman filter run stabilised, and as printed (3.30) to (3.33).

To show the meaning of an a posteriori error of 2e-14 bar, the normalised gradient is also run with noise in place of
the pressure.

Reference: clutch thesis, section 3.3, figures 3.8-3.20.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from smid.data import Dataset
from smid.data.bundled import load_clutch
from smid.display.result import Part, Result
from smid.display.table import Table, figure
from smid.recursive import (
    Arx,
    Comparison,
    ForgettingFactor,
    GainStudy,
    KalmanFilter,
    Method,
    NormalisedGradient,
    Tracking,
    UnnormalisedGradient,
    compare,
    gain_study,
    track,
)
from smid.theses.clutch.plant import INPUT_SCALE, NOISE_BOUND

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["RecursiveStudy", "recursive_study"]

MODELS = (Arx(input_scale=INPUT_SCALE), Arx(powers=(5, 4, 3), input_scale=INPUT_SCALE))
FACTOR, GAIN, THESIS = 0.995, 1.0, 2e-14
SPREAD, DRIFT = 10.0, 1e-3  # in scales of the parameter
NOISE_SEED = 3
SHOWN = "20C_step_a"  # figures 3.8 to 3.11
SHARES = (1e-4, 1e-3, 1e-2, 0.1, 0.5, 0.95, 1.05, 2.0, 10.0)  # of the largest stable gain


@dataclass(frozen=True, eq=False, repr=False)
class RecursiveStudy(Result):
    """The recursive estimators on the clutch records.

    Parameters
    ----------
    comparison
        Every method with every model, by record.
    on_noise
        The normalised gradient on the first record, its pressure replaced by noise.
    gains
        The normalised gradient at several gains on the first record, figure 3.12.
    unnormalised
        The unnormalised gradient over all orders of gains on the record of figure 3.11.
    """

    comparison: Comparison
    on_noise: Tracking
    gains: GainStudy
    unnormalised: GainStudy

    @property
    def normalised(self) -> list[Tracking]:
        """Return the runs of the estimator that was also given noise, on every record."""
        same = (self.on_noise.arx, self.on_noise.method)
        return [t for t in self.comparison.trackings if (t.arx, t.method) == same]

    @property
    def meaning(self) -> str:
        """Return the meaning of the thesis's 2e-14, with the numbers of this study."""
        chosen = self.normalised
        unit, seen = self.on_noise.unit, max(t.largest_left_alone for t in chosen)
        one_step, held = [t.one_step.rmse for t in chosen], [t.held.rmse for t in chosen]
        method = str(self.on_noise.method)
        return (
            f"{method[0].upper()}{method[1:]}, {self.on_noise.arx}: the a posteriori error is at most {figure(seen)} "
            f"{unit} on these records, where the stability rule does not move the poles (the thesis: {THESIS:g}). It "
            f"is {figure(self.on_noise.largest_left_alone)} {unit} with noise in place of the pressure, which no model "
            f"can follow. So this error measures rounding, not a model. One step ahead, the RMSE of the same estimator "
            f"is {figure(min(one_step))} to {figure(max(one_step))} {unit}, and {figure(self.on_noise.one_step.rmse)} "
            f"{unit} on noise. Holding the last pressure gives {figure(min(held))} to {figure(max(held))} {unit}."
        )

    @property
    def summary(self) -> Table:
        """Return the median over the records for each model and method."""
        groups: dict[tuple[str, str], list[Tracking]] = {}
        for tracking in self.comparison.trackings:
            groups.setdefault((str(tracking.arx), str(tracking.method)), []).append(tracking)
        header = ("model", "method", "a posteriori", "one step", "free run", "held", "diverged")
        rows = tuple(
            (
                *names,
                _median(t.a_posteriori.rmse for t in group),
                _median(t.one_step.rmse for t in group),
                _median(t.free_run.rmse for t in group),
                _median(t.held.rmse for t in group),
                f"{sum(not np.isfinite(t.free_run.rmse) for t in group)} of {len(group)}",
            )
            for names, group in groups.items()
        )
        return Table(f"Median over the records of the RMSE [{self.on_noise.unit}]", header, rows, "llrrrrr")

    def _content(self) -> Iterator[Part]:
        yield self.meaning
        yield self.summary
        yield self.gains
        yield self.unnormalised
        yield self.comparison

    def plot(self) -> Figure:
        """Draw the three errors of every method on every record."""
        return self.comparison.plot()

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            **self.comparison.to_dict(),
            "on_noise": self.on_noise.to_dict(),
            "gains": self.gains.to_dict(),
            "unnormalised": self.unnormalised.to_dict(),
            "meaning": self.meaning,
        }


def recursive_study(records: Dataset | None = None) -> RecursiveStudy:
    """Run the recursive estimators on the clutch records, with ARX and with Hammerstein regressors.

    Parameters
    ----------
    records
        With the channels ``current`` (mA) and ``pressure`` (bar); by default all records of the actuator.

    Raises
    ------
    DataError
        If a channel is missing.

    Examples
    --------
    >>> study = recursive_study(load_clutch("20C_step_b").crop(0, 300))
    >>> len(study.comparison.trackings), study.on_noise.largest_left_alone < 1e-12
    (12, True)
    """
    data = _from_current_to_pressure(load_clutch() if records is None else records)
    reference = _from_current_to_pressure(load_clutch("20C_ramp_a"))
    found = [compare([arx], _methods(arx, reference), data).trackings for arx in MODELS]
    per_record = [
        tracking
        for experiment in range(len(data.experiments))
        for trackings in found
        for tracking in trackings
        if tracking.experiment == experiment
    ]
    gradient = NormalisedGradient(GAIN)
    return RecursiveStudy(
        Comparison(tuple(per_record)),
        track(MODELS[0], gradient, _noise_for_pressure(data)),
        gain_study(MODELS[0], gradient, data),
        _unnormalised(data),
    )


def _unnormalised(data: Dataset) -> GainStudy:
    """Return the unnormalised gradient at gains of all orders, and at the thesis's gain 1."""
    shown = data.select(SHOWN) if SHOWN in [run.name for run in data.experiments] else data
    regressors = MODELS[0].matrix(shown.values("current"), shown.values("pressure"))
    largest = UnnormalisedGradient(1.0).largest_gain(regressors)
    gains = sorted({*(share * largest for share in SHARES), 1.0})
    return gain_study(MODELS[0], UnnormalisedGradient(1.0), shown, gains)


def _from_current_to_pressure(data: Dataset) -> Dataset:
    return replace(data, inputs=("current",), outputs=("pressure",))


def _methods(arx: Arx, reference: Dataset) -> tuple[Method, ...]:
    current, pressure = reference.values("current"), reference.values("pressure")
    regressors = arx.matrix(current, pressure)
    scale = np.sqrt(np.mean(pressure**2) / np.mean(regressors**2, axis=0))
    noise = NOISE_BOUND / float(np.sqrt(3))
    forgetting = ForgettingFactor(FACTOR, spread=tuple(SPREAD * scale / noise))
    kalman = KalmanFilter(tuple(DRIFT * scale), noise, tuple(SPREAD * scale))
    return (
        forgetting,
        replace(forgetting, stabilised=False),
        kalman,
        replace(kalman, stabilised=False),
        NormalisedGradient(GAIN),
        UnnormalisedGradient(UnnormalisedGradient(1.0).largest_gain(regressors) / 2),
    )


def _noise_for_pressure(data: Dataset) -> Dataset:
    run = data.experiments[0]
    pressure = run.values["pressure"]
    noise = np.random.default_rng(NOISE_SEED).uniform(pressure.min(), pressure.max(), run.n_samples)
    return data.with_experiments([replace(run, name="noise", values={**run.values, "pressure": noise})])


def _median(values: Iterable[float]) -> str:
    # A run that diverged counts as infinite; leaving it out would lower the median.
    return figure(float(np.median(np.nan_to_num(list(values), nan=np.inf))))
