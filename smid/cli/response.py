"""``smid response``: step or frequency response with certified bands, from a CSV file and a model file."""

from __future__ import annotations

from collections.abc import Sequence

import click

from relaxations.deadline import time_limit
from smid.cli.console import INTERRUPTED, Command, Progress
from smid.cli.identify import Accuracy, load_task, noise_bound_option, origin_of_bound, proven_intervals
from smid.cli.options import NoiseBound, Problem, Record, Solve, seconds_option, takes
from smid.cli.outputs import Outputs, writes
from smid.cli.verbose import verbose_option
from smid.reports import report as write_report
from smid.reports.documents import response_document
from smid.responses.coefficients import Coefficients
from smid.responses.respond import bode
from smid.responses.respond import step as step_response


def _numbers(context: click.Context, parameter: click.Parameter, text: str | None) -> list[float] | None:
    """Return the numbers in a text such as ``0.1,1,10``."""
    try:
        return None if text is None else [float(part) for part in text.split(",")]
    except ValueError:
        raise click.BadParameter(f"{text!r} is no list of numbers: write it as 0.1,1,10", context, parameter) from None


@click.command(cls=Command)
@takes(record=Record, problem=Problem)
@noise_bound_option
@click.option("--step/--bode", default=True, help="Step response, or gain and phase. [default: step]")
@click.option(
    "--samples", type=click.IntRange(min=1), default=50, show_default=True, help="Samples of the step response."
)
@click.option(
    "--frequencies",
    callback=_numbers,
    metavar="W,...",
    help="Frequencies in rad/s. [default: 40 over two decades, up to the Nyquist frequency]",
)
@takes(solve=Solve, accuracy=Accuracy)
@seconds_option
@writes("json", "report")
@verbose_option
@click.pass_context
def response(
    context: click.Context,
    record: Record,
    problem: Problem,
    noise_bound: tuple[NoiseBound, ...] | None,
    step: bool,
    samples: int,
    frequencies: Sequence[float] | None,
    solve: Solve,
    accuracy: Accuracy,
    seconds: float,
    outputs: Outputs,
) -> None:
    """Compute the step or frequency response of a model with certified bands.

    The response of every model that fits the record within the noise bound lies within the bands. DATA is the record (a
    CSV file).
    """
    if step and frequencies is not None:
        raise click.UsageError("--frequencies belongs to --bode: add --bode, or leave it out")
    task = load_task(record, problem, noise_bound, solve, accuracy)
    Coefficients.of(task.model)  # refuses a model without a linear block before any solve
    with time_limit(seconds), Progress() as progress:
        estimate, _ = proven_intervals(context, task, origin_of_bound(noise_bound), outputs, progress)
        found = step_response(estimate, samples) if step else bode(estimate, frequencies)
    outputs.say(found)
    outputs.write(response_document(found))
    outputs.write_report(lambda path: write_report(found, path, settings=task.settings))
    if not found.complete:
        click.echo("ended early: all printed bands are proven", err=True)
        context.exit(INTERRUPTED)
