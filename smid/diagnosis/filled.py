"""Missing outputs in a diagnosis: no fit, choice or gain counts them, and a filling keeps the evidence in one piece.

Evidence such as the correlation of an error with its past reads every sample of a record. There a missing sample has
the free run of the fitted base model, plus a line between the errors around the gap: an error that says nothing new.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from relaxations.algebra.arrays import Array, Mask
from smid.data import DataError, Dataset
from smid.data.gaps import bridged, missing_samples
from smid.diagnosis.parts import Parts

LEAST = 30  # samples


def without_missing(masks: Sequence[Mask], data: Dataset, channels: Sequence[str]) -> tuple[Mask, ...]:
    """Return masks of samples without those at which one of the channels is missing."""
    return tuple(mask & ~missing_samples(run, channels) for mask, run in zip(masks, data.experiments, strict=True))


def counted(parts: Parts, data: Dataset, channels: Sequence[str]) -> Parts:
    """Return the parts of a record without the missing samples of its test part.

    DataError if what is left of a part is too short to judge by.
    """
    test = without_missing(parts.test, data, channels)
    there = [np.ones(run.n_samples, dtype=bool) for run in parts.seen.experiments]
    sizes = {"test": test, "seen": without_missing(there, parts.seen, channels)}
    for name, masks in sizes.items():
        count = sum(int(mask.sum()) for mask in masks)
        if count < LEAST:
            raise DataError(
                f"the {name} part has {count} samples of {', '.join(channels)}, {LEAST} are needed: "
                "take another share in test, or other experiments"
            )
    return replace(parts, test=test)


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
