"""``smid identify``: intervals, central model, validation, from a CSV and a model file."""

from __future__ import annotations

from collections.abc import Sequence

import click
import numpy as np

from relaxations.deadline import time_limit
from relaxations.search.hierarchy import Reason
from smid.cli.console import EMPTY, INTERRUPTED, Progress
from smid.cli.loading import load_data, load_problem
from smid.cli.options import (
    NoiseBound,
    certificate_option,
    data_options,
    json_option,
    read_noise_bound,
    report_option,
    seconds_option,
    solver_options,
)
from smid.cli.outputs import Outputs
from smid.cli.verbose import log_error_bound, log_estimate, verbose_option
from smid.data import Dataset
from smid.feasible.feasible_set import check_data
from smid.fitting.binding import bind
from smid.fitting.validate import Validation
from smid.fitting.validate import validate as validate_model
from smid.identification.error_bound import ErrorBound
from smid.identification.error_bound import error_bound as least_bound
from smid.identification.estimate import Estimate
from smid.identification.identify import EmptyFeasibleSetError
from smid.identification.identify import identify as identify_model
from smid.models import Model, ModelError
from smid.reports import data_report
from smid.reports import report as write_report
from smid.reports.documents import empty_document, identify_document

DEFAULT = NoiseBound(1.2, True)
"""Just above the least bound the intervals are narrow because the set is, not because the data say so."""


@click.command()
@data_options
@click.option(
    "--noise-bound",
    callback=read_noise_bound,
    metavar="D|1.2x",
    help="Noise bound of the output in its unit, or a factor times the least bound. [default: 1.2x]",
)
@solver_options
@click.option(
    "--tolerance",
    type=click.FloatRange(min=0, min_open=True),
    default=1e-4,
    show_default=True,
    help="Stop at gaps below this share of the width.",
)
@click.option("--rounds", type=click.IntRange(min=1), default=10, show_default=True, help="At most so many.")
@click.option(
    "--nodes",
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    help="Where a gap is left, branch with at most so many relaxations for each end.",
)
@seconds_option
@click.option("--validate", "others", multiple=True, metavar="CSV", help="Another record; may be repeated.")
@json_option
@report_option
@certificate_option
@verbose_option
@click.pass_context
def identify(
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
    noise_bound: NoiseBound | None,
    order: int | None,
    method: str,
    solver: str,
    tolerance: float,
    rounds: int,
    nodes: int,
    seconds: float,
    others: tuple[str, ...],
    json_: str | None,
    report: str | None,
    certificate: str | None,
) -> None:
    """Certified parameter intervals of a model on the record DATA (a CSV file)."""
    outputs = Outputs(json_, report, certificate)
    dataset = load_data(data, input_, output, sampling_time, time, start, stop)
    bound_model, fixed = load_problem(model, dataset, solver, input_noise_bound)
    records = [load_data(path, input_, output, dataset.sampling_time, time) for path in others]
    for record in records:
        check_data(bind(bound_model, record), record)
    asked = noise_bound or DEFAULT
    settings = {
        "noise bound asked for": f"{asked.value:g} x least bound" if asked.relative else f"{asked.value:g}",
        "method asked for": method,
        "order asked for": "usual" if order is None else str(order),
        "solver": solver,
        "tolerance": f"{tolerance:g}",
        "rounds at most": str(rounds),
        "branching nodes at most": str(nodes),
    }
    channel = bound_model.output_channels[0]
    unit = dataset.channel(channel).unit
    enclosure: ErrorBound | None = None
    value = asked.value
    with time_limit(seconds), Progress() as progress:
        if asked.relative:
            enclosure = least_bound(
                bound_model, dataset, fixed, method=method, order=order, solver=solver, progress=progress
            )
            log_error_bound(enclosure)
            value = asked.value * enclosure.upper
        if enclosure is None or (enclosure.reason is not Reason.INTERRUPTED and np.isfinite(value)):
            try:
                estimate = identify_model(
                    bound_model,
                    dataset,
                    {**fixed, channel: value},
                    method=method,
                    order=order,
                    solver=solver,
                    tolerance=tolerance,
                    rounds=rounds,
                    nodes=nodes,
                    progress=progress,
                    certificate=certificate,
                )
            except EmptyFeasibleSetError as proof:
                _tell_empty(outputs, proof, enclosure, bound_model, dataset, settings)
                context.exit(EMPTY)
    if enclosure is not None:
        outputs.say(enclosure)
        if enclosure.reason is Reason.INTERRUPTED or not np.isfinite(value):
            click.echo("ended early: the enclosure above is proven, the intervals are not computed", err=True)
            context.exit(INTERRUPTED)
        chosen = "as asked" if noise_bound else "no --noise-bound was given"
        product = f"{asked.value:g} x {enclosure.upper:.6g} = {value:.6g} {unit}".rstrip()
        outputs.say(f"noise bound used: {product} ({chosen})")
    log_estimate(estimate)
    runs = validations(estimate, records)
    publish(outputs, estimate, enclosure, runs, settings)
    outputs.say_certificate()
    if interrupted(estimate):
        click.echo("interrupted: what is printed is proven", err=True)
        context.exit(INTERRUPTED)


def validations(estimate: Estimate, records: Sequence[Dataset]) -> list[Validation]:
    """Simulate the central model over other records; one that diverges is told and does not stop the rest."""
    runs = []
    for record in () if estimate.unbounded else records:
        try:
            runs.append(validate_model(estimate.model, record, estimate.noise_bound))
        except ModelError as error:
            click.echo(f"warning: no validation on {record.source}: {error}", err=True)
    return runs


def publish(
    outputs: Outputs,
    estimate: Estimate,
    enclosure: ErrorBound | None,
    runs: Sequence[Validation],
    settings: dict[str, str],
) -> None:
    """Print the estimate and write the files that were asked for."""
    outputs.say(estimate)
    for run in runs:
        outputs.say(f"\nvalidation on {run.data.source}\n{run}")
    outputs.write(identify_document(estimate, enclosure, runs))
    outputs.write_report(lambda path: write_report(estimate, path, enclosure, runs, settings=settings))


def interrupted(estimate: Estimate) -> bool:
    """Tell whether Ctrl-C cut the computation short."""
    return estimate.reason is Reason.INTERRUPTED


def _tell_empty(
    outputs: Outputs,
    proof: EmptyFeasibleSetError,
    enclosure: ErrorBound | None,
    model: Model,
    data: Dataset,
    settings: dict[str, str],
) -> None:
    outputs.say(proof)
    outputs.say_certificate()
    document = empty_document(proof, enclosure)
    outputs.write(document)
    title = "No parameters explain the data"
    outputs.write_report(
        lambda path: data_report(path, title, str(proof), model, data, enclosure, settings=settings, document=document)
    )
