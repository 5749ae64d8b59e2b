"""``smid sensor run``: a sensor over a record, sample by sample, as it runs with the plant."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import click
import numpy as np

from relaxations.algebra.arrays import Array
from smid.cli.console import INTERRUPTED, Command, Progress
from smid.cli.loading import read_table
from smid.cli.options import FILE, argument, group, option, takes
from smid.cli.outputs import Outputs, writes
from smid.cli.sensor.reading import SensorColumns, load_sensor
from smid.data import DataError
from smid.data.columns import Table
from smid.data.load import time_column, time_stamps, units_of
from smid.models.parts import plain_name
from smid.reports import check_writable, write_text
from smid.reports.documents import study_document
from smid.sensors import BoundedSensor, Estimate, Stream
from smid.sensors.sensor import trained


@dataclass(frozen=True)
class Ran:
    """The record, and where state and results are kept."""

    columns: SensorColumns = group(SensorColumns)
    path: str = argument(type=FILE, metavar="DATA")
    csv: str | None = option(type=FILE, metavar="F", help="Write time, output and interval of every sample.")
    state: str | None = option(type=FILE, metavar="JSON", help="Continue from the state that --save-state wrote.")
    save_state: str | None = option(type=FILE, metavar="JSON", help="Write the state after the last sample.")


@dataclass(frozen=True)
class Summary:
    """What a run gave."""

    output: str
    unit: str
    estimates: tuple[Estimate, ...]

    def __str__(self) -> str:
        said = [words for one in self.estimates for words in one.warnings]
        width = np.mean([one.upper - one.lower for one in self.estimates])
        bridged = sum(one.bridged for one in self.estimates)
        last = self.estimates[-1]
        lines = [
            f"{len(self.estimates)} estimates of {self.output}, mean width {width:.4g} {self.unit}".rstrip(),
            f"last: {last.position:.6g} in [{last.lower:.6g}, {last.upper:.6g}] at {last.time:g} s",
        ]
        if bridged:
            lines.append(f"{bridged} intervals are wider, because samples were lost")
        lines += said[:_SAID]
        if len(said) > _SAID:
            lines.append(f"and {len(said) - _SAID} more warnings")
        return "\n".join(lines)

    def to_dict(self) -> dict[str, object]:
        """Return plain data."""
        return {"output": self.output, "unit": self.unit, "estimates": [vars(one) for one in self.estimates]}


_SAID = 10


@click.command(cls=Command)
@click.argument("sensor", type=FILE)
@takes(ran=Ran)
@writes("json")
@click.pass_context
def run(context: click.Context, sensor: str, ran: Ran, outputs: Outputs) -> None:
    """Run a sensor over a record, sample by sample.

    SENSOR is a file that smid sensor train --save wrote; DATA is the record (a CSV file), which needs no measured
    output. Empty cells and missing rows are lost samples: they are bridged with a wider interval.
    """
    for path in (ran.csv, ran.save_state):
        if path is not None:
            check_writable(path)
    found = load_sensor(sensor)
    told = trained(found.trained_on, found)
    stream, rows = _begun(found, ran)
    estimates = list[Estimate]()
    interrupted = False
    with Progress() as progress:
        try:
            for time, samples in rows:
                estimates.append(stream.update(time, **samples))
                if len(estimates) % 100 == 0:
                    progress(f"{len(estimates)} samples, at {time:g} s")
        except KeyboardInterrupt:
            if not estimates:
                raise
            interrupted = True
    summary = Summary(told.output.name, told.output.unit, tuple(estimates))
    outputs.say(summary)
    outputs.write(study_document("sensor-run", summary.to_dict()))
    if ran.csv is not None:
        write_text(ran.csv, _csv(summary))
    if ran.save_state is not None:
        write_text(ran.save_state, json.dumps(stream.state) + "\n")
    if interrupted:
        click.echo(f"interrupted: what is written ends at {estimates[-1].time:g} s", err=True)
        context.exit(INTERRUPTED)


def _begun(found: BoundedSensor, ran: Ran) -> tuple[Stream, Iterator[tuple[float, dict[str, float]]]]:
    """Return the stream, and the times and samples of the record."""
    given, told = ran.columns, trained(found.trained_on, found)
    table = replace(read_table(Path(ran.path), given.reading), missing=given.reading.missing)
    interval = given.sampling_time or told.sampling_time
    values = {signal.name: table.numbers(_column(table, signal.name)) for signal in told.inputs}
    units = units_of(table, given.reading.units or {})
    stamps = time_column(table, given.time, interval)
    count = next(iter(values.values())).size
    times: Array = (
        np.arange(count, dtype=np.float64) * interval if stamps is None else time_stamps(table, stamps, units)
    )
    state = None if ran.state is None else _state(ran.state)
    if state is not None and stamps is None:
        times = times + float(state.get("time", 0.0)) + interval
    stated = {name: units.get(_column(table, name), "") for name in values}
    stream = found.stream(units={name: unit for name, unit in stated.items() if unit}, state=state)
    for name, unit in stated.items():
        signal = next(one for one in told.inputs if one.name == name)
        if words := signal.unchecked(unit):
            click.echo(f"warning: {words}", err=True)
    return stream, ((time, {name: float(x[k]) for name, x in values.items()}) for k, time in enumerate(times.tolist()))


def _column(table: Table, name: str) -> str:
    """Return a column by its name, or by its plain name."""
    return table.find(next((one for one in table.cells if plain_name(one) == name), name))


def _state(path: str) -> dict[str, float]:
    try:
        found = json.loads(Path(path).read_text(encoding="utf-8"))
    except json.JSONDecodeError as error:
        raise DataError(f"{path} is not valid JSON: {error}; give a file that --save-state wrote") from None
    if not isinstance(found, dict):
        raise DataError(f"{path} holds no state; give a file that --save-state wrote")
    return found


def _csv(summary: Summary) -> str:
    unit = f" [{summary.unit}]" * bool(summary.unit)
    head = ",".join(["time [s]", *(f"{name}{unit}" for name in (summary.output, "lower", "upper")), "bridged"])
    rows = (
        f"{one.time!r},{one.position!r},{one.lower!r},{one.upper!r},{int(one.bridged)}" for one in summary.estimates
    )
    return "\n".join([head, *rows]) + "\n"
