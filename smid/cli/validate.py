"""``smid validate``: free runs of an identified model over other records."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from smid.cli.console import Command
from smid.cli.documents import read_estimate
from smid.cli.loading import load_data
from smid.cli.options import FILE, Columns, Reading, argument, group, option, takes
from smid.cli.outputs import Outputs, writes
from smid.data import Dataset
from smid.data.read_csv import read_text
from smid.models import Model
from smid.reports import data_report
from smid.reports.documents import validate_document
from smid.reports.page import capitalised
from smid.validation.validate import validate as validate_model


@dataclass(frozen=True)
class Records:
    """The records to simulate; columns that the user does not name are those of the estimate."""

    paths: tuple[str, ...] = argument(nargs=-1, required=True, type=FILE, metavar="DATA...")
    input: str | None = option(metavar="U", help="Column of the input. [default: as in the estimate]")
    output: str | None = option(metavar="Y", help="Column of the output. [default: as in the estimate]")
    sampling_time: float | None = option(
        type=float, metavar="S", help="Sampling time in seconds. [default: as in the estimate]"
    )
    time: str | None = option(
        metavar="COL", help="Column of time stamps. [default: the column named time, or the only one of dates]"
    )
    reading: Reading = group(Reading)

    def load(self, model: Model, estimate: dict[str, Any]) -> list[Dataset]:
        """Return the records at the sampling time of the estimate."""
        columns = Columns(
            self.input or model.input_channels[0],
            self.output or model.output_channels[0],
            self.sampling_time or estimate["data"]["sampling_time"],
            self.time,
            self.reading,
        )
        return [load_data(path, columns) for path in self.paths]


@click.command(cls=Command)
@click.argument("estimate", type=FILE)
@takes(records=Records)
@writes("json", "report")
def validate(estimate: str, records: Records, outputs: Outputs) -> None:
    """Simulate an identified model on other records.

    ESTIMATE is a file that smid identify --json wrote; DATA are the records (CSV files). A record with time stamps is
    resampled to the sampling time of the estimate. A record without time stamps is taken to have that sampling time.
    """
    found = read_estimate(read_text(Path(estimate)), estimate)
    model = Model.from_dict(found["model"])
    bound = found["noise_bound"].get(model.output_channels[0])
    runs = [validate_model(model, record, bound) for record in records.load(model, found)]
    for run in runs:
        outputs.say(f"{run.data.source}\n{run}\n")
    document = validate_document(runs)
    outputs.write(document)
    worst = min(score.fit_percent for run in runs for score in run.scores)
    count = "1 record" if len(runs) == 1 else f"{len(runs)} records"
    sentence = f"Lowest fit in the free runs over {count}: {worst:.2f} %."
    title = f"{capitalised(model.name)}: validation"
    outputs.write_report(lambda path: data_report(path, title, sentence, model, validations=runs, document=document))
