"""``smid fit``: a model fitted to a record, without proof."""

from __future__ import annotations

from dataclasses import dataclass

import click

from smid.cli.console import Command
from smid.cli.loading import load_record
from smid.cli.options import FILE, Record, option, takes
from smid.cli.outputs import Outputs, writes
from smid.fitting.binding import bind_whole
from smid.models import load_model, save_model
from smid.reports import check_writable, report
from smid.reports.documents import fit_document
from smid.validation import fit as fit_model


@dataclass(frozen=True)
class Fitted:
    """What is fitted, and how."""

    model: str = option(required=True, type=FILE, metavar="TOML", help="File with the model class and its settings.")
    minimax: bool = option(is_flag=True, help="Minimise the largest error in place of the sum of squares.")
    save_model: str | None = option(type=FILE, metavar="TOML", help="Write the fitted model as a model file.")


@click.command(cls=Command)
@takes(record=Record, fitted=Fitted)
@writes("json", "report")
def fit(record: Record, fitted: Fitted, outputs: Outputs) -> None:
    """Fit a model to a record by least squares, or by the least largest error.

    DATA is the record (a CSV file). A fit has no certified intervals: smid identify computes them.
    """
    if fitted.save_model is not None:
        check_writable(fitted.save_model)
    given = load_model(fitted.model)
    data = load_record(record, given)
    found = fit_model(bind_whole(given, data), data, "minimax" if fitted.minimax else "least_squares")
    outputs.say(found)
    outputs.write(fit_document(found))
    outputs.write_report(lambda path: report(found, path, settings={"command": "smid fit"}))
    if fitted.save_model is not None:
        outputs.say(f"model: {save_model(found.model, fitted.save_model)}")
