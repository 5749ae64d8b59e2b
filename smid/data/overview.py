"""What was understood of a file, before any model: channels, units, sampling time, missing samples, ranges, faults."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from smid.data.channel import Channel
from smid.data.columns import Table as Columns
from smid.data.errors import DataError
from smid.data.experiment import Experiment
from smid.data.gaps import missing_samples, stretches
from smid.data.load import on_grid, time_column, units_of
from smid.data.resample import Resampling
from smid.display.result import Part, Tabular
from smid.display.table import Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_GAPS = 5  # gaps in words; the others are counted
TALLEST = 12.0  # inches


@dataclass(frozen=True, eq=False, repr=False)
class Overview(Tabular):
    """A file on its time grid, with its missing samples.

    Parameters
    ----------
    run
        A missing sample is NaN.
    sampling_time
        In seconds.
    resampling
        None if the file has no time stamps.
    left_out
        Column -> why it holds no samples.
    """

    run: Experiment
    channels: tuple[Channel, ...]
    sampling_time: float
    resampling: Resampling | None
    source: str
    left_out: Mapping[str, str]

    @property
    def gaps(self) -> tuple[tuple[int, int], ...]:
        """Return the stretches in which some channel is missing: first sample, and the first after it."""
        return tuple(stretches(missing_samples(self.run, self.run.values)))

    def _rows(self) -> Iterator[dict[str, Any]]:
        for channel in self.channels:
            samples = self.run.values[channel.name]
            there = samples[~np.isnan(samples)]
            yield {
                "channel": channel.name,
                "unit": channel.unit,
                "samples": int(there.size),
                "missing": int(samples.size - there.size),
                "min": float(there.min()) if there.size else None,
                "max": float(there.max()) if there.size else None,
                "mean": float(there.mean()) if there.size else None,
            }

    def _notes(self) -> Iterator[str]:
        yield f"source: {self.source}"
        if self.resampling is not None:
            yield str(self.resampling)
        for first, stop in self.gaps[:MOST_GAPS]:
            begin = self.run.start_time + first * self.sampling_time
            count = "1 sample is" if stop - first == 1 else f"{stop - first} samples are"
            yield f"gap: {count} missing from t = {begin:.6g} s"
        if len(self.gaps) > MOST_GAPS:
            yield f"gap: {len(self.gaps) - MOST_GAPS} more"
        for row in self._rows():
            if row["min"] is not None and row["min"] == row["max"]:
                yield f"fault: {row['channel']} is constant"
        for name, why in self.left_out.items():
            yield f"left out: {name}: {why}"

    @property
    def table(self) -> Table:
        """Return a table with one row for each channel."""
        rows = tuple(
            tuple("-" if v is None else f"{v:.5g}" if isinstance(v, float) else str(v) for v in row.values())
            for row in self._rows()
        )
        end = self.run.start_time + (self.run.n_samples - 1) * self.sampling_time
        caption = (
            f"{self.run.n_samples} samples, sampling time {self.sampling_time:.6g} s, "
            f"from t = {self.run.start_time:.6g} s to {end:.6g} s"
        )
        return Table(caption, ("channel", "unit", "samples", "missing", "min", "max", "mean"), rows, "llrrrrr")

    def _content(self) -> Iterator[Part]:
        yield self.table
        yield from self._notes()

    @property
    def notes(self) -> tuple[str, ...]:
        """Return the source, the gaps, the faults and the columns that were left out, a sentence each."""
        return tuple(self._notes())

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, without the samples."""
        return {
            "source": self.source,
            "samples": self.run.n_samples,
            "sampling_time": self.sampling_time,
            "start_time": self.run.start_time,
            "channels": list(self._rows()),
            "gaps": [{"first": first, "samples": stop - first} for first, stop in self.gaps],
            "notes": list(self.notes),
        }

    def plot(self) -> "Figure":
        """Draw every channel over time; a line ends where samples are missing."""
        from matplotlib.figure import Figure

        time = self.run.start_time + self.sampling_time * np.arange(self.run.n_samples)
        figure = Figure(figsize=(8.0, min(1.0 + 1.5 * len(self.channels), TALLEST)), layout="constrained")
        axes = figure.subplots(len(self.channels), 1, sharex=True, squeeze=False)[:, 0]
        for axis, channel in zip(axes, self.channels, strict=True):
            axis.plot(time, self.run.values[channel.name], linewidth=0.9)
            axis.set_ylabel(str(channel))
            axis.grid(True, linewidth=0.4, alpha=0.5)
            axis.margins(x=0)
        axes[-1].set_xlabel("time [s]")
        return figure


def overview(
    table: Columns,
    columns: Sequence[str] = (),
    sampling_time: float | None = None,
    time: str | None = None,
    units: Mapping[str, str] | None = None,
) -> Overview:
    """Return what was understood of a table of columns.

    Parameters
    ----------
    columns
        The columns to keep; by default every column of numbers.

    Raises
    ------
    DataError
        As `Dataset.from_csv`, and if no column holds numbers.

    Examples
    --------
    >>> print(overview(Columns("run", "run.csv", {"time": ("0", "1", "3", "4"), "y": ("5", "", "6", "7")})))
    5 samples, sampling time 1 s, from t = 0 s to 4 s
    channel  unit  samples  missing  min  max  mean
    y                    3        2    5    7     6
    source: run.csv
    uniform time stamps: 4 samples, mean interval 1.33333 s, jitter 0 s max, 0 s rms
    gap: 2 samples are missing from t = 1 s
    """
    stamps = time_column(table, time, sampling_time)
    wanted = [table.find(name) for name in columns]
    values, left_out = {}, {}
    for name in wanted or [name for name in table.cells if name != stamps and not table.is_of_dates(name)]:
        try:
            samples = table.numbers(name)
        except DataError as error:
            if wanted:
                raise
            left_out[name] = str(error).partition(": ")[2]
            continue
        if np.isnan(samples).all():
            left_out[name] = "every cell is empty"
        else:
            values[name] = samples
    if not values:
        raise DataError(f"{table.origin}: no column holds numbers; check the delimiter and the header")
    known = units_of(table, units or {})
    grid = on_grid([table], [values], [stamps], known, sampling_time)
    return Overview(
        Experiment(table.name, grid.values[0], grid.starts[0]),
        tuple(Channel(name, known.get(name, "")) for name in values),
        grid.interval,
        grid.records[0] if grid.records else None,
        table.origin,
        left_out,
    )
