"""Write a result as a report, in the format that the path names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, overload

from smid.data import Dataset
from smid.identification.error_bound import ErrorBound
from smid.identification.estimate import Estimate
from smid.reports.estimate_page import estimate_page
from smid.reports.formats import check_report, write_page
from smid.validation import Comparison, ModelFit, Residuals, Validation

if TYPE_CHECKING:
    from smid.diagnosis.diagnosis import Diagnosis
    from smid.responses.band import ResponseBand
    from smid.responses.projections import Projections
    from smid.study.study import Study


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


@overload
def report(
    result: Study | Dataset | ModelFit | Comparison | Residuals | ResponseBand | Projections,
    path: str | PathLike[str],
    *,
    settings: Mapping[str, str] | None = None,
) -> Path: ...


def report(
    result: Estimate | Diagnosis | Study | Dataset | ModelFit | Comparison | Residuals | ResponseBand | Projections,
    path: str | PathLike[str],
    error_bound: ErrorBound | None = None,
    validations: Sequence[Validation] = (),
    *,
    truth: Mapping[str, float] | None = None,
    notes: Sequence[str] = (),
    settings: Mapping[str, str] | None = None,
    links: Mapping[str, str] | None = None,
) -> Path:
    """Write a report of a result, and return its path.

    A result is an estimate, a fit, a response, projections, a diagnosis, a study, a data set, a comparison of models
    or tests of residuals.

    Parameters
    ----------
    path
        Its suffix selects the format. ``.html``: one file without a network, for screens, phones and paper. ``.pdf``:
        the same page printed by Chromium, with the HTML beside it; only the HTML if there is no Chromium. ``.md``:
        Markdown, with its figures as SVG in a folder beside it. ``.json``: plain data (docs/json.md).
    error_bound
        The least noise bound, for estimates only.
    validations
        Free runs over other records, for estimates only.
    truth
        The parameters that made simulated data, for estimates only.
    notes
        Remarks on the validations of an estimate, or on the verdict of a diagnosis.
    settings
        The user's options; shown at the end.
    links
        Other pages: text -> address, relative to the page.

    Raises
    ------
    ValueError
        If the suffix is not a report format.
    OSError
        If the path cannot be written; :func:`check_report` tests both before long work.
    TypeError
        For another result, or an option of another result.

    Warns
    -----
    PdfWarning
        If no PDF could be printed, with the cause and the cure.

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
    check_report(path)
    if isinstance(result, Estimate):
        page = estimate_page(result, error_bound, validations, truth=truth, notes=notes, settings=settings, links=links)
        return write_page(page, path)
    if error_bound is not None or validations or truth is not None:
        raise TypeError("error_bound, validations and truth belong to an estimate: leave them out")
    # Imported here, so that a report of an estimate loads neither diagnosis nor studies.
    from smid.diagnosis.diagnosis import Diagnosis
    from smid.reports.comparison_page import comparison_page
    from smid.reports.diagnosis_page import diagnosis_page
    from smid.reports.fit_page import fit_page
    from smid.reports.overview_page import dataset_page
    from smid.reports.projections_page import projections_page
    from smid.reports.residuals_page import residuals_page
    from smid.reports.response_page import response_page
    from smid.reports.study_page import study_page
    from smid.responses.band import ResponseBand
    from smid.responses.projections import Projections
    from smid.study import Study

    if isinstance(result, Diagnosis):
        return write_page(diagnosis_page(result, notes=notes, settings=settings, links=links), path)
    if not isinstance(result, Study | Dataset | ModelFit | Comparison | Residuals | ResponseBand | Projections):
        raise TypeError(
            f"a {type(result).__name__} has no report: give an Estimate, a ModelFit, a ResponseBand, Projections, "
            "a Diagnosis, a Study, a Dataset, a Comparison or Residuals, or print it"
        )
    if notes or links:
        raise TypeError("notes and links belong to an estimate or a diagnosis: leave them out")
    if isinstance(result, ResponseBand):
        return write_page(response_page(result, settings=settings), path)
    if isinstance(result, Projections):
        return write_page(projections_page(result, settings=settings), path)
    if isinstance(result, Dataset):
        return write_page(dataset_page(result, settings=settings), path)
    if isinstance(result, ModelFit):
        return write_page(fit_page(result, settings=settings), path)
    if isinstance(result, Comparison):
        return write_page(comparison_page(result, settings=settings), path)
    if isinstance(result, Residuals):
        return write_page(residuals_page(result, settings=settings), path)
    return write_page(study_page(result, settings=settings), path)
