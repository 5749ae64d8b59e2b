"""``smid error-bound``: an enclosure of the least noise bound."""

from __future__ import annotations

import click
import numpy as np

from relaxations.search.enclosure import Reason
from smid.cli.console import INTERRUPTED, Progress
from smid.cli.loading import load_problem, load_record
from smid.cli.options import Problem, Record, Solve, seconds_option, takes
from smid.cli.outputs import Outputs, writes
from smid.cli.verbose import log_error_bound, verbose_option
from smid.identification.error_bound import error_bound as least_bound
from smid.reports import data_report
from smid.reports.documents import error_bound_document
from smid.reports.page import capitalised


@click.command("error-bound")
@takes(record=Record, problem=Problem, solve=Solve)
@seconds_option
@writes("json", "report")
@verbose_option
@click.pass_context
def error_bound(
    context: click.Context, record: Record, problem: Problem, solve: Solve, seconds: float, outputs: Outputs
) -> None:
    """Compute the least noise bound with which a model explains a record.

    DATA is the record (a CSV file).
    """
    data = load_record(record)
    model, fixed = load_problem(problem, data, solve.solver)
    with Progress() as progress:
        bound = least_bound(model, data, fixed, **vars(solve), seconds=seconds, progress=progress)
    log_error_bound(bound)
    outputs.say(bound)
    document = error_bound_document(bound, model, data)
    outputs.write(document)
    settings = {"method": solve.method, "order": str(solve.order or "usual"), "solver": solve.solver}
    title, sentence = f"Least noise bound of {bound.channel}", f"{capitalised(str(bound))}."
    outputs.write_report(
        lambda path: data_report(path, title, sentence, model, data, bound, settings=settings, document=document)
    )
    if bound.reason is Reason.INTERRUPTED:
        click.echo("interrupted: all printed bounds are proven", err=True)
        context.exit(INTERRUPTED)
    if not np.isfinite(bound.upper):
        click.echo("ended early: the least noise bound is not known", err=True)
        context.exit(INTERRUPTED)
