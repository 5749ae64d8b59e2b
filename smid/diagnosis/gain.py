"""The gain of an extended model on the test part."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from relaxations.algebra.arrays import Array
from smid.diagnosis.search.compare import rms
from smid.display.from_plain import fields_from_plain
from smid.display.result import Part, Result
from smid.display.table import Table


@dataclass(frozen=True, repr=False)
class Gain(Result):
    """Free runs of the base and of the extended model against the test part.

    Parameters
    ----------
    rmse_before, rmse_after
        In the output's unit.
    fit_percent_before, fit_percent_after
        ``100 (1 - ||y - y_sim|| / ||y - mean(y)||)``; None for a constant output.
    noise_bound_before, noise_bound_after
        The least bound within which the fitted model explains the test part: its largest error, in the output's
        unit.
    violations_before, violations_after
        Samples whose error exceeds the given noise bound.
    samples
        Samples of the test part.

    Examples
    --------
    >>> paid = Gain(0.4, 0.1, 80.0, 95.0, 1.2, 0.3, 60, 0, 100)
    >>> f"{1 - paid.rmse_after / paid.rmse_before:.0%} less"
    '75% less'
    """

    rmse_before: float
    rmse_after: float
    fit_percent_before: float | None
    fit_percent_after: float | None
    noise_bound_before: float
    noise_bound_after: float
    violations_before: int | None
    violations_after: int | None
    samples: int

    def _content(self) -> Iterator[Part]:
        figures = {
            "RMSE": (self.rmse_before, self.rmse_after),
            "fit %": (self.fit_percent_before, self.fit_percent_after),
            "largest error": (self.noise_bound_before, self.noise_bound_after),
            "violations": (self.violations_before, self.violations_after),
        }
        rows = tuple((name, *("-" if x is None else f"{x:.4g}" for x in pair)) for name, pair in figures.items())
        caption = f"Free runs on {self.samples} test samples."
        yield Table(caption, ("", "base model", "extended model"), rows, "lrr")

    def to_dict(self) -> dict[str, float | int | None]:
        """Return the eight figures of the JSON schema; the number of samples stands beside them there."""
        return {name: value for name, value in asdict(self).items() if name != "samples"}

    @staticmethod
    def from_dict(content: Mapping[str, Any], samples: int) -> Gain:
        """Return the gain that `to_dict` described, over a number of samples."""
        found: Gain = fields_from_plain(Gain, content, samples=samples)
        return found


def gain(measured: Sequence[Array], before: Sequence[Array], after: Sequence[Array], noise_bound: float | None) -> Gain:
    """Compare two models on the test part.

    Parameters
    ----------
    measured
        Shape (n,). Test part of the output, per experiment.
    noise_bound
        In the output's unit, to count violations.

    Examples
    --------
    >>> y = np.array([0.0, 1.0, 2.0])
    >>> gain([y], [y], [0.1 * y], 0.5).violations_before
    2
    """
    spread = float(np.sqrt(np.mean(np.concatenate([y - y.mean() for y in measured]) ** 2)))

    def figures(residuals: Sequence[Array]) -> tuple[float, float | None, float, int | None]:
        error = np.abs(np.concatenate(list(residuals)))
        percent = 100 * (1 - rms(residuals) / spread) if spread > 0 else None
        return rms(residuals), percent, float(error.max()), _count(error, noise_bound)

    first, second = figures(before), figures(after)
    return Gain(
        rmse_before=first[0],
        rmse_after=second[0],
        fit_percent_before=first[1],
        fit_percent_after=second[1],
        noise_bound_before=first[2],
        noise_bound_after=second[2],
        violations_before=first[3],
        violations_after=second[3],
        samples=sum(map(len, before)),
    )


def _count(error: Array, noise_bound: float | None) -> int | None:
    return None if noise_bound is None else int((error > noise_bound).sum())
