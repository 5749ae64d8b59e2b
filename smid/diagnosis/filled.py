"""Missing outputs in a diagnosis: no fit, choice or gain counts them, and a filling keeps the evidence in one piece.

Evidence such as the correlation of an error with its past reads every sample of a record. There a missing sample has
the free run of the fitted base model, plus a line between the errors around the gap: an error that says nothing new.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from relaxations.algebra.arrays import Array, Mask
from smid.data import Dataset
from smid.data.gaps import bridged, missing_samples


def without_missing(masks: Sequence[Mask], data: Dataset, channels: Sequence[str]) -> tuple[Mask, ...]:
    """Return masks of samples without those at which one of the channels is missing."""
    return tuple(mask & ~missing_samples(run, channels) for mask, run in zip(masks, data.experiments, strict=True))


def filled(data: Dataset, free_runs: Sequence[Mapping[str, Array]]) -> Dataset:
    """Return a record with its missing outputs filled.

    Parameters
    ----------
    free_runs
        Per experiment, the output channels of the base model, shape (n,).

    Examples
    --------
    >>> data = Dataset.from_arrays(input={"u": [0, 1, 1]}, output={"y": [0.1, np.nan, 1.9]}, sampling_time=1)
    >>> filled(data, [{"y": np.array([0.0, 1.0, 2.0])}]).values("y")
    array([0.1, 1. , 1.9])
    """
    runs = []
    for run, free in zip(data.experiments, free_runs, strict=True):
        lines = {c: free[c] + bridged(x - free[c]) if c in free else bridged(x) for c, x in run.values.items()}
        runs.append(replace(run, values={c: np.where(np.isnan(x), lines[c], x) for c, x in run.values.items()}))
    return replace(data, experiments=tuple(runs))


def unfilled(data: Dataset, used: Sequence[Mask], output: str) -> Dataset:
    """Return a filled record with the samples of its output that do not count, after the warm-up, missing again."""
    runs = []
    for run, mask in zip(data.experiments, used, strict=True):
        kept = mask | (np.arange(run.n_samples) < data.n_init)
        runs.append(replace(run, values={**run.values, output: np.where(kept, run.values[output], np.nan)}))
    return replace(data, experiments=tuple(runs))
