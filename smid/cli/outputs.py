"""Where a command writes to, checked before any solve."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import click

from smid.cli.documents import write_document
from smid.reports import PdfWarning, check_report, check_writable
from smid.reports.documents import Document


@dataclass(frozen=True)
class Outputs:
    """The files a command was asked for.

    Parameters
    ----------
    json, report
        Paths; ``-`` for JSON on standard output, which then carries nothing else.
    certificate
        Path of a proof.

    Raises
    ------
    OSError
        If one of them cannot be written.
    click.BadParameter
        If the suffix of the report names no format.
    """

    json: str | None
    report: str | None
    certificate: str | None = None

    def __post_init__(self) -> None:
        if self.certificate is not None:
            check_writable(self.certificate)
        if self.json not in (None, "-"):
            assert self.json is not None
            check_writable(self.json)
        if self.report is not None:
            try:
                check_report(self.report)
            except ValueError as error:
                raise click.BadParameter(str(error), param_hint="--report") from None

    def say(self, text: object) -> None:
        """Print a result for the eye, unless standard output belongs to JSON."""
        if self.json != "-":
            click.echo(str(text))

    def write(self, document: Document) -> None:
        """Write the JSON document, where one was asked for."""
        if self.json is not None:
            write_document(self.json, document)

    def say_certificate(self) -> None:
        """Tell where the proof is, and how it is checked."""
        if self.certificate is not None and Path(self.certificate).exists():
            self.say(f"certificate: {self.certificate} (python -m relaxations.check {self.certificate})")

    def write_report(self, write: Callable[[str], Path]) -> None:
        """Have the report written, where one was asked for, and tell where it is."""
        if self.report is not None:
            with pdf_warnings_told():
                page = write(self.report)
            self.say(f"report: {page}")


@contextmanager
def pdf_warnings_told() -> Iterator[None]:
    """Tell in one line on standard error that no PDF could be printed, and why."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", PdfWarning)
        yield
    for warning in caught:
        click.echo(f"warning: {warning.message}", err=True)
