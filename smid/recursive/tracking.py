"""A recursive estimator on a whole record, and its three errors.

    a posteriori     y[t] - phi[t]' theta[t]        parameters from after the sample
    one step ahead   y[t] - phi[t]' theta[t-1]      parameters from before the sample
    free run         y[t] - w[t]                    final parameters, with the simulated output w

The a posteriori error can be made zero for any data, so it does not measure the model. The error one step ahead must be
compared with the error of holding the last output, which is small too at a short sampling time. The free run shows
whether the model describes the plant.
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
from smid.data.gaps import require_complete
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
    """An error over time: measured minus computed output.

    `samples` has shape (N,), with NaN where nothing is computed. `rmse` and `largest` (magnitude) are NaN if an
    evaluated sample is NaN.

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
        """Return the residual, evaluated from sample number `start` on."""
        counted = np.abs(samples[start:])
        largest = float(counted.max()) if counted.size else np.nan
        # Scale first, because squares of diverged values would overflow.
        rmse = largest * float(np.sqrt(np.mean(np.square(counted / largest)))) if largest > 0 else largest
        return Residual(samples, rmse, largest)


@dataclass(frozen=True, eq=False, repr=False)
class Tracking(Tabular):
    """Result of a recursive estimator on one run of the data.

    The history is shorter than the record if the parameters diverged. `frozen` is the free run with the last
    parameters.
    """

    arx: Arx
    method: Method
    data: Dataset
    experiment: int
    history: History
    frozen: FreeRun

    @property
    def record(self) -> str:
        """Return the name of the run."""
        return self.data.experiments[self.experiment].name

    @property
    def unit(self) -> str:
        """Return the unit of the output."""
        return self.data.channel(self.data.output).unit

    @property
    def measured(self) -> Array:
        """Return the output, shape (N,), in its unit."""
        return self.data.values(self.data.output, self.experiment)

    @property
    def diverged(self) -> int | None:
        """Return the sample at which the parameters diverged, or None."""
        n = self.history.one_step.size
        return n if n < self.measured.size else None

    @cached_property
    def a_posteriori(self) -> Residual:
        """Return the error with the parameters from after the sample."""
        return self._residual(self.history.a_posteriori)

    @cached_property
    def one_step(self) -> Residual:
        """Return the error with the parameters from before the sample."""
        return self._residual(self.history.one_step)

    @cached_property
    def free_run(self) -> Residual:
        """Return the error of the simulation with the last parameters."""
        error = self.measured - self.frozen.output
        error[: self.arx.max_lag] = np.nan  # the run starts with measured outputs
        return self._residual(error)

    @cached_property
    def held(self) -> Residual:
        """Return the error of predicting the last measured output."""
        return self._residual(np.diff(self.measured, prepend=np.nan))

    @property
    def residuals(self) -> dict[str, Residual]:
        """Return the three errors by name."""
        return {"a posteriori": self.a_posteriori, "one step ahead": self.one_step, "free run": self.free_run}

    def _residual(self, samples: Array) -> Residual:
        whole = np.full(self.measured.size, np.nan)
        whole[: samples.size] = samples
        return Residual.of(whole, self._start)

    @property
    def _start(self) -> int:
        # At least 1: there is no last output to hold at sample 0.
        return max(self.data.n_init, self.arx.max_lag, 1)

    @property
    def remarks(self) -> tuple[str, ...]:
        """Return divergence, instability and corrections as texts."""
        found = []
        moved = int(self.history.put_inside.sum())
        if moved:
            found.append(f"stability rule moved poles at {moved} sample{'s' if moved > 1 else ''}")
        if self.diverged is not None:
            return (f"parameters diverged at {self._instant(self.diverged)}", *found)
        if self.frozen.radius >= 1:
            found.append(f"final model unstable, pole {self.frozen.radius:.4g}")
        if self.frozen.stopped is not None:
            found.append(f"free run stopped at {self._instant(self.frozen.stopped)}")
        return tuple(found)

    def _instant(self, sample: int) -> str:
        return f"sample {sample}, {self.data.time(self.experiment)[sample]:.4g} s"

    @property
    def meaning(self) -> str:
        """Return the meaning of the three errors in a few sentences."""
        if self.diverged is not None:
            return f"There is no estimate: the {self.remarks[0]}. Give a smaller gain."
        unit = f" {self.unit}" if self.unit else ""
        why = self.method.remark or "the parameters already use the sample"
        free = (
            f"has an RMSE of {figure(self.free_run.rmse)}{unit}"
            if self.frozen.stopped is None
            else f"diverged and was stopped at {self._instant(self.frozen.stopped)}"
        )
        return (
            f"The a posteriori error is at most {self._seen(unit)}: {why}. "
            f"The RMSE one step ahead is {figure(self.one_step.rmse)}{unit}. Holding the last measured output gives "
            f"{figure(self.held.rmse)}{unit}. The free run with the last parameters {free}."
        )

    @property
    def largest_left_alone(self) -> float:
        """Return the largest a posteriori error where the stability rule moved no pole; NaN after divergence."""
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
        """Return the three errors, and the error of holding the last output."""
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
        """Return plain data: settings, final parameters and errors; missing values are None."""
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
    """Return the result of a recursive estimator on a record (clutch thesis, section 3.3).

    If the parameters diverge, the estimation stops and the result states it; no error is raised.

    Parameters
    ----------
    data
        With one input and one output.
    start
        Shape (n,). Parameters before the first sample; zero by default.

    Raises
    ------
    ModelError
        If start or settings do not fit the number of parameters.
    DataError
        If the record has several inputs or outputs, missing samples, or is too short.

    Examples
    --------
    >>> from smid.recursive import NormalisedGradient
    >>> from smid.signals import prbs
    >>> u = prbs(200, seed=1)
    >>> data = Dataset.from_arrays(input=u, output=np.random.default_rng(1).normal(size=200), sampling_time=1.0)
    >>> found = track(Arx(), NormalisedGradient(), data)
    >>> found.a_posteriori.largest < 1e-13 < 1 < found.one_step.rmse
    True
    """
    require_complete(data, "a recursive estimator")
    u, y = data.values(data.input, experiment), data.values(data.output, experiment)
    arx.matrix(u, y)  # refuses invalid data before the first sample
    estimator = RecursiveEstimator(arx, method, start)
    try:
        for sample in zip(u.tolist(), y.tolist(), strict=True):
            estimator.update(*sample)
    except DivergenceError:
        pass  # the history ends at this sample, see `Tracking.diverged`
    frozen = free_run(arx, estimator.parameters, u, y)
    return Tracking(arx, method, data, experiment, estimator.history, frozen)
