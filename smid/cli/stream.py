"""Samples of a stream: lines of a table on standard input, read as they arrive."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from smid.data import DataError
from smid.data.columns import is_missing, split_unit
from smid.recursive.tracked_set import Sample

_LATE = 0.25
"""Largest deviation of a time stamp from the grid, as a share of the sampling time."""


@dataclass
class Stream:
    """The samples of a stream with one header line, and what is known of it once samples have come.

    Parameters
    ----------
    lines
        Comma-separated; lines that start with # are left out.
    inputs, output
        Names of columns.
    time
        Column of time stamps in seconds; a column of that name is taken if it is None.
    sampling_time
        In seconds; by default the first interval of the time stamps.
    """

    lines: Iterable[str]
    inputs: Sequence[str]
    output: str
    time: str | None
    sampling_time: float | None

    def __iter__(self) -> Iterator[Sample]:
        """Yield the samples, with a missing one for each instant that was left out.

        DataError if a column is missing, a cell is not a number, or time does not go forwards on the grid.
        """
        rows = enumerate(csv.reader(line for line in self.lines if not line.startswith("#")), 0)
        _, header = next(rows, (0, []))
        names = [split_unit(cell.strip())[0] for cell in header]
        stamped = self.time or ("time" if "time" in names else None)
        if stamped is None and self.sampling_time is None:
            raise DataError("the stream has no column 'time': give --time COL, or --sampling-time in seconds")
        places = {name: _place(name, names) for name in (*self.inputs, self.output, *([stamped] if stamped else []))}
        last: float | None = None
        for number, row in rows:
            if not row:
                continue
            values = {name: _number(row, place, name, number) for name, place in places.items()}
            time = values[stamped] if stamped else (0.0 if last is None else last + (self.sampling_time or 0.0))
            if last is not None:
                yield from self._between(last, time, number)
            yield Sample(time, tuple(values[name] for name in self.inputs), values[self.output])
            last = time

    def _between(self, last: float, time: float, number: int) -> Iterator[Sample]:
        """Check a time stamp, and yield the missing samples before it."""
        if not time > last:
            raise DataError(
                f"row {number} of the stream goes back in time, from {last:g} s to {time:g} s: sort the samples, or "
                "start smid track anew where the clock was set"
            )
        if self.sampling_time is None:
            self.sampling_time = time - last
        steps = (time - last) / self.sampling_time
        if abs(steps - round(steps)) > _LATE or round(steps) < 1:
            raise DataError(
                f"row {number} of the stream is {time - last:g} s after the last one, and the sampling time is "
                f"{self.sampling_time:g} s: a stream needs uniform samples; write it to a file, which is interpolated"
            )
        nothing = (math.nan,) * len(self.inputs)
        for k in range(1, round(steps)):
            yield Sample(last + k * self.sampling_time, nothing, math.nan)


def _place(name: str, names: Sequence[str]) -> int:
    if name not in names:
        raise DataError(f"the stream has no column {name!r}: its columns are {', '.join(names) or 'none'}")
    return names.index(name)


def _number(row: Sequence[str], place: int, name: str, number: int) -> float:
    cell = row[place].strip() if place < len(row) else ""
    if is_missing(cell):
        return math.nan
    try:
        return float(cell)
    except ValueError:
        raise DataError(f"row {number} of the stream: {name} is {cell!r}, not a number: leave the cell empty") from None
