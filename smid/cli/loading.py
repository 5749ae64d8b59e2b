"""Read the files that the user names, and check that they fit together before any solve."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import click
import numpy as np

from relaxations.solvers.interface import check_solver
from smid.cli.options import Columns, EstimateColumns, NoiseBound, Problem, Reading, Record
from smid.data import DataError, Dataset
from smid.data.columns import Table, is_number
from smid.data.listing import missing_notes
from smid.data.load import dataset_of_tables, time_column
from smid.data.read_file import read_file
from smid.data.units import in_units_of
from smid.diagnosis.evidence.faults import sample_faults
from smid.feasible.feasible_set import check_data
from smid.fitting.binding import bind, bind_whole
from smid.identification.estimate import Estimate
from smid.identification.identify import EmptyFeasibleSetError
from smid.models import Model, ModelError
from smid.models.parts import plain_name
from smid.reports.load import load
from smid.validation import ModelFit


def load_record(
    record: Record, model: Model | None, channels: Sequence[str] | None = None, table: Table | None = None
) -> Dataset:
    """Return the samples that the user asked for, and warn of those that look wrong before any long work."""
    data = load_data(record.path, record.columns, model, channels, record.start, record.stop, table)
    read = data.names if model is None else bind(model, data).channels
    for fault in sample_faults(data):
        if fault.severity == "warning" and fault.channel in ("", *read):
            click.echo(f"warning: {fault.sentence}", err=True)
    for name in data.outputs:
        if np.nanmin(data.stacked(name)) == np.nanmax(data.stacked(name)):
            click.echo(f"warning: {name} is constant: check that its sensor works", err=True)
    return data


def load_estimate(path: str) -> Estimate | ModelFit:
    """Return the estimate or the fit in a file that ``smid identify --json`` or ``smid fit --json`` wrote.

    Raises
    ------
    ModelError, DataError
        If the file holds neither, or one without values. The message names ``path``.
    """
    found = load(path)
    if isinstance(found, EmptyFeasibleSetError):
        raise ModelError(f"{path} says that no parameters explain the data: there is no model to simulate")
    if not isinstance(found, Estimate | ModelFit):
        raise ModelError(
            f"{path} holds a {type(found).__name__}: give a file that smid identify --json or smid fit --json wrote"
        )
    if not found.model.values:
        raise ModelError(
            f"{path} holds a model without values, because no parameter could be bounded: there is nothing to simulate"
        )
    return found


def load_for(estimate: Estimate | ModelFit, path: str, columns: EstimateColumns) -> Dataset:
    """Return a record at the sampling time of an estimate; its columns are those of the model, unless named."""
    interval = columns.sampling_time or estimate.data.sampling_time
    return load_data(path, replace(columns, sampling_time=interval), estimate.model)


def load_others(paths: Sequence[str], columns: Columns, model: Model, data: Dataset) -> list[Dataset]:
    """Return further records at the sampling time and in the units of the data; refuse one that does not fit."""
    columns = replace(columns, sampling_time=data.sampling_time)
    records = [in_units_of(load_data(path, columns, model), data) for path in paths]
    for other in records:
        check_data(bind(model, other), other)
    return records


def load_named(
    paths: Sequence[str], columns: Columns, model: Model | None = None, channels: Sequence[str] | None = None
) -> dict[str, Dataset]:
    """Return records by the stem of their file, in the units of the first."""
    records: dict[str, Dataset] = {}
    for path in paths:
        name = Path(path).stem
        if name in records:
            raise DataError(f"two records have the name {name!r}: rename one of the files")
        data = load_data(path, columns, model, channels)
        records[name] = in_units_of(data, next(iter(records.values()), data))
    return records


def load_data(
    path: str,
    columns: Columns,
    model: Model | None = None,
    channels: Sequence[str] | None = None,
    start: int | None = None,
    stop: int | None = None,
    table: Table | None = None,
) -> Dataset:
    """Return samples of a file of columns, and say on the terminal if some are missing.

    A column is given by its name in the file, or by the plain name that an equation can hold. Inputs and outputs that
    the user does not name are those of the model. None for ``channels`` keeps every column of numbers. ``table`` holds
    the columns if the file has been read. DataError as for
    :meth:`smid.Dataset.from_file`, or if no sample is left.
    """
    inputs = columns.input or (model.exogenous_channels if model else ())
    outputs = columns.output or (model.output_channels if model else ())
    for flag, names in (("--input", inputs), ("--output", outputs)):
        if not names and model is None:
            raise click.UsageError(f"Missing option '{flag}'")
    if table is None:
        table = read_table(Path(path), columns.reading)
    by_plain_name = {plain_name(name): name for name in table.cells}

    def in_file(names: Sequence[str]) -> list[str]:
        known = (name if name in table.cells else by_plain_name.get(name, name) for name in names)
        return list(dict.fromkeys(known))

    kept = None if channels is None else in_file(channels)
    data = dataset_of_tables(
        [table],
        in_file(inputs),
        in_file(outputs),
        columns.sampling_time,
        columns.time,
        columns.reading.units,
        kept,
        columns.reading.missing,
        slice(start, stop),
    )
    data = data.rename({name: plain_name(name) for name in data.names})
    for note in (*([data.source] if "is split there" in data.source else ()), *missing_notes(data)):
        click.echo(f"note: {note}", err=True)
    return data


def unread_columns(record: Record, table: Table, data: Dataset) -> list[str]:
    """Return the columns of numbers that are in the file and not in the data, by their plain names."""
    stamps = time_column(table, record.columns.time, record.columns.sampling_time)
    return [
        plain_name(name)
        for name, cells in table.cells.items()
        if plain_name(name) not in data.names and name != stamps and any(map(is_number, cells))
    ]


def read_table(path: Path, reading: Reading) -> Table:
    """Return the columns of a file."""
    return read_file(path, reading.delimiter, reading.decimal, reading.encoding)


def load_problem(model: Model, problem: Problem, data: Dataset, solver: str) -> tuple[Model, dict[str, float]]:
    """Return the model with the data's channel names, and the noise bounds of its inputs by channel.

    Raises
    ------
    ModelError, DataError, ProblemError, click.UsageError
        If the model, the data, the solver's name or the input's noise bound do not fit together.
    """
    model = bind_whole(model, data)
    check_data(model, data)
    check_solver(solver)
    noisy = _noisy(model, model.exogenous_channels)
    if noisy and problem.input_noise_bound is None:
        raise click.UsageError(f"the input {noisy[0]} of this model is noisy: give --input-noise-bound")
    if not noisy and problem.input_noise_bound is not None:
        raise click.UsageError("the input of this model is exact: leave out --input-noise-bound, or change the model")
    stated = stated_bounds("--input-noise-bound", noisy, problem.input_noise_bound or ())
    return model, {channel: bound.value for channel, bound in stated.items()}


def noisy_outputs(model: Model) -> list[str]:
    """Return the channels of the noisy outputs."""
    return _noisy(model, model.output_channels)


def _noisy(model: Model, channels: Sequence[str]) -> list[str]:
    return [m.channel for m in model.measurements if m.noise is not None and m.channel in channels]


def stated_bounds(flag: str, channels: Sequence[str], asked: Sequence[NoiseBound]) -> dict[str, NoiseBound]:
    """Return the noise bound of each channel; a usage error names a channel without one, or a bound without channel."""
    example = ",".join(f"{channel}=..." for channel in channels)
    by_channel: dict[str, NoiseBound] = {}
    for bound in asked:
        named = channels if bound.channel is None else [plain_name(bound.channel)]
        for channel in named:
            if channel not in channels:
                raise click.UsageError(f"{flag}: {channel!r} is none of {', '.join(channels)}: write {flag} {example}")
            if channel in by_channel:
                raise click.UsageError(f"{flag} gives two bounds of {channel!r}: leave out one")
            by_channel[channel] = bound
    missing = [channel for channel in channels if channel not in by_channel]
    if missing:
        raise click.UsageError(f"{flag} gives no bound of {missing[0]!r}: write {flag} {example}")
    if sum(bound.relative for bound in by_channel.values()) > 1:
        raise click.UsageError(
            f"the least noise bound is that of one channel: write {flag} {example}, at most one of them a factor"
        )
    return by_channel
