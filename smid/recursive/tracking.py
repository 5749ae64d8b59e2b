"""A recursive estimator over a whole record, and its three errors side by side.

    a posteriori     y[t] - phi[t]' theta[t]        the parameters have seen this very sample
    one step ahead   y[t] - phi[t]' theta[t-1]      they have seen all samples before it
    free run         y[t] - w[t]                    they are frozen as they are at the end, and w is simulated

The first can be made zero for any data, so it says nothing.  The second must be seen beside the error of the simplest
prediction, that the output stays as it was: at a short sampling time that one is small too.  The third tells whether
there is a model.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from relaxations.algebra.arrays import Array
from smid.data import Dataset
from smid.display.result import Part, Tabular, plain
from smid.display.table import Table, figure
from smid.recursive.arx import Arx
from smid.recursive.estimator import History, RecursiveEstimator
from smid.recursive.free_run import FreeRun, free_run
from smid.recursive.method import DivergenceError, Method

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Residual", "Tracking", "track"]


@dataclass(frozen=True, eq=False)
class Residual:
    """An error over time.

    Parameters
    ----------
    samples
        Shape (N,). Measured minus computed, in the output's unit; NaN where nothing is computed.
    rmse, largest
        Root mean square and largest magnitude over the samples that count; NaN where one of them is missing.

    Examples
    --------
    >>> residual = Residual.of(np.array([0.3, -0.4]), 0)
    >>> round(residual.rmse, 4), residual.largest
    (0.3536, 0.4)
    """

    samples: Array
    rmse: float
    largest: float

    @staticmethod
    def of(samples: Array, start: int) -> Residual:
        """Give the residual whose samples count from number `start` on."""
        counted = np.abs(samples[start:])
        largest = float(counted.max()) if counted.size else np.nan
        # Squares of what diverged would overflow.
        rmse = largest * float(np.sqrt(np.mean(np.square(counted / largest)))) if largest > 0 else largest
        return Residual(samples, rmse, largest)


@dataclass(frozen=True, eq=False, repr=False)
class Tracking(Tabular):
    """What a recursive estimator made of a record.

    Parameters
    ----------
    experiment
        Which run of the data.
    history
        Shorter than the record where the parameters diverged.
    frozen
        With the last parameters, over the whole record.
    """

    arx: Arx
    method: Method
    data: Dataset
    experiment: int
    history: History
    frozen: FreeRun

    @property
    def record(self) -> str:
        """Name of the run."""
        return self.data.experiments[self.experiment].name

    @property
    def unit(self) -> str:
        """Of the output."""
        return self.data.channel(self.data.output).unit

    @property
    def measured(self) -> Array:
        """The output, shape (N,), in its unit."""
        return self.data.values(self.data.output, self.experiment)

    @property
    def diverged(self) -> int | None:
        """The sample at which the parameters had grown without bound; None where they did not."""
        n = self.history.one_step.size
        return n if n < self.measured.size else None

    @cached_property
    def a_posteriori(self) -> Residual:
        """Error with the parameters that have seen the sample."""
        return self._residual(self.history.a_posteriori)

    @cached_property
    def one_step(self) -> Residual:
        """Error with the parameters from before the sample."""
        return self._residual(self.history.one_step)

    @cached_property
    def free_run(self) -> Residual:
        """Error of the simulation with the last parameters frozen."""
        error = self.measured - self.frozen.output
        error[: self.arx.max_lag] = np.nan  # where it starts it is the measured output itself
        return self._residual(error)

    @cached_property
    def held(self) -> Residual:
        """Error of the prediction that the output stays as it was."""
        return self._residual(np.diff(self.measured, prepend=np.nan))

    @property
    def residuals(self) -> dict[str, Residual]:
        """The three errors by name."""
        return {"a posteriori": self.a_posteriori, "one step ahead": self.one_step, "free run": self.free_run}

    def _residual(self, samples: Array) -> Residual:
        whole = np.full(self.measured.size, np.nan)
        whole[: samples.size] = samples
        return Residual.of(whole, self._start)

    @property
    def _start(self) -> int:
        # A model without memory predicts sample 0 already, but holding has nothing to hold there.
        return max(self.data.n_init, self.arx.max_lag, 1)

    @property
    def remarks(self) -> tuple[str, ...]:
        """What went wrong or was put right, in words."""
        found = []
        moved = int(self.history.put_inside.sum())
        if moved:
            found.append(f"poles put inside at {moved} sample{'s' if moved > 1 else ''}")
        if self.diverged is not None:
            return (f"parameters diverged at {self._instant(self.diverged)}", *found)
        if self.frozen.radius >= 1:
            found.append(f"frozen model unstable, pole {self.frozen.radius:.4g}")
        if self.frozen.stopped is not None:
            found.append(f"free run stopped at {self._instant(self.frozen.stopped)}")
        return tuple(found)

    def _instant(self, sample: int) -> str:
        return f"sample {sample}, {self.data.time(self.experiment)[sample]:.4g} s"

    @property
    def meaning(self) -> str:
        """Return in a sentence or two what the three errors mean."""
        if self.diverged is not None:
            return f"There is no estimate: the {self.remarks[0]}. Give a smaller gain."
        unit = f" {self.unit}" if self.unit else ""
        why = self.method.remark or "the parameters have already seen the sample"
        free = (
            f"errs by {figure(self.free_run.rmse)}{unit} RMS"
            if self.frozen.stopped is None
            else f"grew without bound and was stopped at {self._instant(self.frozen.stopped)}"
        )
        return (
            f"A posteriori the error is at most {self._seen(unit)}: {why}. "
            f"Before the sample is seen it is {figure(self.one_step.rmse)}{unit} RMS, where holding the last measured "
            f"output gives {figure(self.held.rmse)}{unit}; with the last parameters frozen the model's own run {free}."
        )

    @property
    def largest_left_alone(self) -> float:
        """Largest a posteriori error where the stability rule left the poles alone; NaN where parameters diverged."""
        moved = np.zeros(self.measured.size, dtype=np.bool_)
        moved[: self.history.put_inside.size] = self.history.put_inside
        return Residual.of(np.where(moved, 0.0, self.a_posteriori.samples), self._start).largest

    def _seen(self, unit: str) -> str:
        alone, anywhere = self.largest_left_alone, self.a_posteriori.largest
        if alone == anywhere:
            return f"{figure(alone)}{unit}"
        return f"{figure(alone)}{unit}, and {figure(anywhere)}{unit} where the stability rule moved poles"

    @property
    def table(self) -> Table:
        """Return the three errors, and that of holding the last output."""
        unit = f" [{self.unit}]" if self.unit else ""
        rows = tuple((row["error"], figure(row["rmse"]), figure(row["largest"])) for row in self._rows())
        head = f"{self.method} on {self.record}, {self.measured.size} samples; {self.arx}"
        return Table(head, ("error", f"RMSE{unit}", f"largest{unit}"), rows, "lrr")

    def _content(self) -> Iterator[Part]:
        yield self.table
        if self.remarks:
            yield f"Note: {'; '.join(self.remarks)}."
        yield self.meaning

    def _rows(self) -> Iterator[dict[str, Any]]:
        kinds = {**self.residuals, "last output held": self.held}
        return ({"error": name, "rmse": r.rmse, "largest": r.largest} for name, r in kinds.items())

    def plot(self) -> Figure:
        """Draw the output with the free run, the three errors on one logarithmic scale, and the parameters."""
        from smid.recursive.figures import tracking_figure

        return tracking_figure(self)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data: settings, parameters at the end and the figures; missing ones are None."""
        errors = {name: getattr(self, name) for name in ("a_posteriori", "one_step", "free_run", "held")}
        return {
            "record": self.record,
            "model": str(self.arx),
            "method": str(self.method),
            "unit": self.unit,
            "parameters": dict(zip(self.arx.names, self.frozen.parameters.tolist(), strict=True)),
            **{name: plain({"rmse": r.rmse, "largest": r.largest}) for name, r in errors.items()},
            "remarks": list(self.remarks),
        }


def track(arx: Arx, method: Method, data: Dataset, *, experiment: int = 0, start: ArrayLike | None = None) -> Tracking:
    """Run a recursive estimator over a record.

    Parameters
    ----------
    arx
        Structure of the model.
    method
        How a sample corrects the parameters.
    data
        With one input and one output.
    experiment
        Which run of the data.
    start
        Shape (n,). Parameters before the first sample; zero by default.

    Returns
    -------
    Tracking
        Parameters that diverge end the estimation, not the call: the result says so.

    Raises
    ------
    ModelError
        If start or settings do not fit the number of parameters.
    DataError
        If the record has several inputs or outputs, or is too short.

    Examples
    --------
    >>> from smid.recursive import NormalisedGradient
    >>> from smid.signals import prbs
    >>> u = prbs(200, seed=1)
    >>> data = Dataset.from_arrays(input=u, output=np.random.default_rng(1).normal(size=200), sampling_time=1.0)
    >>> found = track(Arx(), NormalisedGradient(), data)
    >>> found.a_posteriori.largest < 1e-13 < 1 < found.one_step.rmse
    True

    References
    ----------
    Clutch thesis, section 3.3.
    """
    u, y = data.values(data.input, experiment), data.values(data.output, experiment)
    arx.matrix(u, y)  # refuses what the model cannot use before the first sample
    estimator = RecursiveEstimator(arx, method, start)
    try:
        for sample in zip(u.tolist(), y.tolist(), strict=True):
            estimator.update(*sample)
    except DivergenceError:
        pass  # the history ends there, and `Tracking.diverged` tells
    frozen = free_run(arx, estimator.parameters, u, y)
    return Tracking(arx, method, data, experiment, estimator.history, frozen)
