"""The data set: uniformly sampled experiments over shared channels, with the roles of the channels."""

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from smid.data import condition, edit
from smid.data.channel import Channel, name_hint
from smid.data.columns import Missing, Names
from smid.data.errors import DataError
from smid.data.experiment import Experiment
from smid.data.gaps import split_at_gaps, split_note, without_gaps
from smid.data.listing import channel_table, notes
from smid.data.normalise import Normalisation, NormalisationMethod
from smid.data.resample import Resampling
from smid.data.validate import positive, validate
from smid.display.result import Part, Result, optional, plain

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.figure import Figure

Paths = str | Path | Sequence[str | Path]

MOST_DRAWN = 10_000
"""Largest number of samples for which a notebook shows the figure: more take too long."""


@dataclass(frozen=True)
class Dataset(Result):
    """Measured experiments that share channels, roles and sampling time.

    Parameters
    ----------
    experiments
        The runs; each holds every channel.
    channels
        A channel without a role (a temperature, for example) is allowed.
    inputs, outputs
        Names of the channels in these roles.
    sampling_time
        In seconds.
    n_init
        Warm-up samples at the start of every experiment, left out of all metrics.
    resampling
        One entry per experiment if time stamps were read, otherwise empty.
    source
        Origin of the data, for reports.
    normalisation
        The offsets and scales that were applied.
    checksum
        SHA-256 of names, samples and sampling time, in hexadecimal; computed.

    Raises
    ------
    DataError
        If the entries are not consistent, a sample is infinite, or one of a channel that is no output is missing.

    Examples
    --------
    >>> data = Dataset.from_arrays(input=[0, 1, 1, 1], output=[0, 0, 0.5, 0.75], sampling_time=0.1)
    >>> print(data)
    Dataset: 1 experiment, 4 samples, sampling time 0.1 s
    channel  unit  role    min   max    mean
    input          input     0     1    0.75
    output         output    0  0.75  0.3125
    """

    experiments: tuple[Experiment, ...]
    channels: tuple[Channel, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    sampling_time: float
    n_init: int = 0
    resampling: tuple[Resampling, ...] = ()
    source: str = ""
    normalisation: Normalisation | None = None
    checksum: str = field(init=False)

    def __post_init__(self) -> None:
        validate(self)
        object.__setattr__(self, "checksum", _checksum(self))

    # Readers construct data sets, so an import at the top would be circular.

    @classmethod
    def from_arrays(
        cls,
        *,
        input: ArrayLike | Mapping[str, ArrayLike],
        output: ArrayLike | Mapping[str, ArrayLike],
        sampling_time: float,
        units: Mapping[str, str] | None = None,
        name: str = "experiment",
        **others: ArrayLike,
    ) -> Self:
        """Make a data set of one experiment, which starts at time 0, from arrays.

        Parameters
        ----------
        input, output
            Shape (N,). An array is named "input" or "output"; a mapping gives the names. NaN is a missing sample: of an
            output it constrains nothing, and at one of any other channel the record is split.
        sampling_time
            In seconds.
        units
            By channel.
        name
            Of the experiment.
        **others
            Shape (N,). Further channels by name.

        Examples
        --------
        >>> data = Dataset.from_arrays(input={"u": [0, 1]}, output={"y": [0, 2]}, sampling_time=1, T=[20, 21])
        >>> data.names
        ('u', 'y', 'T')
        """
        by_role = [
            dict(given) if isinstance(given, Mapping) else {role: given}
            for role, given in (("input", input), ("output", output))
        ]
        values: dict[str, Any] = {}
        for group in (*by_role, others):
            for channel, array in group.items():
                if channel in values:
                    raise DataError(f"channel {channel!r} occurs 2 times; give each a name of its own")
                values[channel] = array
        for channel in units or {}:
            if channel not in values:
                raise DataError(
                    f"a unit is given for {channel!r}, which is not a channel; {name_hint(channel, values)}"
                )
        whole = Experiment(name, values)
        driving = [channel for channel in values if channel not in by_role[1]]
        interval = positive(sampling_time)
        runs = split_at_gaps(whole, interval, driving)
        return cls(
            experiments=runs,
            channels=tuple(Channel(channel, (units or {}).get(channel, "")) for channel in values),
            inputs=tuple(by_role[0]),
            outputs=tuple(by_role[1]),
            sampling_time=interval,
            source=split_note([whole], runs, driving).strip(" ()"),
        )

    @staticmethod
    def from_file(
        path: Paths,
        input: Names,
        output: Names,
        sampling_time: float | None = None,
        time: str | None = None,
        units: Mapping[str, str] | None = None,
        delimiter: str | None = None,
        others: Names | None = None,
        decimal: str | None = None,
        missing: Missing = (),
        encoding: str | None = None,
    ) -> "Dataset":
        r"""Read files of columns: one experiment per file, named by the stem of the file.

        The suffix says how a file is read: ``.xlsx`` an Excel workbook with one sheet, ``.parquet``, ``.npz``, ``.mat``
        a MATLAB file up to version 7, and any other as text.

        Parameters
        ----------
        path
            Of text, separator and header are detected, also below lines of titles; units come from headers such as
            `pressure [bar]`, or from a row of units below the header. Columns of a matrix `u` of a NumPy or MATLAB file
            are named `u0`, `u1`, ...; arrays of other lengths and structures are left out. `source` holds the first
            comment of a text (`# ...`).
        input, output
            Columns of the inputs and outputs; without a header the columns are "0", "1", ...
        sampling_time
            In seconds. A file with time stamps is interpolated to it.
        time
            Column of time stamps; by default a column named `time`, `timestamp` or `datetime`, or the only one of
            dates. Numbers are in seconds, unless the header, `units` or a name such as `t_ms` say ns, us, ms, min, h
            or d. Dates, with or without time zone, and times of day become seconds since the first. Stamps
            that are not uniform are resampled linearly, at `sampling_time` or at their median interval; `resampling`
            records it.
        units
            By column; they replace the units of the header.
        delimiter
            The separator of a text: ",", ";", "\t" or " " (any blanks).
        others
            Further columns to keep; by default every column of numbers. `source` names the columns that were left out.
        decimal
            The sign before the decimals in a text or workbook, "." or ",". Needed where the numbers do not tell, as
            1,000 alone does not.
        missing
            Values that stand for a missing sample, such as -9999 or "Bad", beside empty cells and NaN; "none" says that
            the file has none. The experiment is split where a sample is missing, or a row, and nothing is interpolated
            there. Parts of fewer than 10 samples are left out.
        encoding
            Of a text, such as "cp437"; by default UTF-8, UTF-16, or Windows-1252 where the letters are Western.

        Raises
        ------
        DataError
            For a missing file or column, an option that the kind of file does not have, letters whose encoding is not
            clear, a cell that is not a number, unsorted or repeated time stamps, or if neither time stamps nor a
            sampling time are known; for an Excel or Parquet file if ``smid[excel]`` or ``smid[parquet]`` is missing.

        Examples
        --------
        >>> import tempfile
        >>> file = Path(tempfile.mkdtemp()) / "run.csv"
        >>> _ = file.write_text("time,current [A],pressure [bar]\n0.0,0,1\n0.1,1,2\n0.2,1,3\n")
        >>> data = Dataset.from_file(file, input="current", output="pressure")
        >>> data.sampling_time, data.channel("pressure").unit
        (0.1, 'bar')
        """
        from smid.data.load import dataset_of_tables
        from smid.data.read_file import read_file

        tables = [read_file(file, delimiter, decimal, encoding) for file in _paths(path)]
        return dataset_of_tables(tables, input, output, sampling_time, time, units, others, missing)

    @staticmethod
    def from_pandas(
        frame: "pandas.DataFrame",
        input: Names,
        output: Names,
        sampling_time: float | None = None,
        time: str | None = None,
        units: Mapping[str, str] | None = None,
        others: Names | None = None,
        name: str = "experiment",
        missing: Missing = (),
    ) -> "Dataset":
        """Read the columns of a pandas frame; the parameters are those of `from_file`.

        A named index counts as a column; dates become seconds since the first.
        """
        from smid.data.load import dataset_of_tables
        from smid.data.read_arrays import table_of_frame

        table = table_of_frame(frame, name)
        return dataset_of_tables([table], input, output, sampling_time, time, units, others, missing)

    @staticmethod
    def from_nonlinear_benchmarks(records: Any, sampling_time: float | None = None) -> "Dataset":
        """Read records that a loader of the package `nonlinear_benchmarks` returned.

        The channels are "u" and "y", or "u1", "u2", ... if there are several. `n_init` is the longest window that the
        benchmark allows for finding the state.

        Parameters
        ----------
        records
            Several records become experiments. Loaders return training and test records: read them one at a time.
        sampling_time
            In seconds, if the records do not state it.

        Raises
        ------
        DataError
            For anything else, and for records of different channels or sampling times.

        Examples
        --------
        >>> from types import SimpleNamespace
        >>> test = SimpleNamespace(
        ...     u=[0, 1, 1], y=[0, 0, 1], sampling_time=0.5, name="tanks", state_initialization_window_length=1
        ... )
        >>> data = Dataset.from_nonlinear_benchmarks(test)
        >>> data.names, data.n_init, data.experiments[0].name
        (('u', 'y'), 1, 'tanks')
        """
        from smid.data.read_nonlinear_benchmarks import read_nonlinear_benchmarks

        return read_nonlinear_benchmarks(records, sampling_time)

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of all channels."""
        return tuple(channel.name for channel in self.channels)

    @property
    def experiment_names(self) -> tuple[str, ...]:
        """Return the names of the experiments."""
        return tuple(run.name for run in self.experiments)

    @property
    def input(self) -> str:
        """Return the name of the single input; DataError if there are several."""
        return _only("input", self.inputs)

    @property
    def output(self) -> str:
        """Return the name of the single output; DataError if there are several."""
        return _only("output", self.outputs)

    @property
    def n_samples(self) -> int:
        """Return the number of samples of all experiments together."""
        return sum(run.n_samples for run in self.experiments)

    @property
    def missing(self) -> dict[str, int]:
        """Return for each channel how many of its samples are missing (NaN) in all experiments together."""
        return {name: int(np.isnan(self.stacked(name)).sum()) for name in self.names}

    def time(self, experiment: int = 0) -> NDArray[np.float64]:
        """Return the sampling instants of an experiment, shape (N,), in seconds."""
        run = self.experiments[experiment]
        return run.start_time + self.sampling_time * np.arange(run.n_samples, dtype=np.float64)

    def channel(self, name: str) -> Channel:
        """Return name and unit of a channel; DataError if there is none of this name."""
        for channel in self.channels:
            if channel.name == name:
                return channel
        raise DataError(f"no channel {name!r}; {name_hint(name, self.names)}")

    def role(self, name: str) -> str:
        """Return the role of a channel: "input", "output" or "" for neither."""
        self.channel(name)
        return "input" if name in self.inputs else "output" if name in self.outputs else ""

    def values(self, name: str, experiment: int = 0) -> NDArray[np.float64]:
        """Return the samples of a channel in one experiment, shape (N,), read-only, in the channel's unit."""
        self.channel(name)
        return self.experiments[experiment].values[name]

    def stacked(self, name: str) -> NDArray[np.float64]:
        """Return the samples of a channel in all experiments, one after the other."""
        self.channel(name)
        return np.concatenate([run.values[name] for run in self.experiments])

    def without_gaps(self) -> "Dataset":
        """Return the parts between missing samples as experiments, for methods that read every sample.

        Parts of fewer than 10 samples are left out; `source` says what was split.

        Raises
        ------
        DataError
            If no part is left.

        Examples
        --------
        >>> data = Dataset.from_arrays(input=range(30), output=[*range(15), np.nan, *range(14)], sampling_time=1)
        >>> [run.n_samples for run in data.without_gaps().experiments]
        [15, 14]
        """
        return without_gaps(self)

    merge = staticmethod(edit.merge)
    crop = edit.crop
    crop_time = edit.crop_time
    select = edit.select
    denormalise = edit.denormalise

    def split(self, fraction: float) -> "tuple[Dataset, Dataset]":
        """Split every experiment in time: the first `fraction` for identification, the rest for validation.

        Both data sets keep `n_init`, because each starts from an unknown state.

        Examples
        --------
        >>> data = Dataset.from_arrays(input=[0, 1, 2, 3], output=[0, 0, 1, 2], sampling_time=1)
        >>> identification, validation = data.split(0.75)
        >>> identification.n_samples, validation.time()
        (3, array([3.]))
        """
        return edit.split(self, fraction)

    def decimate(self, factor: int, antialias: bool = True, held: str | Sequence[str] = ()) -> "Dataset":
        """Lower the sampling rate by an integer factor.

        Parameters
        ----------
        factor
            Every `factor`-th sample is kept.
        antialias
            Filter every channel first with a zero-phase FIR low-pass. The noise bounds of the raw samples do not hold
            after the filter: the filter h turns ``|noise| <= D`` into ``D sum|h|``, and it extrapolates the ends of the
            record. False keeps the raw samples and their noise bounds.
        held
            Channels that act until the next sample, as the output of a digital controller does. Each kept sample is the
            mean of itself and the next ``factor - 1`` samples. Without the mean, the channel would act half a long
            sample late. A noise bound holds for the mean.

        Raises
        ------
        DataError
            If the factor is not an integer from 1 on, or a held channel is missing.

        Examples
        --------
        >>> data = Dataset.from_arrays(input=[0, 1, 2, 3], output=[0, 0, 1, 2], sampling_time=1)
        >>> data.decimate(2, antialias=False).values("input")
        array([0., 2.])
        >>> data.decimate(2, antialias=False, held=["input"]).values("input")
        array([0.5, 2.5])
        """
        return edit.decimate(self, factor, antialias, held)

    def normalise(self, method: NormalisationMethod | Normalisation = "unit") -> "Dataset":
        """Scale the channels to comparable ranges without units; `normalisation` records offsets and scales.

        Parameters
        ----------
        method
            "unit" maps each range onto [-1, 1], "share" onto [0, 1], "standard" gives mean 0 and standard deviation 1.
            The record of another data set applies the same maps, as validation data need it.

        Examples
        --------
        >>> data = Dataset.from_arrays(input=[0, 4], output=[1, 2], sampling_time=1)
        >>> data.normalise().values("input")
        array([-1.,  1.])
        """
        return edit.normalise(self, method)

    def detrend(self, kind: condition.Trend = "constant", channels: str | Sequence[str] | None = None) -> "Dataset":
        """Remove the mean, or the straight line of best fit, from each experiment.

        A nonlinear model needs the levels that this removes, and an offset in the model does the same for a linear one.
        Mean and line contain noise: a noise bound D of the raw samples becomes up to 2 D for the mean, and no bound
        that is worth using for the line.

        Parameters
        ----------
        kind
            "constant" for the mean, "linear" for the straight line.
        channels
            By default all inputs and outputs.

        Raises
        ------
        DataError
            For another kind, a missing channel, or normalised data.

        Examples
        --------
        >>> data = Dataset.from_arrays(input=[0, 2, 4], output=[1, 1, 4], sampling_time=1)
        >>> data.detrend().values("input")
        array([-2.,  0.,  2.])
        >>> data.detrend("linear", "output").source
        'straight line of each experiment removed from output'
        """
        return condition.detrend(self, kind, channels)

    def filter(
        self,
        above: float | None = None,
        below: float | None = None,
        order: int = 4,
        channels: str | Sequence[str] | None = None,
    ) -> "Dataset":
        """Keep a range of frequencies, by a Butterworth filter that runs forwards and backwards: without delay.

        **A noise bound of the raw samples does not hold after the filter.** The filter h turns ``|noise| <= D`` into
        ``D sum|h|``, and it extrapolates the ends of the record. So do not give the sensor's bound to `identify`,
        `error_bound` or `diagnose` with filtered data: their proofs would mean nothing. The filter looks ahead, so an
        output may move before its input. Filter inputs and outputs alike, or the model must contain the filter.

        Parameters
        ----------
        above, below
            Edges in Hz: `below` alone is a low-pass, `above` alone a high-pass, both a band-pass. An edge frequency
            keeps half of its amplitude.
        order
            Of one run of the filter.
        channels
            By default all inputs and outputs.

        Raises
        ------
        DataError
            For edges outside the frequencies of the record, a missing channel, normalised data, or an experiment that
            is too short.

        Examples
        --------
        >>> t = 0.01 * np.arange(1000)
        >>> slow, fast = np.sin(2 * np.pi * t), np.sin(2 * np.pi * 20 * t)
        >>> data = Dataset.from_arrays(input=slow + fast, output=fast, sampling_time=0.01)
        >>> float(np.abs(data.filter(below=5).values("input") - slow)[50:-50].max()) < 0.01
        True
        """
        return condition.filter(self, above, below, order, channels)

    def with_experiments(self, experiments: Sequence[Experiment]) -> "Dataset":
        """Return the same channels and roles with other experiments; resampling records are dropped."""
        return replace(self, experiments=tuple(experiments), resampling=())

    def with_n_init(self, n_init: int) -> "Dataset":
        """Return the same data with another number of warm-up samples."""
        return replace(self, n_init=n_init)

    def rename(self, names: Mapping[str, str]) -> "Dataset":
        """Give channels other names; a model can use only names that are identifiers.

        Parameters
        ----------
        names
            New name for each old one; other channels keep theirs.

        Raises
        ------
        DataError
            If a channel is missing.

        Examples
        --------
        >>> data = Dataset.from_arrays(input={"0": [0, 1]}, output={"1": [0, 2]}, sampling_time=1)
        >>> data.rename({"0": "u", "1": "y"}).names
        ('u', 'y')
        """
        return edit.rename(self, names)

    def plot(self) -> "Figure":
        """Draw every channel over time with its unit, outputs on top."""
        from smid.data.plot import plot

        return plot(self)

    def to_dict(self) -> dict[str, Any]:
        """Return plain numbers, strings, lists and dictionaries; `from_dict` reads them."""
        return {
            "experiments": [
                {
                    "name": run.name,
                    "start_time": run.start_time,
                    "values": {name: plain(run.values[name]) for name in self.names},
                }
                for run in self.experiments
            ],
            "channels": [{"name": channel.name, "unit": channel.unit} for channel in self.channels],
            "inputs": list(self.inputs),
            "outputs": list(self.outputs),
            "sampling_time": self.sampling_time,
            "n_init": self.n_init,
            "resampling": [record.to_dict() for record in self.resampling],
            "source": self.source,
            "normalisation": None if self.normalisation is None else self.normalisation.to_dict(),
            "checksum": self.checksum,
        }

    @classmethod
    def from_dict(cls, record: Mapping[str, Any]) -> Self:
        """Return the data set of a dictionary from `to_dict`; DataError if the checksum does not fit."""
        given = record["normalisation"]
        dataset = cls(
            experiments=tuple(Experiment(**run) for run in record["experiments"]),
            channels=tuple(Channel(**channel) for channel in record["channels"]),
            inputs=tuple(record["inputs"]),
            outputs=tuple(record["outputs"]),
            sampling_time=record["sampling_time"],
            n_init=record["n_init"],
            resampling=tuple(Resampling(**entry) for entry in record["resampling"]),
            source=record["source"],
            normalisation=None if given is None else Normalisation(**given),
        )
        if dataset.checksum != record["checksum"]:
            raise DataError("the numbers do not fit their checksum; write the record again with to_dict")
        return dataset

    def to_pandas(self) -> "pandas.DataFrame":
        """Return a frame of one column per channel, with the index `time` in seconds.

        Several experiments have an index of two levels, `experiment` and `time`.
        """
        import pandas as pd

        frames = [
            pd.DataFrame({name: run.values[name] for name in self.names}, index=pd.Index(self.time(k), name="time"))
            for k, run in enumerate(self.experiments)
        ]
        names = [run.name for run in self.experiments]
        return frames[0] if len(frames) == 1 else pd.concat(frames, keys=names, names=["experiment"])

    def to_xarray(self) -> "xarray.Dataset":
        """Return a variable per channel over `time` in seconds, and over `experiment` if there are several.

        Shorter experiments end with NaN. Units are attributes.

        Raises
        ------
        ImportError
            If xarray is not installed.

        Examples
        --------
        >>> data = Dataset.from_arrays(input={"u": [0, 1]}, output={"y": [0, 2]}, sampling_time=0.5, units={"y": "bar"})
        >>> float(data.to_xarray().y.sel(time=0.5)), data.to_xarray().y.units
        (2.0, 'bar')
        """
        optional("xarray", "to_xarray")
        found = self.to_pandas().to_xarray()
        for name, unit in (("time", "s"), *((channel.name, channel.unit) for channel in self.channels)):
            found[name].attrs["units"] = unit
        return found

    def _content(self) -> Iterator[Part]:
        yield channel_table(self)
        yield from notes(self)

    def _picture(self) -> "Figure | None":
        if self.n_samples > MOST_DRAWN:
            return None
        from smid.display.style import WIDTH, style

        with style():
            figure = self.plot()
            figure.set_size_inches(WIDTH, 0.6 + 1.3 * len(figure.axes))
        return figure

    def __repr__(self) -> str:
        return f"<{channel_table(self).caption}>"  # short, because other results print it


def check_dataset(data: object) -> None:
    """Refuse data that are no data set, and name the function that makes one of them; TypeError.

    Examples
    --------
    >>> check_dataset(([0, 1], [0, 2]))
    Traceback (most recent call last):
        ...
    TypeError: the data are a tuple, not a Dataset: make one by Dataset.from_arrays(input=..., output=..., \
sampling_time=...)
    """
    if not isinstance(data, Dataset):
        getattr(data, "experiments", None)  # of a result that was loaded: its own error names the cure
        kind = type(data).__name__
        how = {"DataFrame": "from_pandas(frame, ", "str": "from_file(path, "}.get(kind, "from_arrays(")
        raise TypeError(
            f"the data are a {kind}, not a Dataset: make one by Dataset.{how}input=..., output=..., sampling_time=...)"
        )


def _only(role: str, names: tuple[str, ...]) -> str:
    if len(names) > 1:
        raise DataError(f"there are {len(names)} {role}s ({', '.join(names)}); choose one from dataset.{role}s")
    return names[0]


def _paths(path: Paths) -> list[Path]:
    return [Path(path)] if isinstance(path, (str, Path)) else [Path(one) for one in path]


def _checksum(dataset: Dataset) -> str:
    # Lengths come before contents, so that different data sets give different bytes.
    digest = hashlib.sha256(np.float64(dataset.sampling_time).astype("<f8").tobytes())
    for run in dataset.experiments:
        for name in sorted(dataset.names):
            array = run.values[name]
            for label in (run.name, name):
                digest.update(f"{len(label.encode())}:".encode() + label.encode())
            digest.update(f"{array.size}:".encode() + array.astype("<f8").tobytes())
    return digest.hexdigest()
