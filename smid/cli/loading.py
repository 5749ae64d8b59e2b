"""Read the files that the user names, and check that they fit together before any solve."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import click

from relaxations.solvers.interface import check_solver
from smid.cli.documents import read_estimate
from smid.cli.options import Columns, EstimateColumns, Problem, Reading, Record
from smid.data import Dataset
from smid.data.columns import Table
from smid.data.listing import missing_notes
from smid.data.load import dataset_of_tables
from smid.data.read_arrays import read_mat, read_npz
from smid.data.read_csv import read_csv, read_text
from smid.feasible.feasible_set import check_data
from smid.fitting.binding import bind
from smid.models import Model, load_model


def load_record(record: Record, channels: Sequence[str] | None = None) -> Dataset:
    """Return the samples that the user asked for."""
    return load_data(record.path, record.columns, channels, record.start, record.stop)


@dataclass(frozen=True)
class Identified:
    """A model that ``smid identify`` wrote, with the noise bounds and the sampling time of its record."""

    model: Model
    noise_bound: dict[str, float]
    sampling_time: float

    def load(self, path: str, columns: EstimateColumns) -> Dataset:
        """Return a record at the sampling time of the estimate; its columns are those of the model, unless named."""
        own = Columns(
            columns.input or self.model.input_channels[0],
            columns.output or self.model.output_channels[0],
            columns.sampling_time or self.sampling_time,
            columns.time,
            columns.reading,
        )
        return load_data(path, own)


def load_estimate(path: str) -> Identified:
    """Return the model of a file that ``smid identify --json`` wrote; ModelError names the path."""
    found = read_estimate(read_text(Path(path)), path)
    return Identified(Model.from_dict(found["model"]), found["noise_bound"], found["data"]["sampling_time"])


def load_data(
    path: str,
    columns: Columns,
    channels: Sequence[str] | None = None,
    start: int | None = None,
    stop: int | None = None,
) -> Dataset:
    """Return samples of a file of columns, and say on the terminal if some are missing.

    Their source names the samples and holds the first comment of the file.

    A column is given by its name in the file, or by the plain name that an equation can hold. None for ``channels``
    keeps every column of numbers. DataError as for :meth:`smid.Dataset.from_csv`, or if no sample is left.
    """
    table = read_table(Path(path), columns.reading)
    by_plain_name = {plain(name): name for name in table.cells}
    input, output, *others = (
        name if name in table.cells else by_plain_name.get(name, name)
        for name in (columns.input, columns.output, *(channels or ()))
    )
    kept = None if channels is None else list(dict.fromkeys(others))
    data = dataset_of_tables(
        [table],
        input,
        output,
        columns.sampling_time,
        columns.time,
        columns.reading.units,
        kept,
        columns.reading.missing,
        slice(start, stop),
    )
    data = data.rename({name: plain(name) for name in data.names})
    for note in (*([data.source] if "is split there" in data.source else ()), *missing_notes(data)):
        click.echo(f"note: {note}", err=True)
    # The comment may hold what the numbers cannot say, such as that the record is simulated.
    comment = re.match(r"\s*#\s*(.+)", read_text(Path(path))) if table.lines else None
    return replace(data, source=f"{data.source} ({comment[1].strip().rstrip('.')})" if comment else data.source)


def read_table(path: Path, reading: Reading) -> Table:
    """Return the columns of a text file, a NumPy archive (.npz) or a MATLAB file (.mat)."""
    other = {".npz": read_npz, ".mat": read_mat}.get(path.suffix.lower())
    return read_csv(path, reading.delimiter, reading.decimal) if other is None else other(path)


def plain(name: str) -> str:
    """Return a name that an equation can hold; a column without header is named ``c0``, for example."""
    plain = re.sub(r"\W", "_", name)
    return plain if plain.isidentifier() else f"c{plain}"


def load_problem(problem: Problem, data: Dataset, solver: str) -> tuple[Model, dict[str, float]]:
    """Return the model with the data's channel names, and the noise bounds of its inputs by channel.

    Raises
    ------
    ModelError, DataError, ProblemError, click.UsageError
        If the model, the data, the solver's name or the input's noise bound do not fit together.
    """
    model = bind(load_model(problem.model), data)
    check_data(model, data)
    check_solver(solver)
    noisy = [m.channel for m in model.measurements if m.noise is not None and m.channel in model.input_channels]
    if noisy and problem.input_noise_bound is None:
        raise click.UsageError(f"the input {noisy[0]} of this model is noisy: give --input-noise-bound")
    if not noisy and problem.input_noise_bound is not None:
        raise click.UsageError("the input of this model is exact: leave out --input-noise-bound, or change the model")
    return model, {} if problem.input_noise_bound is None else dict.fromkeys(noisy, problem.input_noise_bound)
