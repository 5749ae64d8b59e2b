"""``smid residuals``: tests of the residuals of an identified model."""

from __future__ import annotations

from dataclasses import dataclass

import click

from smid.cli.console import Command
from smid.cli.loading import load_estimate, load_for
from smid.cli.options import FILE, EstimateColumns, argument, group, takes
from smid.cli.outputs import Outputs, writes
from smid.reports import report
from smid.reports.documents import residuals_document
from smid.validation import residuals as test_residuals


@dataclass(frozen=True)
class Simulated:
    """The estimate, and the record to simulate."""

    estimate: str = argument(type=FILE, metavar="MODEL")
    path: str = argument(type=FILE, metavar="DATA")
    columns: EstimateColumns = group(EstimateColumns)


@click.command(cls=Command)
@takes(given=Simulated)
@writes("json", "report")
def residuals(given: Simulated, outputs: Outputs) -> None:
    """Test the residuals of an identified model: whiteness, independence of the input, spectrum.

    MODEL is a file that smid identify --json or smid fit --json wrote. DATA is the record. Its columns and its sampling
    time are those of the model, unless you name others.
    """
    found = load_estimate(given.estimate)
    tested = test_residuals(found, load_for(found, given.path, given.columns))
    outputs.say(tested)
    outputs.write(residuals_document(tested))
    outputs.write_report(lambda path: report(tested, path))
