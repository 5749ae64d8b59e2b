"""``smid error-bound``: an enclosure of the least noise bound."""

from __future__ import annotations

from collections.abc import Sequence

import click
import numpy as np

from relaxations.search.enclosure import Reason
from smid.cli.console import INTERRUPTED, Command, Progress
from smid.cli.loading import load_problem, load_record, noisy_outputs, stated_bounds
from smid.cli.options import NoiseBound, Problem, Record, Solve, read_known_bounds, seconds_option, takes
from smid.cli.outputs import Outputs, writes
from smid.cli.verbose import log_error_bound, verbose_option
from smid.identification.error_bound import error_bound as least_bound
from smid.models import load_model
from smid.models.parts import plain_name
from smid.reports import data_report
from smid.reports.documents import error_bound_document
from smid.reports.page import capitalised


@click.command("error-bound", cls=Command)
@takes(record=Record, problem=Problem)
@click.option(
    "--noise-bound",
    callback=read_known_bounds,
    metavar="Y=D,...",
    help="Noise bounds of all outputs but one, whose least noise bound is computed.",
)
@takes(solve=Solve)
@seconds_option
@writes("json", "report")
@verbose_option
@click.pass_context
def error_bound(
    context: click.Context,
    record: Record,
    problem: Problem,
    noise_bound: tuple[NoiseBound, ...] | None,
    solve: Solve,
    seconds: float,
    outputs: Outputs,
) -> None:
    """Compute the least noise bound with which a model explains a record.

    DATA is the record (a CSV file).
    """
    given = load_model(problem.model)
    data = load_record(record, given)
    model, fixed = load_problem(given, problem, data, solve.solver)
    fixed |= _others(noisy_outputs(model), noise_bound or ())
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


def _others(outputs: Sequence[str], asked: Sequence[NoiseBound]) -> dict[str, float]:
    """Return the noise bounds of the other outputs; a usage error unless exactly one is left."""
    named = [output for output in outputs if output in {plain_name(bound.channel or "") for bound in asked}]
    if len(asked) != len(outputs) - 1 or len(named) != len(asked):
        example = ",".join(f"{output}=..." for output in outputs[1:])
        cure = f"write --noise-bound {example} for all but one" if example else "leave out --noise-bound"
        raise click.UsageError(f"the least noise bound is that of one output, not of {', '.join(outputs)}: {cure}")
    return {channel: bound.value for channel, bound in stated_bounds("--noise-bound", named, asked).items()}
