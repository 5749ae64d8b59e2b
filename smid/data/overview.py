"""What was understood of a file, before any model: channels, units, sampling time, missing samples, ranges, faults."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data.channel import Channel
from smid.data.columns import Table as Columns
from smid.data.columns import is_number
from smid.data.errors import DataError
from smid.data.experiment import Experiment
from smid.data.gaps import missing_samples, stretches
from smid.data.load import on_grid, time_column, units_of
from smid.data.resample import Resampling
from smid.display.from_plain import fields_from_plain
from smid.display.result import Part, Tabular, plain
from smid.display.table import Table
from smid.models.parts import plain_name

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_GAPS = 5  # gaps in words; the others are counted
TALLEST = 12.0  # inches


@dataclass(frozen=True)
class ChannelRange:
    """The samples of a channel in numbers.

    Parameters
    ----------
    samples, missing
        Number of samples that are there, and that are missing.
    min, max, mean
        None if there is no sample.
    """

    channel: str
    unit: str
    samples: int
    missing: int
    min: float | None
    max: float | None
    mean: float | None

    @staticmethod
    def of(channel: Channel, samples: Array) -> "ChannelRange":
        """Return the range of samples, of which the missing ones are NaN."""
        there = samples[~np.isnan(samples)]
        figures = (float(there.min()), float(there.max()), float(there.mean())) if there.size else (None, None, None)
        return ChannelRange(channel.name, channel.unit, int(there.size), int(samples.size - there.size), *figures)


@dataclass(frozen=True)
class Gap:
    """A stretch in which some channel is missing: its first sample, counted from 0, and its length."""

    first: int
    samples: int


@dataclass(frozen=True, eq=False, repr=False)
class Overview(Tabular):
    """A file on its time grid, with its missing samples.

    Parameters
    ----------
    name
        Of the record.
    samples
        Instants of the time grid.
    sampling_time, start_time
        In seconds.
    notes
        The source, the time stamps, the gaps, the faults, the columns that were left out, and the names in model files,
        a sentence each.
    run
        A missing sample is NaN. None in an overview that was loaded: its file holds no samples.
    """

    name: str
    source: str
    samples: int
    sampling_time: float
    start_time: float
    channels: tuple[ChannelRange, ...]
    gaps: tuple[Gap, ...]
    notes: tuple[str, ...]
    run: Experiment | None

    @staticmethod
    def of(
        run: Experiment,
        channels: Sequence[Channel],
        sampling_time: float,
        resampling: Resampling | None,
        source: str,
        left_out: Mapping[str, str],
    ) -> "Overview":
        """Return the overview of a run, in which a missing sample is NaN.

        Parameters
        ----------
        resampling
            None if the file has no time stamps.
        left_out
            Column -> why it holds no samples.
        """
        gaps = tuple(Gap(first, stop - first) for first, stop in stretches(missing_samples(run, run.values)))
        ranges = tuple(ChannelRange.of(channel, run.values[channel.name]) for channel in channels)
        notes = [f"source: {source}"]
        if resampling is not None:
            notes.append(str(resampling))
        for gap in gaps[:MOST_GAPS]:
            begin = run.start_time + gap.first * sampling_time
            count = "1 sample is" if gap.samples == 1 else f"{gap.samples} samples are"
            notes.append(f"gap: {count} missing from t = {begin:.6g} s")
        if len(gaps) > MOST_GAPS:
            notes.append(f"gap: {len(gaps) - MOST_GAPS} more")
        notes += [f"fault: {r.channel} is constant" for r in ranges if r.min is not None and r.min == r.max]
        notes += [f"left out: {name}: {why}" for name, why in left_out.items()]
        plain = {r.channel: plain_name(r.channel) for r in ranges}
        notes += [f"in model files: {name} is {word}" for name, word in plain.items() if word != name]
        return Overview(run.name, source, run.n_samples, sampling_time, run.start_time, ranges, gaps, tuple(notes), run)

    def _rows(self) -> Iterator[dict[str, Any]]:
        return map(asdict, self.channels)

    @property
    def table(self) -> Table:
        """Return a table with one row for each channel."""
        rows = tuple(
            tuple("-" if v is None else f"{v:.5g}" if isinstance(v, float) else str(v) for v in row.values())
            for row in self._rows()
        )
        end = self.start_time + (self.samples - 1) * self.sampling_time
        caption = (
            f"{self.samples} samples, sampling time {self.sampling_time:.6g} s, "
            f"from t = {self.start_time:.6g} s to {end:.6g} s"
        )
        return Table(caption, ("channel", "unit", "samples", "missing", "min", "max", "mean"), rows, "llrrrrr")

    def _content(self) -> Iterator[Part]:
        yield self.table
        yield from self.notes

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, without the samples."""
        return {field.name: plain(getattr(self, field.name)) for field in fields(self) if field.name != "run"}

    @staticmethod
    def from_dict(content: Mapping[str, Any]) -> "Overview":
        """Return the overview that `to_dict` described, without the samples."""
        found: Overview = fields_from_plain(Overview, content, run=None)
        return found

    def plot(self) -> "Figure":
        """Draw every channel over time; a line ends where samples are missing."""
        if self.run is None:
            raise DataError(
                "the samples are not in the file of this overview: read the record again, as smid show does"
            )
        from matplotlib.figure import Figure

        from smid.display.style import WIDTH, style

        time = self.start_time + self.sampling_time * np.arange(self.samples)
        with style():
            figure = Figure(figsize=(WIDTH, min(0.6 + 1.3 * len(self.channels), TALLEST)), layout="constrained")
            axes = figure.subplots(len(self.channels), 1, sharex=True, squeeze=False)[:, 0]
            for axis, channel in zip(axes, self.channels, strict=True):
                axis.plot(time, self.run.values[channel.channel])
                axis.set_ylabel(str(Channel(channel.channel, channel.unit)))
                axis.grid(True, linewidth=0.4)
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
        As `Dataset.from_file`, and if no column holds numbers.

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
            cells = table.cells[name]
            is_text = not isinstance(cells, np.ndarray) and not any(map(is_number, cells))
            left_out[name] = (
                f"text, such as {next(filter(None, cells))!r}" if is_text else str(error).partition(": ")[2]
            )
            continue
        if np.isnan(samples).all():
            left_out[name] = "every cell is empty"
        else:
            values[name] = samples
    if not values:
        why = "".join(f"; {name}: {reason}" for name, reason in left_out.items())
        raise DataError(f"{table.origin}: no column holds numbers; check the delimiter and the header{why}")
    known = units_of(table, units or {})
    grid = on_grid([table], [values], [stamps], known, sampling_time)
    return Overview.of(
        Experiment(table.name, grid.values[0], grid.starts[0]),
        tuple(Channel(name, known.get(name, "")) for name in values),
        grid.interval,
        grid.records[0] if grid.records else None,
        table.source,
        left_out,
    )
