"""Results of a recursive set-membership estimator: intervals over time, and certified changes of the plant."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike

from relaxations.algebra.arrays import Array
from smid.display.result import Part, Result, Tabular
from smid.display.table import Table
from smid.identification.estimate import round_down, round_up

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Change", "SetHistory"]


@dataclass(frozen=True, repr=False)
class Change(Result):
    """A certified change of the plant: no parameters explain the samples from `after` to `sample`.

    Neither constant parameters do, nor parameters that stay within the stated drift.

    The set became empty with `sample`. The plant has changed if the model's structure, its first box and the noise
    bound hold.

    Examples
    --------
    >>> print(Change(120, 131))
    no parameters explain samples 120 to 131: the plant changed in between
    """

    after: int
    sample: int

    def _content(self) -> Iterator[Part]:
        yield f"no parameters explain samples {self.after} to {self.sample}: the plant changed in between"


@dataclass(frozen=True, eq=False, repr=False)
class SetHistory(Tabular):
    """Certified intervals of the parameters after each sample: `lower` and `upper` have shape (N, n).

    Examples
    --------
    >>> import numpy as np
    >>> history = SetHistory(("a1",), np.array([[-1.0], [-0.6]]), np.array([[1.0], [-0.4]]), ())
    >>> history.upper[-1] - history.lower[-1]
    array([0.2])
    """

    names: tuple[str, ...]
    lower: Array
    upper: Array
    changes: tuple[Change, ...]

    @property
    def table(self) -> Table:
        """Return the intervals after the last sample, rounded outwards; no rows before the first sample."""
        ends = zip(self.names, self.lower[-1:].T, self.upper[-1:].T, strict=True)
        rows = tuple(
            (name, round_down(float(low), 6), round_up(float(high), 6), f"{high - low:.3g}")
            for name, lows, highs in ends
            for low, high in zip(lows, highs, strict=True)
        )
        caption = f"Certified intervals after {len(self.lower)} samples."
        return Table(caption, ("parameter", "lower", "upper", "width"), rows, "lrrr")

    def _content(self) -> Iterator[Part]:
        yield self.table
        yield from (f"Proven: {change}." for change in self.changes)

    def _rows(self) -> Iterator[dict[str, Any]]:
        """Yield a row for each sample and parameter."""
        for sample, (lower, upper) in enumerate(zip(self.lower.tolist(), self.upper.tolist(), strict=True)):
            for name, low, high in zip(self.names, lower, upper, strict=True):
                yield {"sample": sample, "parameter": name, "lower": low, "upper": high}

    def plot(self, truth: ArrayLike | None = None, sampling_time: float | None = None) -> Figure:
        """Return a figure of the intervals over time, one panel for each parameter.

        Parameters
        ----------
        truth
            Shape (n,) or (N, n). The true parameters, if known.
        sampling_time
            In seconds; without it the axis shows sample numbers.

        Raises
        ------
        DataError
            If the truth has another shape.
        """
        from smid.recursive.set_figure import set_figure

        return set_figure(self, truth, sampling_time)
