"""``smid compare``: free runs of several identified models over one record."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import click

from smid.cli.console import Command
from smid.cli.loading import load_estimate, load_for
from smid.cli.options import FILE, EstimateColumns, argument, group, takes
from smid.cli.outputs import Outputs, writes
from smid.models import ModelError
from smid.reports import report
from smid.reports.documents import compare_document
from smid.validation import compare as compare_models


@dataclass(frozen=True)
class Candidates:
    """The estimates, and the record to simulate."""

    estimates: tuple[str, ...] = argument(nargs=-1, required=True, type=FILE, metavar="MODEL...")
    path: str = argument(type=FILE, metavar="DATA")
    columns: EstimateColumns = group(EstimateColumns)


@click.command(cls=Command)
@takes(given=Candidates)
@writes("json", "report")
def compare(given: Candidates, outputs: Outputs) -> None:
    """Compare identified models by their free runs over one record.

    Each MODEL is a file that smid identify --json or smid fit --json wrote, and is named by the name of the file. DATA
    is the record. Its columns and its sampling time are those of the first model, unless you name others.
    """
    found = [load_estimate(path) for path in given.estimates]
    for path, one in zip(given.estimates, found, strict=True):
        if not math.isclose(one.data.sampling_time, found[0].data.sampling_time):
            raise ModelError(
                f"{path} was identified at {one.data.sampling_time:g} s and {given.estimates[0]} at "
                f"{found[0].data.sampling_time:g} s: compare estimates of one sampling time"
            )
    # Two files of one name in different folders are named by their paths.
    stems = Counter(Path(path).stem for path in dict.fromkeys(given.estimates))
    names = [Path(path).stem if stems[Path(path).stem] == 1 else path for path in given.estimates]
    data = load_for(found[0], given.path, given.columns)
    comparison = compare_models(dict(zip(names, found, strict=True)), data)
    outputs.say(comparison)
    outputs.write(compare_document(comparison))
    outputs.write_report(lambda path: report(comparison, path))
