"""Effect of the adaptation gain on the three errors: figure 3.12 of the clutch thesis.

The thesis chose gain 1 because the error was smallest there. That error is the a posteriori error, which gain 1 makes
zero for any data. The table adds the other two errors and the stability rule of the method.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from smid.data import Dataset
from smid.data.gaps import require_complete
from smid.display.result import Part, Tabular
from smid.display.table import Table, figure
from smid.recursive.arx import Arx
from smid.recursive.normalised_gradient import NormalisedGradient
from smid.recursive.tracking import Tracking, track
from smid.recursive.unnormalised_gradient import UnnormalisedGradient

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["GainStudy", "gain_study"]

Gradient = NormalisedGradient | UnnormalisedGradient

_SHARES = (0.005, 0.05, 0.15, 0.25, 0.5, 0.75, 0.95, 1.05)


@dataclass(frozen=True, eq=False, repr=False)
class GainStudy(Tabular):
    """Results of a gradient method at several gains on one record.

    Below `largest_gain` the parameter error cannot grow, for constant parameters without noise.
    """

    largest_gain: float
    gains: tuple[float, ...]
    trackings: tuple[Tracking, ...]

    @property
    def best(self) -> float:
        """Return the gain with the smallest RMSE one step ahead."""
        errors = [tracking.one_step.rmse for tracking in self.trackings]
        return self.gains[int(np.argmin(np.where(np.isnan(errors), np.inf, errors)))]

    @property
    def table(self) -> Table:
        """Return a row for each gain."""
        first = self.trackings[0]
        unit = f" [{first.unit}]" if first.unit else ""
        header = ("gain", "stability rule", "a posteriori", "one step", "free run", "poles not moved", "remarks")
        rows = tuple(
            (
                figure(gain),
                "satisfied" if gain < self.largest_gain else "violated",
                *(figure(residual.rmse) for residual in t.residuals.values()),
                figure(t.largest_left_alone),
                "; ".join(t.remarks),
            )
            for gain, t in zip(self.gains, self.trackings, strict=True)
        )
        name = str(first.method).split(",")[0]
        caption = (
            f"{name} on {first.record}; {first.arx}; RMSE{unit}; stability rule: gain < {figure(self.largest_gain)}"
        )
        return Table(caption, header, rows, "rlrrrrl")

    def _content(self) -> Iterator[Part]:
        yield self.table
        yield "Poles not moved: the largest a posteriori error where the stability rule moved no pole."
        held = figure(self.trackings[0].held.rmse)
        best = figure(self.best)
        yield f"The RMSE one step ahead is smallest at gain {best}. Holding the last output gives an RMSE of {held}."

    def _rows(self) -> Iterator[dict[str, Any]]:
        for gain, t in zip(self.gains, self.trackings, strict=True):
            errors = {name: residual.rmse for name, residual in t.residuals.items()}
            yield {"gain": gain, "kept": gain < self.largest_gain, **errors}

    def plot(self) -> Figure:
        """Draw the three errors over the gain."""
        from smid.recursive.figures import gain_figure

        return gain_figure(self)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "largest_gain": self.largest_gain,
            "gains": list(self.gains),
            "trackings": [tracking.to_dict() for tracking in self.trackings],
        }


def gain_study(
    arx: Arx, method: Gradient, data: Dataset, gains: Sequence[float] | None = None, *, experiment: int = 0
) -> GainStudy:
    """Return the results of a gradient method with several gains on a record (clutch thesis, 3.3.3, figure 3.12).

    Parameters
    ----------
    method
        The study replaces its gain.
    data
        With one input and one output.
    gains
        By default 0.005 to 1.05 times the largest stable gain.

    Raises
    ------
    ModelError
        If a gain is not a positive number.
    DataError
        If the record does not fit.

    Examples
    --------
    >>> data = Dataset.from_arrays(input=[1.0] * 40, output=[2.0] * 40, sampling_time=1)
    >>> study = gain_study(Arx(na=0, delay=0), NormalisedGradient(), data, gains=[0.5, 1.0, 2.5])
    >>> study.best, study.trackings[2].one_step.largest > 1e4
    (1.0, True)
    """
    require_complete(data, "a recursive estimator")
    regressors = arx.matrix(data.values(data.input, experiment), data.values(data.output, experiment))
    largest = method.largest_gain(regressors)
    chosen = tuple(share * largest for share in _SHARES) if gains is None else tuple(gains)
    methods = [replace(method, gain=gain) for gain in chosen]  # refuses an invalid gain before the first run
    trackings = tuple(track(arx, changed, data, experiment=experiment) for changed in methods)
    return GainStudy(largest, chosen, trackings)
