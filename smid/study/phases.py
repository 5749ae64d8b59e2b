"""Identification in three phases on any record: error bound, parameter intervals, validation on other records.

1. An enclosure of the least noise bound with which the model explains the record.
2. Certified parameter intervals and the central model, at a factor times that bound or at a given bound, and the widths
   of the intervals at other bounds.
3. Free runs of the central model over other records.

Reference: clutch thesis, section 3.2.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from relaxations.deadline import Progress
from relaxations.errors import UserError
from smid.data import DataError, Dataset
from smid.display.result import Heading, Part, Result
from smid.identification.error_bound import ErrorBound, error_bound
from smid.identification.estimate import Estimate
from smid.identification.identify import identify
from smid.models import Model, ModelError
from smid.study.finished import finished
from smid.study.widths import WidthStudy, width_study
from smid.validation import Validation, validate

__all__ = ["FACTOR", "Phases", "phases"]

FACTOR = 1.2
"""Just above the least noise bound the intervals are narrow for any data: the feasible set shrinks to a point there."""


@dataclass(frozen=True, eq=False, repr=False)
class Phases(Result):
    """The three phases.

    Parameters
    ----------
    bound, estimate, validations
        Phases 1, 2 and 3.
    widths
        Of the intervals, at several noise bounds.
    unstable
        A sentence for each record on which the central model has no free run.
    """

    bound: ErrorBound
    estimate: Estimate
    widths: WidthStudy
    validations: tuple[Validation, ...]
    unstable: tuple[str, ...] = ()

    @property
    def conclusion(self) -> str:
        """Return the results of the three phases in a few sentences."""
        unit, used = self.bound.unit, self.estimate.noise_bound[self.bound.channel]
        first = (
            f"No parameters explain the {self.estimate.data.n_samples} samples with noise of {self.bound.channel} "
            f"below {self.bound.lower:.4g} {unit}, proven. The intervals are those at {used:.4g} {unit}."
        )
        scores = [score for run in self.validations for score in run.scores]
        if not scores:
            return first
        beyond = [100 * (score.violations or 0) / score.samples for score in scores]
        runs = "the free run" if len(scores) == 1 else f"{len(scores)} free runs"
        return (
            f"{first} On other records, the largest RMSE of {runs} is {max(s.rmse for s in scores):.3g} {unit}, the "
            f"lowest fit {min(s.fit_percent for s in scores):.1f} %, and at most {max(beyond):.0f} % of the samples "
            "exceed the noise bound."
        )

    def _content(self) -> Iterator[Part]:
        yield Heading("Phase 1: error bound")
        yield f"{self.bound}"
        yield Heading("Phase 2: parameter intervals")
        yield self.estimate.table
        yield self.estimate.summary
        yield self.widths.table
        yield Heading("Phase 3: validation")
        for run in self.validations:
            yield run.data.source
            yield from run._content()
        yield from self.unstable
        if not self.validations and not self.unstable:
            yield "No other record was given."
        yield Heading("Conclusion")
        yield self.conclusion

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "error_bound": self.bound.to_dict(),
            "estimate": self.estimate.to_dict(),
            "widths": self.widths.to_dict()["widths"],
            "validations": [run.to_dict() for run in self.validations],
            "unstable": list(self.unstable),
            "conclusion": self.conclusion,
        }


def phases(
    model: Model,
    data: Dataset,
    others: Sequence[Dataset] = (),
    *,
    noise_bound: float | None = None,
    factor: float = FACTOR,
    progress: Progress | None = None,
) -> Phases:
    """Identify a model in three phases.

    Parameters
    ----------
    model
        With noise on one output alone, and the channel names of the data.
    others
        Records for the validation, at the sampling time of the data; other units are converted.
    noise_bound
        In the output's unit; by default `factor` times the least one.
    factor
        At least 1.

    Raises
    ------
    ModelError
        If the model has several noisy channels, or the factor is below one.
    DataError
        If the data say too little of a parameter to bound it.
    EmptyFeasibleSetError
        If the noise bound is below the least one.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> u, y = [1.0, 0, 1, 1, 0, 0, 1, 0], [0.0, 1, 0.5, 1.3, 1.6, 0.8, 0.4, 1.2]
    >>> data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    >>> found = phases(OutputError(stable=True), data, [data])
    >>> found.bound.lower < found.estimate.noise_bound["y"], len(found.validations)
    (True, 1)
    """
    noisy = [m.channel for m in model.measurements if m.noise is not None]
    if len(noisy) != 1:
        raise ModelError(
            f"the three phases need noise on one channel, not on {', '.join(noisy) or 'none'}: use smid.error_bound, "
            "smid.identify and smid.validate"
        )
    if not 1.0 <= factor < float("inf"):
        raise ModelError(f"factor = {factor} is refused: no parameters fit below the least bound; give 1 or more")
    # Phases 1 and 2.
    bound = finished(error_bound(model, data, progress=progress))
    used = factor * bound.upper if noise_bound is None else noise_bound
    estimate = finished(identify(model, data, used, progress=progress))
    if estimate.unbounded:
        raise DataError(
            f"the record says too little of {', '.join(estimate.unbounded)} to bound it: take samples in which the "
            "input moves, or fewer parameters"
        )
    widths = width_study(model, data, bound, progress=progress)
    # Phase 3.
    runs, unstable = list[Validation](), list[str]()
    for other in others:
        try:
            runs.append(validate(estimate, other, estimate.noise_bound))
        except UserError as error:
            unstable.append(f"No validation on {other.source}: {error}.")
    return Phases(bound, estimate, widths, tuple(runs), tuple(unstable))
