"""The printed form of a data set: a table of its channels, and its source."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from smid.display.table import Table

if TYPE_CHECKING:
    from smid.data.dataset import Dataset


def channel_table(dataset: "Dataset") -> Table:
    """Return unit, role, range and mean of each channel over all experiments."""
    rows = []
    for channel in dataset.channels:
        samples = dataset.stacked(channel.name)
        figures = (f"{x:.5g}" for x in (np.nanmin(samples), np.nanmax(samples), np.nanmean(samples)))
        rows.append((channel.name, channel.unit, dataset.role(channel.name), *figures))
    n_runs = len(dataset.experiments)
    parts = [
        f"{n_runs} experiment{'s' if n_runs > 1 else ''}",
        f"{dataset.n_samples} samples",
        f"sampling time {dataset.sampling_time:.6g} s",
    ]
    if dataset.n_init:
        parts.append(f"{dataset.n_init} warm-up samples each")
    header = ("channel", "unit", "role", "min", "max", "mean")
    return Table(f"Dataset: {', '.join(parts)}", header, tuple(rows), "lllrrr")


def notes(dataset: "Dataset") -> Iterator[str]:
    """Return the source of the samples and each processing step, a line each."""
    if dataset.source:
        yield f"source: {dataset.source}"
    yield from missing_notes(dataset)
    for run, record in zip(dataset.experiments, dataset.resampling, strict=False):
        if record.method != "none":
            yield f"{run.name}: {record}"
    if dataset.normalisation is not None:
        yield str(dataset.normalisation)


def missing_notes(dataset: "Dataset") -> Iterator[str]:
    """Return how many samples of each channel are missing, a line for each channel where some are."""
    for name, count in dataset.missing.items():
        if count:
            is_missing = "is missing; it constrains" if count == 1 else "are missing; they constrain"
            yield f"{count} of {dataset.n_samples} samples of {name} {is_missing} nothing"
