"""``smid identify``: parameter intervals, central model and validation, from a CSV file and a model file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import click
import numpy as np

from relaxations.deadline import time_limit
from relaxations.errors import UserError
from relaxations.search.enclosure import Reason
from smid.cli.console import EMPTY, INTERRUPTED, Command, Progress
from smid.cli.loading import load_others, load_problem, load_record, noisy_outputs, stated_bounds
from smid.cli.options import (
    POSITIVE,
    NoiseBound,
    Problem,
    Record,
    Solve,
    option,
    read_noise_bounds,
    seconds_option,
    takes,
)
from smid.cli.outputs import Outputs, writes
from smid.cli.verbose import log_error_bound, log_estimate, verbose_option
from smid.data import Dataset
from smid.identification.error_bound import ErrorBound, error_bound
from smid.identification.estimate import Estimate
from smid.identification.identify import EmptyFeasibleSetError
from smid.identification.identify import identify as identify_model
from smid.models import Model, load_model
from smid.reports import report as write_report
from smid.reports.documents import empty_document, identify_document
from smid.reports.estimate_page import empty_report
from smid.validation import Validation, validate

# Just above the least noise bound the intervals are narrow for any data: the feasible set shrinks to a point there.
DEFAULT = NoiseBound(1.2, True)


@dataclass(frozen=True)
class Accuracy:
    """When the computation of intervals stops."""

    tolerance: float = option(
        type=POSITIVE,
        default=1e-4,
        show_default=True,
        help="Stop when each gap is below this share of its interval's width.",
    )
    rounds: int = option(type=click.IntRange(min=1), default=10, show_default=True, help="Largest number of rounds.")
    nodes: int = option(
        type=click.IntRange(min=0),
        default=0,
        show_default=True,
        help="Branch where a gap is left, with at most this number of relaxations for each bound.",
    )
    windows: bool = option(
        "--windows/--all-samples",
        default=True,
        show_default="windows",
        help="Prove the intervals of a long record on the windows that hold their ends, or on all samples.",
    )
    outliers: int = option(
        type=click.IntRange(min=0),
        default=0,
        show_default=True,
        metavar="Q",
        help="The intervals hold if at most so many samples of each output break the noise bound.",
    )


@dataclass(frozen=True)
class Task:
    """All that an identification needs."""

    model: Model
    data: Dataset
    input_bounds: dict[str, float]
    asked: dict[str, NoiseBound]
    solve: Solve
    accuracy: Accuracy

    @property
    def settings(self) -> dict[str, str]:
        """Return the options for the end of the report."""
        return {
            "noise bound": ", ".join(dict.fromkeys(map(str, self.asked.values()))),
            "method": self.solve.method,
            "order": "usual" if self.solve.order is None else str(self.solve.order),
            "solver": self.solve.solver,
            "tolerance": f"{self.accuracy.tolerance:g}",
            "largest number of rounds": str(self.accuracy.rounds),
            "largest number of branching nodes": str(self.accuracy.nodes),
        }

    @property
    def relative(self) -> str | None:
        """Return the output whose bound is a factor times the least one."""
        return next((channel for channel, bound in self.asked.items() if bound.relative), None)

    @property
    def known(self) -> dict[str, float]:
        """Return the bounds that are numbers."""
        return self.input_bounds | {c: bound.value for c, bound in self.asked.items() if not bound.relative}

    def least_bound(self, progress: Progress) -> ErrorBound:
        """Return the enclosure of the least noise bound."""
        found = error_bound(self.model, self.data, self.known, **vars(self.solve), progress=progress)
        log_error_bound(found)
        return found

    def intervals(self, bounds: dict[str, float], certificate: str | None, progress: Progress) -> Estimate:
        """Return the certified intervals for the noise bounds."""
        how = {**vars(self.solve), **vars(self.accuracy)}
        return identify_model(self.model, self.data, bounds, **how, progress=progress, certificate=certificate)


noise_bound_option = click.option(
    "--noise-bound",
    callback=read_noise_bounds,
    metavar="D|1.2x|Y=D,...",
    help="Noise bound of the output in its unit, or a factor times the least noise bound. With several outputs: one "
    "number for all, or one for each, as in level=0.01,pressure=1.2x. [default: 1.2x]",
)


@click.command(cls=Command)
@takes(record=Record, problem=Problem)
@noise_bound_option
@takes(solve=Solve, accuracy=Accuracy)
@seconds_option
@click.option("--validate", "others", multiple=True, metavar="CSV", help="Another record to simulate; repeatable.")
@writes("json", "report", "certificate")
@verbose_option
@click.pass_context
def identify(
    context: click.Context,
    record: Record,
    problem: Problem,
    noise_bound: tuple[NoiseBound, ...] | None,
    solve: Solve,
    accuracy: Accuracy,
    seconds: float,
    others: tuple[str, ...],
    outputs: Outputs,
) -> None:
    """Compute certified parameter intervals of a model from a record.

    DATA is the record (a CSV file).
    """
    task = load_task(record, problem, noise_bound, solve, accuracy)
    records = load_others(others, record.columns, task.model, task.data)
    with time_limit(seconds), Progress() as progress:
        estimate, least = proven_intervals(context, task, origin_of_bound(noise_bound), outputs, progress)
    _publish(outputs, estimate, least, _validations(estimate, records), task.settings)
    if estimate.reason is Reason.INTERRUPTED:
        click.echo("interrupted: all printed bounds are proven", err=True)
        context.exit(INTERRUPTED)


def load_task(
    record: Record, problem: Problem, noise_bound: tuple[NoiseBound, ...] | None, solve: Solve, accuracy: Accuracy
) -> Task:
    """Read the model and the record, and what bounds were asked for."""
    given = load_model(problem.model)
    data = load_record(record, given)
    model, input_bounds = load_problem(given, problem, data, solve.solver)
    asked = stated_bounds("--noise-bound", noisy_outputs(model), noise_bound or (DEFAULT,))
    if accuracy.outliers and any(bound.relative for bound in asked.values()):
        raise click.UsageError("--outliers needs --noise-bound as a number: the least bound reaches every outlier")
    return Task(model, data, input_bounds, asked, solve, accuracy)


def proven_intervals(
    context: click.Context, task: Task, origin: str, outputs: Outputs, progress: Progress
) -> tuple[Estimate, ErrorBound | None]:
    """Return the estimate, and the least noise bound where a factor of it was asked for; exit where there is none."""
    least, bounds = None, task.known
    # A relative noise bound needs the least noise bound first.
    if task.relative is not None:
        least = task.least_bound(progress)
        bounds[task.relative] = task.asked[task.relative].value * least.upper
    if least is not None and (least.reason is Reason.INTERRUPTED or not np.isfinite(least.upper)):
        outputs.say(least)
        click.echo("ended early: the least noise bound above is proven; there are no intervals yet", err=True)
        context.exit(INTERRUPTED)
    try:
        estimate = task.intervals(bounds, outputs.certificate, progress)
    except EmptyFeasibleSetError as proof:
        _publish_empty(outputs, proof, least, task)
        context.exit(EMPTY)
    if least is not None:
        outputs.say(least)
        outputs.say(_bound_used(task, least, origin))
    log_estimate(estimate)
    return estimate, least


def origin_of_bound(noise_bound: tuple[NoiseBound, ...] | None) -> str:
    """Return where the noise bound comes from, in words."""
    return "from --noise-bound" if noise_bound else "the default"


def _bound_used(task: Task, least: ErrorBound, origin: str) -> str:
    """Return the sentence on the noise bound that was used, and where it comes from."""
    factor = task.asked[least.channel].value
    product = f"{factor:g} x {least.upper:.6g} = {factor * least.upper:.6g} {least.unit}".rstrip()
    return f"noise bound used: {product} ({origin})"


def _validations(estimate: Estimate, records: Sequence[Dataset]) -> list[Validation]:
    """Simulate the central model over other records; warn of each record on which it diverges."""
    runs = []
    for record in () if estimate.unbounded else records:
        try:
            runs.append(validate(estimate, record, estimate.noise_bound))
        except UserError as error:
            click.echo(f"warning: no validation on {record.source}: {error}", err=True)
    return runs


def _publish(
    outputs: Outputs, estimate: Estimate, least: ErrorBound | None, runs: Sequence[Validation], settings: dict[str, str]
) -> None:
    """Print the estimate and write the files that the user asked for."""
    outputs.say(estimate)
    for run in runs:
        outputs.say(f"\nvalidation on {run.data.source}\n{run}")
    outputs.write(identify_document(estimate, least, runs))
    outputs.write_report(lambda path: write_report(estimate, path, least, runs, settings=settings))
    outputs.say_certificate()


def _publish_empty(outputs: Outputs, proof: EmptyFeasibleSetError, least: ErrorBound | None, task: Task) -> None:
    """Print the proof that no parameters explain the data, and write the files that the user asked for."""
    outputs.say(proof)
    outputs.say_certificate()
    outputs.write(empty_document(proof, least))
    outputs.write_report(lambda path: empty_report(path, proof, task.model, task.data, least, settings=task.settings))
