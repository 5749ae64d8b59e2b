"""Write the JSON documents of the command line; docs/json.md describes them field by field."""

from __future__ import annotations

import click

from smid.reports import write_text
from smid.reports.documents import Document, as_text

DOCTOR = "smid.doctor/1"


def write_document(target: str, document: Document) -> None:
    """Write a document to a file, or to standard output if the target is ``-``."""
    if target == "-":
        click.echo(as_text(document), nl=False)
    else:
        write_text(target, as_text(document))
