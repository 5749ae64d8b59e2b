"""Where a command writes to, checked before any solve."""

from __future__ import annotations

from dataclasses import dataclass

import click

from smid.cli.documents import Document, write_document
from smid.reports import check_writable


@dataclass(frozen=True)
class Outputs:
    """The files a command was asked for.

    Parameters
    ----------
    json, report : str or None
        Paths; ``-`` for JSON on standard output, which then carries nothing else.

    Raises
    ------
    OSError
        If one of them cannot be written.
    """

    json: str | None
    report: str | None

    def __post_init__(self) -> None:
        for path in (self.json, self.report):
            if path not in (None, "-"):
                assert path is not None
                check_writable(path)

    def say(self, text: object) -> None:
        """Print a result for the eye, unless standard output belongs to JSON."""
        if self.json != "-":
            click.echo(str(text))

    def write(self, document: Document) -> None:
        """Write the JSON document, where one was asked for."""
        if self.json is not None:
            write_document(self.json, document)
