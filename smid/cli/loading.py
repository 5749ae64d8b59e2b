"""Read what the user names on the command line, and refuse what does not fit together, before any solve."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import click

from relaxations.solvers.interface import check_solver
from smid.data import DataError, Dataset
from smid.data.read_csv import read_csv, read_text
from smid.feasible.feasible_set import check_data
from smid.fitting.binding import bind
from smid.models import Model, load_model


def load_data(
    path: str,
    input: str,
    output: str,
    sampling_time: float | None = None,
    time: str | None = None,
    start: int | None = None,
    stop: int | None = None,
    channels: Sequence[str] | None = None,
) -> Dataset:
    """Read a CSV file; its source keeps the first comment of the file and the samples that were taken.

    Parameters
    ----------
    input, output
        Columns, by the name in the file or by the plain name that equations give them.
    time
        Column of time stamps.
    start, stop
        Samples, as in a Python slice.
    channels
        Further columns to keep; every column of numbers when not given.

    Raises
    ------
    DataError
        As :meth:`smid.Dataset.from_csv`, or where no samples are left.
    """
    columns = read_csv(Path(path)).cells
    by_plain_name = {_plain(column): column for column in columns}
    input, output, *others = (
        name if name in columns else by_plain_name.get(name, name) for name in (input, output, *(channels or ()))
    )
    data = Dataset.from_csv(
        path, input, output, sampling_time, time, others=None if channels is None else list(dict.fromkeys(others))
    )
    data = data.rename({name: _plain(name) for name in data.names})
    comment = re.match(r"\s*#\s*(.+)", read_text(Path(path)))
    source = data.source
    if start is not None or stop is not None:
        count = data.n_samples
        if not range(count)[start:stop]:
            raise DataError(f"--start and --stop leave none of the {count} samples; give start < stop")
        data = data.crop(start, stop)
        source += f", samples {start or 0}:{count if stop is None else stop}"
    # The comment may say what the numbers alone do not: that a record is simulated, say.
    return replace(data, source=f"{source} ({comment[1].strip().rstrip('.')})" if comment else source)


def _plain(name: str) -> str:
    """Return a name that can stand in an equation: a column without header is called ``0``."""
    plain = re.sub(r"\W", "_", name)
    return plain if plain.isidentifier() else f"c{plain}"


def load_problem(
    model_path: str, data: Dataset, solver: str, input_noise_bound: float | None
) -> tuple[Model, dict[str, float]]:
    """Read the model, and check it against the data, the solver's name and the input's noise bound.

    Returns
    -------
    model : Model
        With the data's channel names.
    fixed : mapping channel -> float
        Noise bounds of the inputs.

    Raises
    ------
    ModelError, DataError, ProblemError, click.UsageError
    """
    model = bind(load_model(model_path), data)
    check_data(model, data)
    check_solver(solver)
    noisy = [m.channel for m in model.measurements if m.noise is not None and m.channel in model.input_channels]
    if noisy and input_noise_bound is None:
        raise click.UsageError(f"the input {noisy[0]} of this model is noisy: give --input-noise-bound")
    if not noisy and input_noise_bound is not None:
        raise click.UsageError("the input of this model is exact: leave out --input-noise-bound, or change the model")
    return model, {} if input_noise_bound is None else dict.fromkeys(noisy, input_noise_bound)
