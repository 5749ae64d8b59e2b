"""``smid study``: identifications over orders, methods, noise bounds, sample sizes and records, resumable."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from typing import TypeVar

import click

from relaxations.proof.method import method_names
from relaxations.search.enclosure import Reason
from smid.cli.console import INTERRUPTED, Command, Progress
from smid.cli.loading import load_named, load_problem, noisy_outputs
from smid.cli.options import (
    FILE,
    SOLVER,
    Columns,
    NoiseBound,
    Problem,
    argument,
    group,
    option,
    read_noise_bound,
    takes,
)
from smid.cli.outputs import Outputs, writes
from smid.cli.studies import publish
from smid.data import Dataset
from smid.identification.error_bound import error_bound
from smid.identification.estimate import round_up
from smid.models import Model, load_model
from smid.reports import report as write_report
from smid.reports.chapter import together
from smid.study import dask_executor, order_study

FOLDER = click.Path(file_okay=False)
Item = TypeVar("Item")


def separated(
    read: Callable[[click.Context, click.Parameter, str], Item],
) -> Callable[[click.Context, click.Parameter, str | None], tuple[Item, ...] | None]:
    """Return a click callback that reads values separated by commas."""

    def split(context: click.Context, parameter: click.Parameter, text: str | None) -> tuple[Item, ...] | None:
        return None if text is None else tuple(read(context, parameter, part.strip()) for part in text.split(","))

    return split


def _read_count(context: click.Context, parameter: click.Parameter, text: str) -> int:
    if not text.isdigit() or int(text) < 1:
        raise click.BadParameter(f"{text!r} is not a positive integer: give numbers as in 1,2", context, parameter)
    return int(text)


def _read_method(context: click.Context, parameter: click.Parameter, text: str) -> str:
    if text not in method_names():
        raise click.BadParameter(
            f"{text!r} is not a method: choose among {', '.join(method_names())}", context, parameter
        )
    return text


def _read_bound(context: click.Context, parameter: click.Parameter, text: str) -> NoiseBound:
    bound = read_noise_bound(context, parameter, text)
    assert bound is not None
    return bound


@dataclass(frozen=True)
class Records:
    """The records of a study."""

    columns: Columns = group(Columns)
    paths: tuple[str, ...] = argument(nargs=-1, required=True, type=FILE, metavar="DATA...")

    def load(self, model: Model) -> dict[str, Dataset]:
        """Return the records by the stem of their file."""
        return load_named(self.paths, self.columns, model)


@dataclass(frozen=True)
class Grid:
    """The values that a study combines."""

    orders: tuple[int, ...] = option(
        default="1,2", show_default=True, callback=separated(_read_count), metavar="K,...", help="Relaxation orders."
    )
    methods: tuple[str, ...] = option(
        default="auto",
        show_default=True,
        callback=separated(_read_method),
        metavar="M,...",
        help=f"Methods: {', '.join(method_names())}.",
    )
    noise_bounds: tuple[NoiseBound, ...] = option(
        default="1.2x",
        show_default=True,
        callback=separated(_read_bound),
        metavar="D|1.2x,...",
        help="Noise bounds of the output in its unit, or factors times the largest least noise bound of the records.",
    )
    samples: tuple[int, ...] | None = option(
        callback=separated(_read_count), metavar="N,...", help="Numbers of first samples to use. [default: all]"
    )
    solver: str = option(**SOLVER)

    @property
    def settings(self) -> dict[str, str]:
        """Return the options for the end of the report."""
        bounds = (f"{b.value:g}{' x least noise bound' if b.relative else ''}" for b in self.noise_bounds)
        return {
            "orders": ", ".join(map(str, self.orders)),
            "methods": ", ".join(self.methods),
            "noise bounds": ", ".join(bounds),
            "samples": "all" if self.samples is None else ", ".join(map(str, self.samples)),
            "solver": self.solver,
        }


@dataclass(frozen=True)
class Run:
    """Where the cells are computed, and where their outcomes are kept."""

    workers: int | None = option(
        type=click.IntRange(min=1), metavar="N", help="Number of processes on this machine. [default: 1]"
    )
    dask: str | None = option(metavar="ADDRESS", help="Run on the Dask cluster of the scheduler at this address.")
    folder: str | None = option(type=FOLDER, metavar="DIR", help="Save each outcome in this new folder.")
    resume: str | None = option(type=FOLDER, metavar="DIR", help="Continue the study that is saved in this folder.")

    def __post_init__(self) -> None:
        if self.workers is not None and self.dask is not None:
            raise click.UsageError("--workers runs on this machine, --dask on a cluster: give one of them")
        if self.folder is not None and self.resume is not None:
            raise click.UsageError("--folder begins a study, --resume continues one: give one of them")

    @property
    def cluster(self) -> AbstractContextManager[Executor | None]:
        """Return the executor of the Dask cluster, as a context; None where there is no cluster."""
        return nullcontext() if self.dask is None else dask_executor(self.dask)

    @property
    def advice(self) -> str:
        """Return how an interrupted study is continued."""
        kept = self.folder or self.resume
        return f"continue with --resume {kept}" if kept else "with --folder DIR a study can be resumed"


@click.command(cls=Command)
@takes(files=Records, problem=Problem, grid=Grid, run=Run)
@writes("json", "report")
@click.pass_context
def study(context: click.Context, files: Records, problem: Problem, grid: Grid, run: Run, outputs: Outputs) -> None:
    """Compute certified intervals for every combination of orders, methods and noise bounds.

    DATA are the records (CSV files). Options with commas take several values.
    """
    given = load_model(problem.model)
    records = files.load(given)
    together(records)  # the report shows the records as one data set: refuse records that differ before the work
    problems = {name: load_problem(given, problem, record, grid.solver) for name, record in records.items()}
    model, fixed = next(iter(problems.values()))
    with run.cluster as executor, Progress() as progress:
        bounds = _absolute(grid, problems, records, progress)
        found = order_study(
            model,
            records,
            [{**fixed, **dict.fromkeys(noisy_outputs(model), bound)} for bound in bounds],
            orders=grid.orders,
            methods=grid.methods,
            sample_sizes=grid.samples,
            solver=grid.solver,
            workers=run.workers or 1,
            executor=executor,
            folder=run.folder or run.resume,
            resume=run.resume is not None,
            progress=progress,
        )
    publish(outputs, "study", found, lambda path, asked: write_report(found, path, settings=asked), grid.settings)
    if found.interrupted:
        click.echo(f"interrupted: all printed bounds are proven; {run.advice}", err=True)
        context.exit(INTERRUPTED)


def _absolute(
    grid: Grid, problems: dict[str, tuple[Model, dict[str, float]]], records: dict[str, Dataset], progress: Progress
) -> list[float]:
    """Return the bounds in the output's unit; a factor multiplies the largest of the records' least noise bounds."""
    least = 0.0
    if any(bound.relative for bound in grid.noise_bounds):
        for name, (model, fixed) in problems.items():
            enclosure = error_bound(model, records[name], fixed, solver=grid.solver, progress=progress)
            if enclosure.reason is Reason.INTERRUPTED:
                raise click.Abort
            least = max(least, enclosure.upper)
    # Four digits, so that a resumed study finds the same number.
    return [float(round_up(b.value * least, 4)) if b.relative else b.value for b in grid.noise_bounds]
