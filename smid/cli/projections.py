"""``smid projections``: which values of two parameters go together, from a record and a model file."""

from __future__ import annotations

import click

from relaxations.deadline import time_limit
from smid.cli.console import INTERRUPTED, Command, Progress
from smid.cli.identify import Accuracy, load_task, noise_bound_option, origin_of_bound, proven_intervals
from smid.cli.options import NoiseBound, Problem, Record, Solve, seconds_option, takes
from smid.cli.outputs import Outputs, writes
from smid.cli.verbose import verbose_option
from smid.models import ModelError
from smid.reports import report as write_report
from smid.reports.documents import projections_document
from smid.responses.projections import projections as pairs_of


@click.command(cls=Command)
@takes(record=Record, problem=Problem)
@noise_bound_option
@click.option("--parameters", metavar="P,Q,...", help="Parameters to take all pairs of. [default: all]")
@click.option(
    "--directions",
    type=click.IntRange(min=4),
    default=8,
    show_default=True,
    help="Edges of a polygon at most, a multiple of four.",
)
@takes(solve=Solve, accuracy=Accuracy)
@seconds_option
@writes("json", "report")
@verbose_option
@click.pass_context
def projections(
    context: click.Context,
    record: Record,
    problem: Problem,
    noise_bound: tuple[NoiseBound, ...] | None,
    parameters: str | None,
    directions: int,
    solve: Solve,
    accuracy: Accuracy,
    seconds: float,
    outputs: Outputs,
) -> None:
    """Compute which values of two parameters go together: certified polygons for all pairs.

    Every pair of values that fits the record within the noise bound lies in its polygon. DATA is the record (a CSV
    file).
    """
    names = None if parameters is None else [name.strip() for name in parameters.split(",") if name.strip()]
    if directions % 4:
        raise click.UsageError(f"--directions {directions}: give a multiple of four; four are the intervals themselves")
    task = load_task(record, problem, noise_bound, solve, accuracy)
    have = [parameter.name for parameter in task.model.parameters]
    for name in names or ():
        if name not in have:
            raise ModelError(f"--parameters: {name!r} is no parameter of the model: choose among {', '.join(have)}")
    with time_limit(seconds), Progress() as progress:
        estimate, _ = proven_intervals(context, task, origin_of_bound(noise_bound), outputs, progress)
        found = pairs_of(estimate, names, directions, progress=progress)
    outputs.say(found)
    outputs.write(projections_document(found))
    outputs.write_report(lambda path: write_report(found, path, settings=task.settings))
    if not found.complete:
        click.echo("ended early: all printed polygons are proven", err=True)
        context.exit(INTERRUPTED)
