"""``smid sensor train``: a virtual sensor of any record, chosen on samples that trained nothing."""

from __future__ import annotations

from dataclasses import dataclass

import click

from smid.cli.console import Command, Progress
from smid.cli.options import FILE, Columns, argument, group, option, takes
from smid.cli.outputs import Outputs, writes
from smid.cli.sensor.reading import load_records
from smid.cli.studies import publish
from smid.data import Dataset
from smid.models.parts import plain_name
from smid.reports import check_writable
from smid.reports.sensor_page import write_training
from smid.sensors import save_sensor, train_sensor
from smid.sensors.bounded import MARGIN
from smid.sensors.choose import STRUCTURES


@dataclass(frozen=True)
class Records:
    """The records of the three parts."""

    columns: Columns = group(Columns)
    paths: tuple[str, ...] = argument(nargs=-1, required=True, type=FILE, metavar="DATA...")
    temperature: str | None = option(metavar="T", help="Column of a temperature that changes curve and lag.")
    select: tuple[str, ...] = option(
        multiple=True,
        type=FILE,
        metavar="DATA",
        help="Record to choose the structure and the error bound; repeatable. [default: a part of each record]",
    )
    test: tuple[str, ...] = option(
        multiple=True,
        type=FILE,
        metavar="DATA",
        help="Record for the test, read after the choice; repeatable. [default: the last part of each record]",
    )

    def __post_init__(self) -> None:
        for flag, names in (("--input", self.columns.input), ("--output", self.columns.output)):
            if not names:
                raise click.UsageError(f"Missing option '{flag}'")
        if len(self.columns.output) > 1:
            raise click.UsageError("a sensor has one output: give --output once")

    def load(self, paths: tuple[str, ...]) -> Dataset | None:
        """Return records as one data set; None without any."""
        others = [] if self.temperature is None else [self.temperature]
        return load_records(paths, self.columns, others) if paths else None


@dataclass(frozen=True)
class Choice:
    """What is trained."""

    structure: tuple[str, ...] = option(
        multiple=True, type=click.Choice(STRUCTURES), help="Structure to try; repeatable. [default: all]"
    )
    seed: int = option(type=click.IntRange(min=0), default=1, show_default=True, help="Of splits and starts.")
    starts: int = option(
        type=click.IntRange(min=1), default=3, show_default=True, help="Random starts of each network."
    )
    margin: float = option(
        type=click.FloatRange(min=0),
        default=MARGIN,
        show_default=True,
        help="Share by which the error bound is widened.",
    )
    save: str = option(required=True, type=FILE, metavar="JSON", help="Write the sensor to this file.")


@click.command(cls=Command)
@takes(records=Records, choice=Choice)
@writes("json", "report")
def train(records: Records, choice: Choice, outputs: Outputs) -> None:
    """Train virtual sensors of a column, choose one, and test it.

    DATA are the records (CSV files) with the inputs and the measured output. Without --select and --test, the first
    60 % of each record train, the next 20 % choose, and the last 20 % test.
    """
    check_writable(choice.save)
    training = records.load(records.paths)
    assert training is not None
    with Progress() as progress:
        found = train_sensor(
            training,
            [plain_name(name) for name in records.columns.input],
            plain_name(records.columns.output[0]),
            temperature=None if records.temperature is None else plain_name(records.temperature),
            selection=records.load(records.select),
            test=records.load(records.test),
            structures=choice.structure or STRUCTURES,
            seed=choice.seed,
            starts=choice.starts,
            margin=choice.margin,
            progress=progress,
        )
    save_sensor(found.sensor, choice.save)
    publish(
        outputs,
        "sensor train",
        found,
        lambda path, asked: write_training(found, training, path, asked),
        {"seed": str(choice.seed), "starts": str(choice.starts), "margin": f"{choice.margin:g}"},
    )
    outputs.say(f"sensor: {choice.save}")
