"""``smid diagnose``: what a model's simulation gets wrong on a record, why, and what to add."""

from __future__ import annotations

import click

from smid.cli.console import INTERRUPTED, Progress
from smid.cli.loading import load_data
from smid.cli.options import json_option, record_options, report_option, seconds_option
from smid.cli.outputs import Outputs
from smid.cli.verbose import log_diagnosis, verbose_option
from smid.diagnosis import EFFECTS, prove_parameters
from smid.diagnosis import diagnose as diagnose_model
from smid.fitting.binding import bind
from smid.models import load_model
from smid.reports import report as write_report
from smid.reports.documents import diagnose_document


def _list_effects(context: click.Context, _parameter: click.Parameter, asked: bool) -> None:
    """Print the table of effects and leave."""
    if not asked:
        return
    width = max(len(effect.name) for effect in EFFECTS)
    for effect in EFFECTS:
        click.echo(f"{effect.name.ljust(width)}  {effect.summary}")
    context.exit()


@click.command()
@record_options
@click.option("--channel", "channels", multiple=True, metavar="COL", help="Further column to consider; repeatable.")
@click.option(
    "--noise-bound",
    type=click.FloatRange(min=0, min_open=True),
    metavar="D",
    help="Noise bound of the output in its unit.",
)
@click.option("--effects", metavar="A,B,...", help="Effects to try; else all.")
@click.option(
    "--holdout",
    type=click.FloatRange(0.05, 0.9),
    default=0.3,
    show_default=True,
    help="Share of the record, at its end, that no fit may see.",
)
@click.option("--workers", type=click.IntRange(min=1), metavar="N", help="Processes; else one for each processor.")
@click.option("--no-certify", is_flag=True, help="Do not try to prove that the model cannot explain the data.")
@click.option(
    "--prove",
    type=click.IntRange(min=2),
    metavar="N",
    help="Certify the intervals of the named effects' parameters from the first N samples; needs a noise bound.",
)
@click.option(
    "--list-effects",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_list_effects,
    help="Print the effects that are known, and leave.",
)
@seconds_option
@json_option
@report_option
@verbose_option
@click.pass_context
def diagnose(
    context: click.Context,
    data: str,
    input_: str,
    output: str,
    sampling_time: float | None,
    time: str | None,
    start: int | None,
    stop: int | None,
    model: str,
    channels: tuple[str, ...],
    noise_bound: float | None,
    effects: str | None,
    holdout: float,
    workers: int | None,
    no_certify: bool,
    prove: int | None,
    seconds: float,
    json_: str | None,
    report: str | None,
) -> None:
    """Name what a model lacks on the record DATA (a CSV file): what is wrong, why, what to add, what it gains."""
    outputs = Outputs(json_, report)
    if prove is not None and noise_bound is None:
        raise click.UsageError("--prove needs a noise bound to prove anything by: give --noise-bound D")
    dataset = load_data(data, input_, output, sampling_time, time, start, stop, channels)
    base = bind(load_model(model), dataset)
    chosen = None if effects is None else [name.strip() for name in effects.split(",") if name.strip()]
    with Progress() as progress:
        diagnosis = diagnose_model(
            base,
            dataset,
            noise_bound,
            chosen,
            holdout,
            certify=not no_certify,
            workers=workers,
            seconds=seconds,
            progress=progress,
        )
        if prove is not None and noise_bound is not None and diagnosis.causes and not diagnosis.interrupted:
            diagnosis = prove_parameters(diagnosis, noise_bound, prove)
    log_diagnosis(diagnosis)
    outputs.say(diagnosis)
    outputs.write(diagnose_document(diagnosis))
    settings = {
        "noise bound": "none" if noise_bound is None else f"{noise_bound:g} {diagnosis.unit}".rstrip(),
        "effects": "all" if chosen is None else ", ".join(chosen),
        "held out": f"{holdout:g} of the record, at its end",
        "command": "smid diagnose",
    }
    outputs.write_report(lambda path: write_report(diagnosis, path, settings=settings))
    if diagnosis.interrupted:
        click.echo("ended early: effects that were not tried yet may explain more", err=True)
        context.exit(INTERRUPTED)
