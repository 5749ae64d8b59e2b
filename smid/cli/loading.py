"""Read the files that the user names, and check that they fit together before any solve."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import click

from relaxations.solvers.interface import check_solver
from smid.cli.options import Columns, EstimateColumns, Problem, Reading, Record
from smid.data import Dataset
from smid.data.columns import Table
from smid.data.gaps import MISSING
from smid.data.load import dataset_of_tables
from smid.data.read_arrays import read_mat, read_npz
from smid.data.read_csv import read_csv, read_text
from smid.feasible.feasible_set import check_data
from smid.fitting.binding import bind
from smid.identification.estimate import Estimate
from smid.identification.identify import EmptyFeasibleSetError
from smid.models import Model, ModelError, load_model
from smid.reports.load import load


def load_record(record: Record, channels: Sequence[str] | None = None) -> Dataset:
    """Return the samples that the user asked for."""
    return load_data(record.path, record.columns, channels, record.start, record.stop)


def load_estimate(path: str) -> Estimate:
    """Return the estimate in a file that ``smid identify --json`` wrote.

    Raises
    ------
    ModelError, DataError
        If the file holds no estimate, or one without values. The message names ``path``.
    """
    found = load(path)
    if isinstance(found, EmptyFeasibleSetError):
        raise ModelError(f"{path} says that no parameters explain the data: there is no model to simulate")
    if not isinstance(found, Estimate):
        raise ModelError(f"{path} holds a {type(found).__name__}: give a file that smid identify --json wrote")
    if not found.model.values:
        raise ModelError(
            f"{path} holds a model without values, because no parameter could be bounded: there is nothing to simulate"
        )
    return found


def load_for(estimate: Estimate, path: str, columns: EstimateColumns) -> Dataset:
    """Return a record at the sampling time of an estimate; its columns are those of the model, unless named."""
    own = Columns(
        columns.input or estimate.model.input_channels[0],
        columns.output or estimate.model.output_channels[0],
        columns.sampling_time or estimate.data.sampling_time,
        columns.time,
        columns.reading,
    )
    return load_data(path, own)


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
    if MISSING in data.source:
        click.echo(f"note: {data.source}", err=True)
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
