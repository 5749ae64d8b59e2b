"""Windows of a record: what is proven on a part of the samples holds for the whole."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

from relaxations.algebra.arrays import Index
from smid.data.edit import crop, slice_samples

if TYPE_CHECKING:
    from smid.data.dataset import Dataset


@dataclass(frozen=True)
class Window:
    """Samples ``first`` to ``last`` of one experiment, counted from its start."""

    experiment: int
    first: int
    last: int

    def __len__(self) -> int:
        return self.last - self.first + 1

    def without(self, others: Sequence[Window]) -> list[Window]:
        """Return the parts of this window that lie in none of the others."""
        first, left = self.first, []
        for other in sorted((w for w in others if w.experiment == self.experiment), key=lambda w: w.first):
            if first < other.first <= self.last:
                left.append(Window(self.experiment, first, other.first - 1))
            first = max(first, other.last + 1)
        return [*left, *([Window(self.experiment, first, self.last)] if first <= self.last else [])]

    def to_dict(self) -> dict[str, int]:
        """Return plain data."""
        return asdict(self)

    @staticmethod
    def from_dict(content: Mapping[str, int]) -> Window:
        """Return the window that `to_dict` described."""
        return Window(content["experiment"], content["first"], content["last"])

    def cut(self, data: Dataset, before: int = 0) -> Dataset:
        """Return these samples, with up to so many samples before them."""
        alone = data.with_experiments((data.experiments[self.experiment],)).with_n_init(0)
        return crop(alone, max(self.first - before, 0), self.last + 1)


def cut_all(data: Dataset, windows: Sequence[Window]) -> Dataset:
    """Return a data set in which each window is an experiment of its own, named by its samples."""
    runs = []
    for window in windows:
        run = slice_samples(
            data.experiments[window.experiment], range(window.first, window.last + 1), data.sampling_time
        )
        runs.append(type(run)(f"{run.name}[{window.first}:{window.last + 1}]", run.values, run.start_time))
    return data.with_experiments(runs).with_n_init(0)


def whole(data: Dataset) -> list[Window]:
    """Return the windows that are all of a record."""
    return [Window(e, 0, run.n_samples - 1) for e, run in enumerate(data.experiments)]


def part_of(data: Dataset, windows: Sequence[Window]) -> Dataset:
    """Return the windows of a record, as `cut_all` does; the record itself where they are all of it."""
    return data if list(windows) == whole(data) else cut_all(data, windows)


def windows_before(places: Index, length: int) -> tuple[Window, ...]:
    """Return windows that hold some samples, each with so many before it; those that meet are joined.

    Parameters
    ----------
    places
        Shape (n, 2). Experiment and sample.
    """
    found: list[Window] = []
    for e, k in sorted(set(map(tuple, places.tolist()))):
        first = max(k - length, 0)
        if found and found[-1].experiment == e and first <= found[-1].last + 1:
            found[-1] = Window(e, found[-1].first, k)
        else:
            found.append(Window(e, first, k))
    return tuple(found)
