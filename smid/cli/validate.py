"""``smid validate``: free runs of an identified model over other records."""

from __future__ import annotations

from pathlib import Path

import click

from smid.cli.documents import read_estimate
from smid.cli.loading import load_data
from smid.cli.options import FILE, json_option, report_option
from smid.cli.outputs import Outputs
from smid.data.read_csv import read_text
from smid.fitting.validate import validate as validate_model
from smid.models import Model
from smid.reports import data_report
from smid.reports.documents import validate_document
from smid.reports.page import capitalised


@click.command()
@click.argument("estimate", type=FILE)
@click.argument("data", nargs=-1, required=True, type=FILE)
@click.option("--input", "input_", metavar="U", help="Column of the input; else as in the estimate.")
@click.option("--output", metavar="Y", help="Column of the output; else as in the estimate.")
@click.option("--sampling-time", type=float, metavar="S", help="Seconds; else as in the estimate.")
@click.option("--time", metavar="COL", help="Column of time stamps; else the one called time.")
@json_option
@report_option
def validate(
    estimate: str,
    data: tuple[str, ...],
    input_: str | None,
    output: str | None,
    sampling_time: float | None,
    time: str | None,
    json_: str | None,
    report: str | None,
) -> None:
    """Free runs of the model in ESTIMATE (written by smid identify --json) over the records DATA.

    Time stamps are brought to the sampling time of the estimate; a record without them is taken to have it.
    """
    outputs = Outputs(json_, report)
    found = read_estimate(read_text(Path(estimate)), estimate)
    model = Model.from_dict(found["model"])
    bound = found["noise_bound"].get(model.output_channels[0])
    columns = (input_ or model.input_channels[0], output or model.output_channels[0])
    interval = sampling_time or found["data"]["sampling_time"]
    records = [load_data(path, *columns, sampling_time=interval, time=time) for path in data]
    runs = [validate_model(model, record, bound) for record in records]
    for run in runs:
        outputs.say(f"{run.data.source}\n{run}\n")
    document = validate_document(runs)
    outputs.write(document)
    worst = min(score.fit_percent for run in runs for score in run.scores)
    sentence = f"Free runs over {len(runs)} record(s): the lowest fit is {worst:.2f} %."
    title = f"{capitalised(model.name)}: validation"
    outputs.write_report(lambda path: data_report(path, title, sentence, model, validations=runs, document=document))
