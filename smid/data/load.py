"""From columns to a data set: roles, units, time stamps."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from smid.data.channel import Channel, name_hint
from smid.data.columns import Missing, Names, Table, as_names, as_words, split_unit
from smid.data.dataset import Dataset
from smid.data.dates import is_day, is_time_of_day, read_dates
from smid.data.edit import slice_samples
from smid.data.errors import DataError
from smid.data.experiment import Experiment
from smid.data.gaps import split_at_gaps, split_note
from smid.data.resample import RELATIVE_TOLERANCE, Resampling, check_increasing, resample, uniform_interval
from smid.data.validate import positive

SECONDS_PER_UNIT: Mapping[str, float] = {
    **dict.fromkeys(("", "s", "sec", "seconds"), 1.0),
    **{"ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0, "d": 86400.0},
}
# Seconds since 1970 in the year 2096: larger stamps without a unit are not in seconds. The unit that would be right:
_LATEST = 4e9
_EPOCHS = ((1e14, "ms"), (1e17, "us"), (np.inf, "ns"))
# Days since 1900 (spreadsheets) and since the year 0 (MATLAB) of the years 1982 to 2064.
_DAYS = ((30_000, 60_000), (724_000, 754_000))
_TIME_NAMES = ("time", "timestamp", "datetime")


def time_column(table: Table, time: str | None, sampling_time: float | None) -> str | None:
    """Return the column of time stamps: the requested one, one named `time`, or the only one of dates."""
    if time is not None:
        return table.find(time)
    named = [name for name in table.cells if name.casefold() in _TIME_NAMES]
    dated = [name for name in table.cells if table.is_of_dates(name)]
    found = named or (dated if len(dated) == 1 else [])
    if not found and sampling_time is None:
        raise DataError(
            f"{table.origin}: neither a column of time stamps nor a sampling time is known; "
            f"give time=... ({name_hint('time', table.cells)}) or sampling_time=... in seconds"
        )
    return found[0] if found else None


def _other_columns(tables: Sequence[Table], taken: set[str]) -> tuple[list[str], list[str]]:
    """Return the further columns that hold numbers over the same rows in all tables, and the other columns."""
    kept: list[str] = []
    left_out: list[str] = []
    n_rows = [len(table.cells[next(name for name in taken if name in table.cells)]) for table in tables]
    for name in dict.fromkeys(name for table in tables for name in table.cells if name not in taken):
        try:
            usable = all(
                name in table.cells and _is_complete(table.numbers(name), rows)
                for table, rows in zip(tables, n_rows, strict=True)
            )
        # Not an error: nobody asked for this column. The data set's source names it as left out.
        except DataError:
            usable = False
        (kept if usable else left_out).append(name)
    return kept, left_out


def _is_complete(samples: NDArray[np.float64], rows: int) -> bool:
    return samples.size == rows and not np.isnan(samples).any()


def _time_unit(column: str, units: Mapping[str, str]) -> str:
    """Return the unit of time stamps: the known one, or that in a name such as `t_ms`; otherwise the empty string."""
    ending = column.rpartition("_")[2]
    return units.get(column) or (ending if ending in SECONDS_PER_UNIT and ending != column else "")


def _stamps(table: Table, column: str, unit: str) -> tuple[NDArray[np.float64], float]:
    """Return the time stamps of a table and the unit of their last printed digit, both in seconds."""
    if table.is_of_dates(column):
        dates = _dates(table, column)
        stamps = (dates - dates[0]) / np.timedelta64(1, "s")
        check_increasing(stamps, table.origin)
        return stamps, 0.0
    if unit not in SECONDS_PER_UNIT:
        raise DataError(
            f"{table.origin}: the time unit {unit!r} is not known; "
            f"give units={{{column!r}: 's'}} ({', '.join(filter(None, SECONDS_PER_UNIT))} are known)"
        )
    stamps = table.numbers(column)
    first = abs(stamps[0]) if stamps.size else 0.0
    if not unit and first > _LATEST:
        likely = next(name for latest, name in _EPOCHS if first < latest)
        raise DataError(
            f"{table.origin}: the time stamps in {column!r} begin at {stamps[0]:g}, which are no seconds; give their "
            f"unit in the header, as in '{column} [{likely}]', or units={{{column!r}: '{likely}'}}"
        )
    if not unit and any(low <= first <= high for low, high in _DAYS):
        raise DataError(
            f"{table.origin}: the time stamps in {column!r} begin at {stamps[0]:.9g}, which may be a date in days or a "
            f"time in seconds; give units={{{column!r}: 'd'}} or units={{{column!r}: 's'}}"
        )
    stamps = stamps * SECONDS_PER_UNIT[unit]
    check_increasing(stamps, table.origin)
    return stamps, table.resolution(column) * SECONDS_PER_UNIT[unit]


def time_stamps(table: Table, column: str, units: Mapping[str, str]) -> NDArray[np.float64]:
    """Return the time stamps of a table in seconds, as they are."""
    return _stamps(table, column, _time_unit(column, units))[0]


def _dates(table: Table, column: str) -> NDArray[np.datetime64]:
    """Return the dates of a column; times of day are joined with the only column of days."""
    cells = table.cells[column]
    if isinstance(cells, np.ndarray):
        return cells.astype("datetime64[ns]")
    days = [name for name, other in table.cells.items() if not isinstance(other, np.ndarray) and is_day(other[0])]
    if is_time_of_day(cells[0]) and len(days) == 1:
        cells = [f"{day} {clock}" for day, clock in zip(table.cells[days[0]], cells, strict=True)]
    elif is_day(cells[0]):
        clocks = [name for name, other in table.cells.items() if isinstance(other[0], str) and is_time_of_day(other[0])]
        if len(clocks) == 1:
            cells = [f"{day} {clock}" for day, clock in zip(cells, table.cells[clocks[0]], strict=True)]
    return read_dates(cells, f"{table.origin}: column {column!r}")


def _common_interval(stamped: Sequence[tuple[NDArray[np.float64], float]], tables: Sequence[Table]) -> float:
    intervals = []
    for stamps, resolution in stamped:
        uniform = uniform_interval(stamps, resolution)
        intervals.append(float(np.median(np.diff(stamps))) if uniform is None else uniform)
    if max(intervals) - min(intervals) > RELATIVE_TOLERANCE * min(intervals):
        listed = ", ".join(f"{table.name} {h:g} s" for table, h in zip(tables, intervals, strict=True))
        raise DataError(f"the files differ in sampling time ({listed}); give sampling_time=... for all of them")
    return intervals[0]


def units_of(table: Table, units: Mapping[str, str]) -> dict[str, str]:
    """Return the units of a table's header and those that the user gives; DataError for a unit of no column."""
    given = {table.find(split_unit(name)[0]): unit for name, unit in units.items()}
    return {**table.units, **given}


def dataset_of_tables(
    tables: Sequence[Table],
    input: Names,
    output: Names,
    sampling_time: float | None = None,
    time: str | None = None,
    units: Mapping[str, str] | None = None,
    others: Names | None = None,
    missing: Missing = (),
    samples: slice = slice(None),
) -> Dataset:
    """Return the data set of tables of columns, one table per experiment; see `Dataset.from_file`.

    Only ``samples`` of each table are taken, counted with those that are missing.

    Raises
    ------
    DataError
        For a missing column, a cell that is not a number, bad time stamps, no sampling time, or no sample left.
    """
    if not tables:
        raise DataError("no files were given; give at least one path")
    tables = [replace(table, missing=as_words(missing)) for table in tables]
    inputs = tuple(tables[0].find(name) for name in as_names(input))
    outputs = tuple(tables[0].find(name) for name in as_names(output))
    time_columns = [time_column(table, time, sampling_time) for table in tables]
    # Without a choice of further columns, keep every column of numbers.
    if others is None:
        kept, left_out = _other_columns(tables, {*inputs, *outputs, *filter(None, time_columns)})
    else:
        kept, left_out = [tables[0].find(name) for name in as_names(others)], []
    names = tuple(dict.fromkeys((*inputs, *outputs, *kept)))
    known_units = units_of(tables[0], units or {})
    values = [{name: table.numbers(table.find(name)) for name in names} for table in tables]
    grid = on_grid(tables, values, time_columns, known_units, sampling_time)
    source = ", ".join(table.source for table in tables)
    wholes = []
    for table, channels, start in zip(tables, grid.values, grid.starts, strict=True):
        whole = Experiment(table.name, channels, start)
        taken = range(whole.n_samples)[samples]
        if not taken:
            raise DataError(f"start and stop leave none of the {whole.n_samples} samples; give start < stop")
        wholes.append(slice_samples(whole, taken, grid.interval))
        if len(taken) < whole.n_samples:
            source += f", samples {taken.start}:{taken.stop}"
    driving = [name for name in names if name not in outputs]
    parts = [split_at_gaps(whole, grid.interval, driving) for whole in wholes]
    runs = tuple(run for part in parts for run in part)
    source += split_note(wholes, runs, driving)
    return Dataset(
        experiments=runs,
        channels=tuple(Channel(name, known_units.get(name, "")) for name in names),
        inputs=inputs,
        outputs=outputs,
        sampling_time=grid.interval,
        resampling=tuple(record for record, part in zip(grid.records, parts, strict=False) for _ in part),
        source=f"{source} (left out: {', '.join(left_out)})" if left_out else source,
    )


@dataclass(frozen=True)
class Grid:
    """Samples on a uniform time grid: one entry of values and starts for each experiment."""

    values: list[dict[str, NDArray[np.float64]]]
    starts: list[float]
    interval: float
    records: tuple[Resampling, ...]


def on_grid(
    tables: Sequence[Table],
    values: list[dict[str, NDArray[np.float64]]],
    time_columns: Sequence[str | None],
    units: Mapping[str, str],
    sampling_time: float | None,
) -> Grid:
    """Return the samples on a uniform grid: resampled where there are time stamps, else as they are."""
    if sampling_time is not None and not any(time_columns):
        return Grid(values, [0.0] * len(tables), positive(sampling_time), ())
    named = [column for column in time_columns if column is not None]
    if len(named) < len(tables):
        raise DataError("some files have a column of time stamps and some have none; name it with time=...")
    stamped = [_stamps(table, column, _time_unit(column, units)) for table, column in zip(tables, named, strict=True)]
    # A bad sample is refused before interpolation, which would spread it over its neighbours.
    for table, channels, (stamps, _) in zip(tables, values, stamped, strict=True):
        for name, array in channels.items():
            _check_before_interpolation(table, name, array, stamps)
    interval = _common_interval(stamped, tables) if sampling_time is None else positive(sampling_time)
    resampled = [
        resample(stamps, channels, interval, resolution)
        for channels, (stamps, resolution) in zip(values, stamped, strict=True)
    ]
    return Grid(
        [channels for channels, _ in resampled],
        [float(stamps[0]) for stamps, _ in stamped],
        interval,
        tuple(record for _, record in resampled),
    )


def _check_before_interpolation(
    table: Table, name: str, array: NDArray[np.float64], stamps: NDArray[np.float64]
) -> None:
    if array.size != stamps.size:
        raise DataError(
            f"{table.origin}: column {name!r} has {array.size} samples but there are {stamps.size} stamps; "
            "cut them to the same instants"
        )
    bad = np.flatnonzero(np.isinf(array))
    if bad.size:
        k = int(bad[0])
        raise DataError(
            f"channel {name!r} of experiment {table.name!r} is {array[k]} at sample {k} "
            f"(t = {stamps[k]:g} s); correct it, or crop the record around it"
        )
