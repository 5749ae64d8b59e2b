"""``smid validate``: free runs of an identified model over other records."""

from __future__ import annotations

from dataclasses import dataclass

import click

from smid.cli.console import Command
from smid.cli.loading import load_estimate, load_for
from smid.cli.options import FILE, EstimateColumns, argument, group, takes
from smid.cli.outputs import Outputs, writes
from smid.identification.estimate import Estimate
from smid.reports import data_report
from smid.reports.documents import validate_document
from smid.reports.page import capitalised
from smid.validation.validate import validate as validate_model


@dataclass(frozen=True)
class Records:
    """The records to simulate."""

    paths: tuple[str, ...] = argument(nargs=-1, required=True, type=FILE, metavar="DATA...")
    columns: EstimateColumns = group(EstimateColumns)


@click.command(cls=Command)
@click.argument("estimate", type=FILE)
@takes(records=Records)
@writes("json", "report")
def validate(estimate: str, records: Records, outputs: Outputs) -> None:
    """Simulate an identified model on other records.

    ESTIMATE is a file that smid identify --json or smid fit --json wrote; DATA are the records (CSV files). A record
    with time stamps is resampled to the sampling time of the estimate. A record without time stamps is taken to have
    that sampling time.
    """
    found = load_estimate(estimate)
    model = found.model
    bounds = found.noise_bound if isinstance(found, Estimate) else None
    runs = [validate_model(found, load_for(found, path, records.columns), bounds) for path in records.paths]
    for run in runs:
        outputs.say(f"{run.data.source}\n{run}\n")
    document = validate_document(runs)
    outputs.write(document)
    worst = min(score.fit_percent for run in runs for score in run.scores)
    count = "1 record" if len(runs) == 1 else f"{len(runs)} records"
    sentence = f"Lowest fit in the free runs over {count}: {worst:.2f} %."
    title = f"{capitalised(model.name)}: validation"
    outputs.write_report(lambda path: data_report(path, title, sentence, model, validations=runs, document=document))
