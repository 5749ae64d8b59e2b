"""``smid error-bound``: an enclosure of the least noise bound."""

from __future__ import annotations

import click

from relaxations.search.hierarchy import Reason
from smid.cli.console import INTERRUPTED, Progress
from smid.cli.loading import load_data, load_problem
from smid.cli.options import data_options, json_option, report_option, seconds_option, solver_options
from smid.cli.outputs import Outputs
from smid.cli.verbose import log_error_bound, verbose_option
from smid.identification.error_bound import error_bound as least_bound
from smid.reports import data_report
from smid.reports.documents import error_bound_document


@click.command("error-bound")
@data_options
@solver_options
@seconds_option
@json_option
@report_option
@verbose_option
@click.pass_context
def error_bound(
    context: click.Context,
    data: str,
    input_: str,
    output: str,
    sampling_time: float | None,
    time: str | None,
    start: int | None,
    stop: int | None,
    model: str,
    input_noise_bound: float | None,
    order: int | None,
    method: str,
    solver: str,
    seconds: float,
    json_: str | None,
    report: str | None,
) -> None:
    """Least noise bound with which a model explains the record DATA (a CSV file)."""
    outputs = Outputs(json_, report)
    dataset = load_data(data, input_, output, sampling_time, time, start, stop)
    bound_model, fixed = load_problem(model, dataset, solver, input_noise_bound)
    with Progress() as progress:
        bound = least_bound(
            bound_model,
            dataset,
            fixed,
            method=method,
            order=order,
            solver=solver,
            seconds=seconds,
            progress=progress,
        )
    log_error_bound(bound)
    outputs.say(bound)
    document = error_bound_document(bound, bound_model, dataset)
    outputs.write(document)
    settings = {"method asked for": method, "order asked for": str(order or "usual"), "solver": solver}
    title = f"Least noise bound of {bound.channel}"
    sentence = f"{str(bound)[0].upper()}{str(bound)[1:]}."
    outputs.write_report(
        lambda path: data_report(
            path, title, sentence, bound_model, dataset, bound, settings=settings, document=document
        )
    )
    if bound.reason is Reason.INTERRUPTED:
        click.echo("interrupted: what is printed is proven", err=True)
        context.exit(INTERRUPTED)
