"""``smid sensor check``: a sensor beside the measured output of records."""

from __future__ import annotations

from dataclasses import dataclass

import click

from smid.cli.console import Command, Progress
from smid.cli.options import FILE, Columns, argument, group, option, takes
from smid.cli.outputs import Outputs, writes
from smid.cli.sensor.reading import SensorColumns, load_records, load_sensor
from smid.cli.studies import publish
from smid.reports.sensor_page import write_check
from smid.sensors import check_sensor
from smid.sensors.sensor import trained


@dataclass(frozen=True)
class Checked:
    """The records, and the samples that are lost."""

    columns: SensorColumns = group(SensorColumns)
    paths: tuple[str, ...] = argument(nargs=-1, required=True, type=FILE, metavar="DATA...")
    lose: float = option(
        type=click.FloatRange(min=0, max=1, max_open=True),
        default=0.0,
        show_default=True,
        help="Share of the samples of each channel that are lost at random.",
    )
    seed: int = option(type=click.IntRange(min=0), default=1, show_default=True, help="Of the samples that are lost.")


@click.command(cls=Command)
@click.argument("sensor", type=FILE)
@takes(checked=Checked)
@writes("json", "report")
def check(sensor: str, checked: Checked, outputs: Outputs) -> None:
    """Compare a sensor with the measured output of records: RMSE, share inside the interval, width.

    SENSOR is a file that smid sensor train --save wrote; DATA are the records (CSV files). A record with time stamps is
    resampled to the sampling time of the sensor.
    """
    found = load_sensor(sensor)
    told, given = trained(found.trained_on, found), checked.columns
    inputs = [signal.name for signal in told.inputs]
    interval = given.sampling_time or told.sampling_time
    columns = Columns(inputs, [told.output.name], interval, given.time, given.reading)
    data = load_records(checked.paths, columns, [])
    with Progress() as progress:
        result = check_sensor(found, data, lose=checked.lose, seed=checked.seed, progress=progress)
    settings = {"lose": f"{checked.lose:g}", "seed": str(checked.seed)}
    publish(outputs, "sensor check", result, lambda path, asked: write_check(result, path, asked), settings)
