"""A recursive set over a record or a stream: intervals at every sample, and the certified changes of the plant.

Samples that are missing are skipped: the set stays, or grows by the drift, and the equations start anew behind the gap.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from smid.data import DataError, Dataset
from smid.display.result import Part, Tabular
from smid.display.table import Table
from smid.identification.estimate import round_down, round_up
from smid.recursive.first_set import steps_of
from smid.recursive.locate_change import locate_change
from smid.recursive.set_history import Change, SetHistory
from smid.recursive.set_membership import RecursiveSet

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Sample", "TrackedSet", "follow", "samples_of"]

UNKNOWN = 0.5
"""A parameter whose interval is at least this share of its first one is said to be unknown."""


@dataclass(frozen=True)
class Sample:
    """One instant: inputs and output in their units, NaN for a missing one, and its time in seconds."""

    time: float
    inputs: tuple[float, ...]
    output: float

    @property
    def missing(self) -> bool:
        """Tell whether a value is missing."""
        return bool(np.isnan([*self.inputs, self.output]).any())


@dataclass(frozen=True, eq=False, repr=False)
class TrackedSet(Tabular):
    """The result of a recursive set on a record.

    Parameters
    ----------
    data
        The samples, without those that are missing.
    estimator
        The set after the last sample.
    first
        Time of the first sample, in seconds.
    located
        The certified changes, each on the shortest stretch of samples that was found to prove it.

    Examples
    --------
    >>> from smid.recursive import Arx
    >>> u, y = [1.0, -1.0, -1.0, 1.0, 1.0], [0.0, 0.2, -0.04, -0.232, 0.0144]
    >>> data = Dataset.from_arrays(input=u, output=y, sampling_time=0.1)
    >>> estimator = RecursiveSet(Arx(), 0.01, {"b0": (-10.0, 10.0)})
    >>> found = TrackedSet.of(data, estimator, follow(estimator, samples_of(data)))
    >>> found.changes, bool(found.estimator.lower[1] < 0.2 < found.estimator.upper[1])
    ((), True)
    """

    data: Dataset
    estimator: RecursiveSet
    first: float
    located: tuple[Change, ...]

    @staticmethod
    def of(data: Dataset, estimator: RecursiveSet, samples: Sequence[Sample]) -> TrackedSet:
        """Return the result of `follow`, with the changes located."""
        inputs, output = np.array([s.inputs for s in samples]), np.array([s.output for s in samples])
        u, located = inputs[:, 0] if inputs.shape[1] == 1 else inputs, []
        for change in estimator.changes:
            stretch = slice(change.after - estimator.arx.max_lag, change.sample + 1)
            whole = not np.isnan(np.column_stack([inputs, output])[stretch]).any()
            located.append(locate_change(estimator, change, u, output) if whole else change)
        return TrackedSet(data, estimator, samples[0].time, tuple(located))

    @property
    def history(self) -> SetHistory:
        """Return the intervals and changes by sample; missing samples count."""
        return self.estimator.history

    def time(self, sample: int) -> float:
        """Return the time of a sample in seconds."""
        return self.first + sample * self.data.sampling_time

    @property
    def unknown(self) -> tuple[str, ...]:
        """Return the parameters of which the record says next to nothing."""
        ends = self.estimator.intervals
        first = self.estimator.anew().intervals
        return tuple(i.name for i, box in zip(ends, first, strict=True) if i.width > UNKNOWN * box.width)

    @property
    def table(self) -> Table:
        """Return the last intervals, rounded outwards."""
        rows = tuple(
            (i.name, round_down(i.lower, 6), round_up(i.upper, 6), f"{i.width:.3g}") for i in self.estimator.intervals
        )
        when = "present parameters" if self.estimator.drift else "parameters"
        caption = f"Certified intervals of the {when} at {self.time(len(self.history.lower) - 1):.6g} s."
        return Table(caption, ("parameter", "lower", "upper", "width"), rows, "lrrr")

    @property
    def changes(self) -> tuple[str, ...]:
        """Return a sentence for each certified change."""
        return tuple(
            f"Proven: the plant changed between {self.time(change.after):.6g} s and {self.time(change.sample):.6g} s "
            f"(samples {change.after} to {change.sample})."
            for change in self.located
        )

    @property
    def conclusion(self) -> str:
        """Return the result in a few sentences."""
        count = len(self.history.changes)
        drift = "that drift within the stated bound " if self.estimator.drift else "that are constant "
        found = (
            f"No change is proven: parameters {drift}may explain all samples."
            if not count
            else f"{count} change{'s are' if count > 1 else ' is'} proven: parameters {drift}do not explain all "
            "samples. The plant changed, or a noise exceeds its bound, or a first interval is too narrow."
        )
        if not self.unknown:
            return f"{found} The set holds {self.estimator.state}."
        return (
            f"{found} The record says next to nothing of {', '.join(self.unknown)}: the input has to move more, or the "
            "noise bound is too large."
        )

    def _content(self) -> Iterator[Part]:
        yield self.conclusion
        yield self.table
        yield from self.changes

    def _rows(self) -> Iterator[dict[str, Any]]:
        for row in self.history._rows():
            yield {"time": self.time(row["sample"]), **row}

    def plot(self) -> Figure:
        """Draw the intervals over time and the certified changes."""
        return self.history.plot(sampling_time=self.data.sampling_time)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data: settings, intervals of the last sample and of every sample, changes."""
        history, estimator = self.history, self.estimator
        return {
            "model": str(estimator.arx),
            "noise_bound": estimator.noise_bound,
            "input_noise_bound": np.broadcast_to(estimator.input_noise_bound, estimator.arx.inputs).tolist(),
            "drift": dict(zip(history.names, steps_of(estimator.arx, estimator.drift).tolist(), strict=True)),
            "state": estimator.state,
            "first_time": self.first,
            "sampling_time": self.data.sampling_time,
            "intervals": [{"name": i.name, "lower": i.lower, "upper": i.upper} for i in estimator.intervals],
            "changes": [{"after": change.after, "sample": change.sample} for change in history.changes],
            "history": {
                name: {"lower": low, "upper": high}
                for name, low, high in zip(
                    history.names, history.lower.T.tolist(), history.upper.T.tolist(), strict=True
                )
            },
        }


def samples_of(data: Dataset) -> Iterator[Sample]:
    """Yield the samples of a record, its runs one after the other, with a missing sample for each instant between them.

    Raises
    ------
    DataError
        If a run starts before the run before it ends.

    Examples
    --------
    >>> data = Dataset.from_arrays(input=[1.0, -1.0], output=[0.0, 0.2], sampling_time=0.1)
    >>> [sample.output for sample in samples_of(data)]
    [0.0, 0.2]
    """
    step, ended = data.sampling_time, -np.inf
    for e, run in enumerate(data.experiments):
        if run.start_time <= ended:
            raise DataError(
                f"the run {run.name} starts at {run.start_time:g} s, before {ended:g} s, where the run before it ends: "
                "give one run at a time"
            )
        empty = (float("nan"),) * len(data.inputs)
        between = 0 if e == 0 else round((run.start_time - ended) / step) - 1
        yield from (Sample(ended + (k + 1) * step, empty, float("nan")) for k in range(between))
        inputs = zip(*(data.values(name, e).tolist() for name in data.inputs), strict=True)
        output = data.values(data.output, e).tolist()
        for time, u, y in zip(data.time(e).tolist(), inputs, output, strict=True):
            yield Sample(time, u, y)
        ended = float(data.time(e)[-1])


def follow(
    estimator: RecursiveSet,
    samples: Iterable[Sample],
    *,
    every: int = 0,
    pieces: int = 64,
    show: Callable[[RecursiveSet, Sample], None] | None = None,
    ended: Callable[[DataError], None] | None = None,
) -> list[Sample]:
    """Update a set with samples, and return them; Ctrl-C while a sample is waited for ends the samples.

    Parameters
    ----------
    every
        Samples from one refinement to the next; zero refines once, after the last sample.
    pieces
        As `RecursiveSet.refine` takes it; zero refines nowhere.
    show
        Called after each sample.
    ended
        Called with the error of a sample after the first, which then ends the samples. By default it is raised.

    Raises
    ------
    DataError
        If a sample is refused, or there is none.

    Examples
    --------
    >>> from smid.recursive import Arx
    >>> w, samples = 0.0, []
    >>> for k, u in enumerate([1.0, -1.0, -1.0, 1.0, 1.0, -1.0] * 5):
    ...     samples.append(Sample(0.1 * k, (u,), w))
    ...     w = 0.8 * w + 0.2 * u
    >>> estimator = RecursiveSet(Arx(), 0.05, {"b0": (-10.0, 10.0)})
    >>> len(follow(estimator, samples)), estimator.state
    (30, 'all 30 samples; refined with sample 29')
    """
    taken: list[Sample] = []
    try:
        for sample in _until_interrupted(samples):
            if sample.missing:
                estimator.skip()
            else:
                estimator.update(sample.inputs, sample.output)
            taken.append(sample)
            if every and pieces and len(taken) % every == 0:
                estimator.refine(pieces)
            if show is not None:
                show(estimator, sample)
    except DataError as error:
        if ended is None or not taken:
            raise
        ended(error)
    if not taken:
        raise DataError("there is no sample to follow: check the record, or --start and --stop")
    if pieces and estimator.refined_at != len(taken) - 1:
        estimator.refine(pieces)
    return taken


def _until_interrupted(samples: Iterable[Sample]) -> Iterator[Sample]:
    """Yield samples until they end, or until Ctrl-C while the next one is waited for."""
    iterator, begun = iter(samples), False
    while True:
        try:
            sample = next(iterator)
        except StopIteration:
            return
        except KeyboardInterrupt:
            if begun:
                return
            raise
        begun = True
        yield sample
