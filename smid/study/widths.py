"""Widths of the parameter intervals over the noise bound.

At the least noise bound the feasible set shrinks to a point, whatever the true parameters are. The width of an
interval is therefore meaningful only together with its growth over the noise bound.

Reference: clutch thesis, section 3.2.3; (2.15)-(2.17) and (3.18).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from relaxations.deadline import Progress
from smid.data import Dataset
from smid.display.result import Part, Tabular
from smid.display.table import Table
from smid.identification.error_bound import ErrorBound
from smid.identification.estimate import Estimate
from smid.identification.identify import identify
from smid.models import Model, ModelError
from smid.study.finished import finished

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["WidthStudy", "width_study"]


@dataclass(frozen=True, eq=False, repr=False)
class WidthStudy(Tabular):
    """Widths of the intervals at several noise bounds.

    Parameters
    ----------
    least
        The least noise bound.
    factors
        Noise bounds as multiples of the upper end of the least one; rising.
    estimates
        One per factor.
    """

    least: ErrorBound
    factors: tuple[float, ...]
    estimates: tuple[Estimate, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the parameters."""
        return tuple(i.name for i in self.estimates[0].intervals)

    def noise_bound(self, number: int) -> float:
        """Return the noise bound of an estimate."""
        return self.factors[number] * self.least.upper

    @property
    def table(self) -> Table:
        """Return a row per noise bound."""
        rows = tuple(
            (f"{self.noise_bound(k):.4g}", f"{factor:g}", *(f"{i.width:.3g}" for i in estimate.intervals))
            for k, (factor, estimate) in enumerate(zip(self.factors, self.estimates, strict=True))
        )
        header = (f"noise bound [{self.least.unit}]", "times the least", *self.names)
        return Table("Widths of the certified intervals against the noise bound.", header, rows, "r" * len(header))

    def _content(self) -> Iterator[Part]:
        yield self.table

    def _rows(self) -> Iterator[dict[str, Any]]:
        for k, (factor, estimate) in enumerate(zip(self.factors, self.estimates, strict=True)):
            given = {"noise_bound": self.noise_bound(k), "factor": factor}
            yield from ({**given, "name": i.name, "width": i.width} for i in estimate.intervals)

    def plot(self) -> Figure:
        """Draw the widths over the noise bound."""
        from smid.study.width_figure import width_figure

        return width_figure(self)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "least": self.least.to_dict(),
            "widths": [
                {"noise_bound": self.noise_bound(k), "factor": factor, "widths": {i.name: i.width for i in e.intervals}}
                for k, (factor, e) in enumerate(zip(self.factors, self.estimates, strict=True))
            ],
        }


def width_study(
    model: Model,
    data: Dataset,
    least: ErrorBound,
    factors: Sequence[float] = (1.001, 1.05, 1.2, 1.5),
    *,
    tolerance: float = 1e-2,
    progress: Progress | None = None,
) -> WidthStudy:
    """Identify at noise bounds that are multiples of the upper end of the least one, to a tolerance of each width.

    ModelError if a factor is below one, or there is none.
    """
    for factor in factors:
        if not 1.0 <= factor < float("inf"):
            raise ModelError(f"factor = {factor} is refused: no parameters fit below the least bound; give 1 or more")
    if not factors:
        raise ModelError("there is no noise bound to try: give at least one factor, such as 1.2")
    rising = tuple(sorted(set(map(float, factors))))
    estimates = [
        finished(identify(model, data, factor * least.upper, tolerance=tolerance, progress=progress))
        for factor in rising
    ]
    return WidthStudy(least, rising, tuple(estimates))
