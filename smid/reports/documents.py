"""The JSON documents of results: versioned, described field by field in docs/json.md."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from smid.data import Dataset
from smid.data.reference import identity
from smid.display.versions import versions
from smid.identification.error_bound import ErrorBound
from smid.identification.estimate import Estimate
from smid.identification.identify import EmptyFeasibleSetError
from smid.models import Model
from smid.validation import Comparison, ModelFit, Residuals, Validation

if TYPE_CHECKING:
    from smid.diagnosis.diagnosis import Diagnosis
    from smid.responses.band import ResponseBand
    from smid.responses.projections import Projections


IDENTIFY, ERROR_BOUND, VALIDATE = "smid.identify/1", "smid.error-bound/1", "smid.validate/1"
DIAGNOSE, COMPARE, RESIDUALS = "smid.diagnose/1", "smid.compare/1", "smid.residuals/1"
SHOW, DATASET, VERIFY, RESPONSE = "smid.show/1", "smid.dataset/1", "smid.verify/1", "smid.response/1"
FIT, PROJECTION = "smid.fit/1", "smid.projection/1"

Document = dict[str, Any]


def identify_document(
    estimate: Estimate, error_bound: ErrorBound | None, validations: Sequence[Validation]
) -> Document:
    """Return what ``smid identify --json`` writes."""
    return {
        "schema": IDENTIFY,
        "estimate": estimate.to_dict(),
        "error_bound": None if error_bound is None else error_bound.to_dict(),
        "validations": [v.to_dict() for v in validations],
        "versions": versions(),
    }


def empty_document(error: EmptyFeasibleSetError, error_bound: ErrorBound | None) -> Document:
    """Return what ``smid identify --json`` writes if no parameters explain the data."""
    return {
        "schema": IDENTIFY,
        "empty": error.to_dict(),
        "error_bound": None if error_bound is None else error_bound.to_dict(),
        "versions": versions(),
    }


def fit_document(found: ModelFit) -> Document:
    """Return what ``smid fit --json`` writes."""
    return {"schema": FIT, "fit": found.to_dict(), "versions": versions()}


def error_bound_document(bound: ErrorBound, model: Model, data: Dataset) -> Document:
    """Return what ``smid error-bound --json`` writes."""
    return {
        "schema": ERROR_BOUND,
        "error_bound": bound.to_dict(),
        "model": model.to_dict(),
        "data": identity(data),
        "versions": versions(),
    }


def validate_document(validations: Sequence[Validation]) -> Document:
    """Return what ``smid validate --json`` writes."""
    return {"schema": VALIDATE, "validations": [v.to_dict() for v in validations], "versions": versions()}


def compare_document(comparison: Comparison) -> Document:
    """Return what ``smid compare --json`` writes."""
    return {"schema": COMPARE, "comparison": comparison.to_dict(), "versions": versions()}


def residuals_document(residuals: Residuals) -> Document:
    """Return what ``smid residuals --json`` writes."""
    return {"schema": RESIDUALS, "analysis": residuals.to_dict(), "versions": versions()}


def diagnose_document(diagnosis: Diagnosis) -> Document:
    """Return what ``smid diagnose --json`` writes."""
    return {**diagnosis.to_dict(), "schema": DIAGNOSE, "versions": versions()}


def response_document(band: ResponseBand) -> Document:
    """Return what ``smid response --json`` writes."""
    return {"schema": RESPONSE, "response": band.to_dict(), "versions": versions()}


def projections_document(found: Projections) -> Document:
    """Return what :func:`smid.report` writes of projections as JSON."""
    return {"schema": PROJECTION, "projections": found.to_dict(), "versions": versions()}


def study_document(name: str, content: Mapping[str, Any]) -> Document:
    """Return the document of a study (``study``, ``clutch-records`` and so on) with its own plain data."""
    return {"schema": f"smid.{name}/1", **content, "versions": versions()}


def as_text(document: Mapping[str, Any]) -> str:
    r"""Return the text of a document, as it is written to a file.

    Examples
    --------
    >>> as_text({"schema": "smid.study/1"})
    '{\n  "schema": "smid.study/1"\n}\n'
    """
    return json.dumps(document, indent=2, allow_nan=False, ensure_ascii=False) + "\n"
