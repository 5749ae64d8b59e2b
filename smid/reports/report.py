"""The one verb of this package: write a result as one self-contained HTML page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, overload

from smid.error_bound import ErrorBound
from smid.estimate import Estimate
from smid.reports.html import estimate_report
from smid.validate import Validation

if TYPE_CHECKING:
    from smid.diagnosis.diagnosis import Diagnosis


@overload
def report(
    result: Estimate,
    path: str | PathLike[str],
    error_bound: ErrorBound | None = None,
    validations: Sequence[Validation] = (),
    *,
    truth: Mapping[str, float] | None = None,
    notes: Sequence[str] = (),
    settings: Mapping[str, str] | None = None,
    links: Mapping[str, str] | None = None,
) -> Path: ...


@overload
def report(
    result: Diagnosis,
    path: str | PathLike[str],
    *,
    notes: Sequence[str] = (),
    settings: Mapping[str, str] | None = None,
    links: Mapping[str, str] | None = None,
) -> Path: ...


def report(
    result: Estimate | Diagnosis,
    path: str | PathLike[str],
    error_bound: ErrorBound | None = None,
    validations: Sequence[Validation] = (),
    *,
    truth: Mapping[str, float] | None = None,
    notes: Sequence[str] = (),
    settings: Mapping[str, str] | None = None,
    links: Mapping[str, str] | None = None,
) -> Path:
    """Write an estimate or a diagnosis as one HTML page: no network, light and dark, for screen, phone and paper.

    Parameters
    ----------
    result : Estimate or Diagnosis
    path : str or path
    error_bound : ErrorBound, optional
        Shown where it was computed; estimates only.
    validations : sequence of Validation
        Free runs over other records; estimates only.
    truth : mapping str -> float, optional
        The parameters that made simulated data; estimates only.
    notes : sequence of str
        Remarks: on the validations of an estimate, on the verdict of a diagnosis.
    settings : mapping str -> str, optional
        What was asked for, in the user's words; shown at the end.
    links : mapping str -> str, optional
        Other pages: words -> address, relative to the page.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    OSError
        Where the path cannot be written; :func:`check_writable` tells before any long work.
    TypeError
        For a diagnosis with what belongs to an estimate.

    Examples
    --------
    >>> import tempfile, smid
    >>> u, y = [1.0, 0, 1, 1, 0, 0, 1, 0], [0.0, 1, 0.5, 1.3, 1.6, 0.8, 0.4, 1.2]
    >>> data = smid.Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    >>> estimate = smid.identify(smid.OutputError(na=1, stable=True), data, noise_bound=0.1)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     report(estimate, Path(folder) / "report.html").name
    'report.html'
    """
    if isinstance(result, Estimate):
        return estimate_report(
            result, path, error_bound, validations, truth=truth, notes=notes, settings=settings, links=links
        )
    # A diagnosis draws itself in the look of this package: imported at the top, the two would be a circle.
    from smid.reports.diagnosis_page import diagnosis_report

    if error_bound is not None or validations or truth is not None:
        raise TypeError("error_bound, validations and truth belong to an estimate: leave them out for a diagnosis")
    return diagnosis_report(result, path, notes=notes, settings=settings, links=links)
