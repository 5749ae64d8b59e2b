"""Read and write the JSON documents of the command line; docs/json.md describes them field by field."""

from __future__ import annotations

import json

import click

from smid.models import ModelError
from smid.reports import write_text
from smid.reports.documents import IDENTIFY, Document, as_text

DOCTOR = "smid.doctor/1"


def write_document(target: str, document: Document) -> None:
    """Write a document to a file, or to standard output if the target is ``-``."""
    if target == "-":
        click.echo(as_text(document), nl=False)
    else:
        write_text(target, as_text(document))


def read_estimate(text: str, path: str) -> Document:
    """Return the estimate in a document of ``smid identify``, or in one of ``Estimate.to_dict``.

    Raises
    ------
    ModelError
        If the text is not such a document, or holds no model with values. The message names ``path``.
    """
    try:
        content = json.loads(text)
    except json.JSONDecodeError as error:
        raise ModelError(f"{path} is not valid JSON: {error}; give a file that smid identify --json wrote") from None
    schema = content.get("schema") if isinstance(content, dict) else None
    if schema == IDENTIFY and "empty" in content:
        raise ModelError(f"{path} says that no parameters explain the data: there is no model to simulate")
    estimate = content.get("estimate") if schema == IDENTIFY else content
    if not isinstance(estimate, dict) or estimate.get("schema") != "smid.estimate/1":
        raise ModelError(
            f"{path} holds no smid.estimate/1 (schema {schema!r}): give a file that smid identify --json wrote"
        )
    if not estimate["model"]["values"]:
        raise ModelError(
            f"{path} holds a model without values, because no parameter could be bounded: there is nothing to simulate"
        )
    return estimate
