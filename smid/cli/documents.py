"""The JSON documents of the command line: versioned, described field by field in docs/json.md."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import click

from smid.data import Dataset
from smid.diagnosis import Diagnosis
from smid.error_bound import ErrorBound
from smid.estimate import Estimate
from smid.identify import EmptyFeasibleSetError
from smid.models import Model, ModelError
from smid.reports import versions, write_text
from smid.validate import Validation

IDENTIFY, ERROR_BOUND, VALIDATE = "smid.identify/1", "smid.error-bound/1", "smid.validate/1"
DIAGNOSE, DOCTOR = "smid.diagnose/1", "smid.doctor/1"

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
    """Return what ``smid identify --json`` writes where no parameters explain the data."""
    return {
        "schema": IDENTIFY,
        "empty": {
            "message": str(error),
            "least_bound": error.least_bound,
            "samples": [{"experiment": e, "index": k, "weight": w} for e, k, w in error.samples],
        },
        "error_bound": None if error_bound is None else error_bound.to_dict(),
        "versions": versions(),
    }


def error_bound_document(bound: ErrorBound, model: Model, data: Dataset) -> Document:
    """Return what ``smid error-bound --json`` writes."""
    return {
        "schema": ERROR_BOUND,
        "error_bound": bound.to_dict(),
        "model": model.to_dict(),
        "data": {
            "source": data.source,
            "checksum": data.checksum,
            "samples": data.n_samples,
            "sampling_time": data.sampling_time,
        },
        "versions": versions(),
    }


def validate_document(validations: Sequence[Validation]) -> Document:
    """Return what ``smid validate --json`` writes."""
    return {"schema": VALIDATE, "validations": [v.to_dict() for v in validations], "versions": versions()}


def diagnose_document(diagnosis: Diagnosis) -> Document:
    """Return what ``smid diagnose --json`` writes."""
    return {**diagnosis.to_dict(), "schema": DIAGNOSE, "versions": versions()}


def write_document(target: str, document: Document) -> None:
    """Write a document to a file, or to standard output where the target is ``-``."""
    text = json.dumps(document, indent=2, allow_nan=False, ensure_ascii=False)
    if target == "-":
        click.echo(text)
    else:
        write_text(target, text + "\n")


def read_estimate(text: str, path: str) -> Document:
    """Return the estimate in a document of ``smid identify``, or in one of ``Estimate.to_dict``.

    Parameters
    ----------
    text : str
    path : str
        For messages.

    Raises
    ------
    ModelError
        Where the text is no such document, or holds no model with values.
    """
    try:
        content = json.loads(text)
    except json.JSONDecodeError as error:
        raise ModelError(f"{path} is no JSON: {error}; give what smid identify --json wrote") from None
    schema = content.get("schema") if isinstance(content, dict) else None
    if schema == IDENTIFY and "empty" in content:
        raise ModelError(f"{path} says that no parameters explain the data: there is no model to validate")
    estimate = content.get("estimate") if schema == IDENTIFY else content
    if not isinstance(estimate, dict) or estimate.get("schema") != "smid.estimate/1":
        raise ModelError(f"{path} holds no smid.estimate/1 (schema {schema!r}): give what smid identify --json wrote")
    if not estimate["model"]["values"]:
        raise ModelError(f"{path} holds a model without values: nothing could be bounded, so nothing can be validated")
    return estimate
