"""``smid study``: identifications over orders, methods, noise bounds, sample sizes and records, resumable."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TypeVar

import click

from relaxations.search.hierarchy import Reason
from smid.cli.console import INTERRUPTED, Progress
from smid.cli.loading import load_data, load_problem
from smid.cli.options import (
    FILE,
    NoiseBound,
    column_options,
    input_noise_option,
    json_option,
    model_option,
    read_noise_bound,
    report_option,
    solver_option,
)
from smid.cli.outputs import Outputs
from smid.cli.studies import publish
from smid.data import DataError, Dataset
from smid.identification.error_bound import error_bound as least_bound
from smid.identification.estimate import round_up
from smid.identification.identify import METHODS
from smid.models import Model
from smid.reports import report as write_report
from smid.reports.chapter import together
from smid.study import dask_executor, order_study

FOLDER = click.Path(file_okay=False)
Item = TypeVar("Item")


def separated(
    read: Callable[[click.Context, click.Parameter, str], Item],
) -> Callable[[click.Context, click.Parameter, str | None], tuple[Item, ...] | None]:
    """Return a reader of values with commas between."""

    def split(context: click.Context, parameter: click.Parameter, text: str | None) -> tuple[Item, ...] | None:
        return None if text is None else tuple(read(context, parameter, part.strip()) for part in text.split(","))

    return split


def _read_count(context: click.Context, parameter: click.Parameter, text: str) -> int:
    if not text.isdigit() or int(text) < 1:
        raise click.BadParameter(f"{text!r} is no positive whole number: give numbers as in 1,2", context, parameter)
    return int(text)


def _read_method(context: click.Context, parameter: click.Parameter, text: str) -> str:
    if text not in METHODS:
        raise click.BadParameter(f"{text!r} is no method: choose among {', '.join(METHODS)}", context, parameter)
    return text


def _read_bound(context: click.Context, parameter: click.Parameter, text: str) -> NoiseBound:
    bound = read_noise_bound(context, parameter, text)
    assert bound is not None
    return bound


@click.command()
@click.argument("data", type=FILE, nargs=-1, required=True)
@column_options
@model_option
@click.option(
    "--orders",
    default="1,2",
    show_default=True,
    callback=separated(_read_count),
    metavar="K,...",
    help="Of relaxation.",
)
@click.option(
    "--methods",
    default="auto",
    show_default=True,
    callback=separated(_read_method),
    metavar="M,...",
    help=f"{', '.join(METHODS)}.",
)
@click.option(
    "--noise-bounds",
    default="1.2x",
    show_default=True,
    callback=separated(_read_bound),
    metavar="D|1.2x,...",
    help="Of the output in its unit, or factors times the least bound that suits all records.",
)
@input_noise_option
@click.option(
    "--samples", callback=separated(_read_count), metavar="N,...", help="First samples to use; by default all."
)
@solver_option
@click.option("--workers", type=click.IntRange(min=1), metavar="N", help="Processes on this machine. [default: 1]")
@click.option("--dask", metavar="ADDRESS", help="Run on the Dask cluster of this scheduler.")
@click.option("--folder", type=FOLDER, metavar="DIR", help="Keep each outcome there as it comes.")
@click.option("--resume", type=FOLDER, metavar="DIR", help="Go on with the study that is kept there.")
@json_option
@report_option
@click.pass_context
def study(
    context: click.Context,
    data: tuple[str, ...],
    input_: str,
    output: str,
    sampling_time: float | None,
    time: str | None,
    model: str,
    orders: tuple[int, ...],
    methods: tuple[str, ...],
    noise_bounds: tuple[NoiseBound, ...],
    input_noise_bound: float | None,
    samples: tuple[int, ...] | None,
    solver: str,
    workers: int | None,
    dask: str | None,
    folder: str | None,
    resume: str | None,
    json_: str | None,
    report: str | None,
) -> None:
    """Certified intervals on the records DATA, for every combination of what is given with commas."""
    if workers is not None and dask is not None:
        raise click.UsageError("--workers are of this machine, --dask names another: give one of them")
    if folder is not None and resume is not None:
        raise click.UsageError("--folder begins a study, --resume goes on with one: give one of them")
    outputs = Outputs(json_, report)
    records = _records(data, lambda path: load_data(path, input_, output, sampling_time, time))
    together(records)  # the page shows them as one: better refused now than after the work
    problems = {name: load_problem(model, record, solver, input_noise_bound) for name, record in records.items()}
    bound_model, fixed = next(iter(problems.values()))
    cluster: AbstractContextManager[Executor | None] = nullcontext() if dask is None else dask_executor(dask)
    with cluster as executor, Progress() as progress:
        bounds = _absolute(noise_bounds, problems, records, solver, progress)
        found = order_study(
            bound_model,
            records,
            [{**fixed, bound_model.output_channels[0]: bound} for bound in bounds],
            orders=orders,
            methods=methods,
            sample_sizes=samples,
            solver=solver,
            workers=workers or 1,
            executor=executor,
            folder=folder or resume,
            resume=resume is not None,
            progress=progress,
        )
    settings = {
        "orders": ", ".join(map(str, orders)),
        "methods": ", ".join(methods),
        "noise bounds asked for": ", ".join(
            f"{b.value:g}{' x least bound' if b.relative else ''}" for b in noise_bounds
        ),
        "samples": "all" if samples is None else ", ".join(map(str, samples)),
        "solver": solver,
    }
    publish(outputs, "study", found, lambda path, asked: write_report(found, path, settings=asked), settings)
    if found.interrupted:
        kept = folder or resume
        cure = f"go on with --resume {kept} in place of --folder" if kept else "with --folder DIR it could be resumed"
        click.echo(f"interrupted: what is printed is proven; {cure}", err=True)
        context.exit(INTERRUPTED)


def _records(paths: Sequence[str], load: Callable[[str], Dataset]) -> dict[str, Dataset]:
    """Read the files; each record is called by the stem of its file."""
    records: dict[str, Dataset] = {}
    for path in paths:
        name = Path(path).stem
        if name in records:
            raise DataError(f"two records are called {name!r}: rename one of the files")
        records[name] = load(path)
    return records


def _absolute(
    asked: Sequence[NoiseBound],
    problems: dict[str, tuple[Model, dict[str, float]]],
    records: dict[str, Dataset],
    solver: str,
    progress: Progress,
) -> list[float]:
    """Return the bounds in the output's unit; a factor multiplies the largest of the records' least bounds."""
    least = 0.0
    if any(bound.relative for bound in asked):
        for name, (model, fixed) in problems.items():
            enclosure = least_bound(model, records[name], fixed, solver=solver, progress=progress)
            if enclosure.reason is Reason.INTERRUPTED:
                raise click.Abort
            least = max(least, enclosure.upper)
    # Four digits: a study that is resumed must come to the same number, and it is easier to read.
    return [float(round_up(bound.value * least, 4)) if bound.relative else bound.value for bound in asked]
