"""``smid phases``: error bound, certified intervals and validation of one record, in one report."""

from __future__ import annotations

import math
from dataclasses import dataclass

import click
import numpy as np

from relaxations.deadline import time_limit
from smid.cli.console import EMPTY, Command, Progress
from smid.cli.loading import load_others, load_record
from smid.cli.options import FILE, NoiseBound, Record, option, read_noise_bound, seconds_option, takes
from smid.cli.outputs import Outputs, writes
from smid.data import Dataset
from smid.feasible.feasible_set import check_data
from smid.fitting.binding import bind_whole
from smid.identification.identify import EmptyFeasibleSetError
from smid.models import Hammerstein, Model, OutputError, load_model
from smid.reports.documents import study_document
from smid.reports.estimate_page import empty_report
from smid.reports.formats import write_page
from smid.reports.phases_page import phases_page
from smid.study.phases import FACTOR
from smid.study.phases import phases as identify_in_phases


def _read_powers(context: click.Context, parameter: click.Parameter, text: str) -> tuple[int, ...]:
    """Return the powers in a text such as ``5,4,3``."""
    try:
        return tuple(int(part) for part in text.split(","))
    except ValueError:
        raise click.BadParameter(f"{text!r} is no list of powers: write it as 5,4,3", context, parameter) from None


@dataclass(frozen=True)
class Chosen:
    """The model: a file, or the orders of a linear or Hammerstein model with one input and one output."""

    model: str | None = option(type=FILE, metavar="TOML", help="Model file, in place of the options below.")
    poles: int = option(type=click.IntRange(min=0), default=1, show_default=True, help="Number of poles.")
    zeros: int = option(type=click.IntRange(min=0), default=0, show_default=True, help="Degree of the numerator.")
    delay: int = option(type=click.IntRange(min=0), default=1, show_default=True, help="Samples from input to output.")
    powers: tuple[int, ...] = option(
        callback=_read_powers,
        default="1",
        show_default=True,
        metavar="P,...",
        help="Powers of the input in a static polynomial before the poles (Hammerstein); 1 is a linear model.",
    )
    offset: bool = option(is_flag=True, help="Add a constant to the output of a linear model.")

    def of(self, data: Dataset) -> Model:
        """Return the stable model for the channels of the data; a usage error if the data have other channels."""
        if len(data.inputs) != 1 or len(data.outputs) != 1:
            raise click.UsageError("the options describe one input and one output: give one of each, or --model")
        if self.powers == (1,):
            return OutputError(
                self.poles,
                self.zeros,
                self.delay,
                input=data.input,
                output=data.output,
                offset=self.offset,
                stable=True,
            )
        if self.offset:
            raise click.UsageError("--offset belongs to a linear model: add 0 to --powers")
        # A power of ten that brings the input to ordinary size.
        largest = float(np.nanmax(np.abs(data.stacked(data.input)))) or 1.0
        scale = 10.0 ** -round(math.log10(largest))
        return Hammerstein(
            self.poles,
            self.powers,
            self.zeros,
            self.delay,
            input=data.input,
            output=data.output,
            input_scale=scale,
            stable=True,
        )


@click.command(cls=Command)
@takes(record=Record, chosen=Chosen)
@click.option(
    "--noise-bound",
    callback=read_noise_bound,
    metavar="D|1.2x",
    default=f"{FACTOR:g}x",
    show_default=True,
    help="Noise bound of the output in its unit, or a factor times the least noise bound.",
)
@click.option("--validate", "others", multiple=True, metavar="CSV", help="Another record to simulate; repeatable.")
@seconds_option
@writes("json", "report")
@click.pass_context
def phases(
    context: click.Context,
    record: Record,
    chosen: Chosen,
    noise_bound: NoiseBound,
    others: tuple[str, ...],
    seconds: float,
    outputs: Outputs,
) -> None:
    """Identify a model in three phases: error bound, certified intervals, validation on other records.

    DATA is the record (a CSV file). Irregular time stamps are interpolated to a uniform grid, and the other records to
    the same grid.
    """
    given = None if chosen.model is None else load_model(chosen.model)
    data = load_record(record, given)
    model = bind_whole(chosen.of(data) if given is None else given, data)
    check_data(model, data)
    records = load_others(others, record.columns, model, data)
    asked = {"factor": noise_bound.value} if noise_bound.relative else {"noise_bound": noise_bound.value}
    settings = {"noise bound": str(noise_bound), "other records": ", ".join(others) or "none"}
    try:
        with time_limit(seconds), Progress() as progress:
            found = identify_in_phases(model, data, records, **asked, progress=progress)
    except EmptyFeasibleSetError as proof:
        outputs.say(proof)
        outputs.write(study_document("phases", {"empty": proof.to_dict()}))
        empty = proof
        outputs.write_report(lambda path: empty_report(path, empty, model, data, settings=settings))
        context.exit(EMPTY)
    outputs.say(found)
    outputs.write(study_document("phases", found.to_dict()))
    outputs.write_report(lambda path: write_page(phases_page(found, settings), path))
