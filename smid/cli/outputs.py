"""The files that a command writes, checked before any solve."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import Any

import click

from smid.cli.documents import write_document
from smid.cli.options import Command, certificate_option, json_option, report_option
from smid.reports import PdfWarning, check_report, check_writable
from smid.reports.documents import Document


@dataclass(frozen=True)
class Outputs:
    """The files that the user asked for; ``-`` for JSON is standard output, which then holds nothing else.

    OSError if a file cannot be written, click.BadParameter if the suffix of the report is not a report format.
    """

    json: str | None
    report: str | None
    certificate: str | None = None

    def __post_init__(self) -> None:
        if self.certificate is not None:
            check_writable(self.certificate)
        if self.json is not None and self.json != "-":
            check_writable(self.json)
        if self.report is not None:
            try:
                check_report(self.report)
            except ValueError as error:
                raise click.BadParameter(str(error), param_hint="--report") from None

    def say(self, text: object) -> None:
        """Print a result, unless standard output holds the JSON document."""
        if self.json != "-":
            click.echo(str(text))

    def write(self, document: Document) -> None:
        """Write the JSON document, if the user asked for it."""
        if self.json is not None:
            write_document(self.json, document)

    def say_certificate(self) -> None:
        """Print the path of the certificate, and the command that checks it."""
        if self.certificate is not None and Path(self.certificate).exists():
            self.say(f"certificate: {self.certificate} (python -m relaxations.check {self.certificate})")

    def write_report(self, write: Callable[[str], Path]) -> None:
        """Call ``write`` with the path of the report, if the user asked for one, and print where the report is."""
        if self.report is not None:
            with pdf_warnings_printed():
                page = write(self.report)
            self.say(f"report: {page}")


@contextmanager
def pdf_warnings_printed() -> Iterator[None]:
    """Print each :class:`PdfWarning` as one line on standard error."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", PdfWarning)
        yield
    for warning in caught:
        click.echo(f"warning: {warning.message}", err=True)


_OPTIONS = {"json": json_option, "report": report_option, "certificate": certificate_option}


def writes(*names: str) -> Callable[[Command], Command]:
    """Return a decorator that adds options ("json", "report", "certificate"), and gives the command one ``outputs``."""

    def decorate(command: Command) -> Command:
        @wraps(command)
        def call(*args: Any, **values: Any) -> Any:
            outputs = Outputs(*(values.pop(name, None) for name in ("json_", "report", "certificate")))
            return command(*args, **values, outputs=outputs)

        for name in reversed(names):
            call = _OPTIONS[name](call)
        return call

    return decorate
