"""The free runs of a diagnosis that was loaded: its file holds models and numbers, but no samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from relaxations.algebra.arrays import Array, Mask
from smid.data import Dataset
from smid.diagnosis.parts import STARTING, free_run_of_new
from smid.models import Model


def test_part(ends: tuple[int, int] | None, length: int) -> Mask:
    """Return the samples of the test part, which ends with its experiment, shape (n,).

    Parameters
    ----------
    ends
        First and last sample; None where there is no test part.
    length
        Of the experiment.
    """
    return np.zeros(length, bool) if ends is None else np.arange(ends[1] + 1) >= ends[0]


def _begin(mask: Mask) -> int:
    """Return the number of samples before the test part of an experiment."""
    return int(mask.argmax()) if mask.any() else mask.size


def repeated_runs(model: Model, data: Dataset, test: Sequence[Mask], output: str) -> tuple[Array, ...]:
    """Return the free run of each experiment, shape (n,), from the states that fit its samples before the test best."""
    return tuple(
        free_run_of_new(model, data.with_experiments((run,)), _begin(mask))[output]
        for run, mask in zip(data.experiments, test, strict=True)
    )


def seen_part(
    data: Dataset, test: Sequence[Mask], simulated: Sequence[Array], output: str
) -> tuple[Dataset, tuple[Array, ...]]:
    """Return the record without the test part, and the errors of a free run there."""
    runs, errors = [], []
    for run, mask, free in zip(data.experiments, test, simulated, strict=True):
        stop = _begin(mask)
        if stop > (data.n_init or STARTING):  # otherwise the whole experiment is a test
            runs.append(replace(run, values={name: samples[:stop] for name, samples in run.values.items()}))
            errors.append((run.values[output] - free)[:stop])
    return data.with_experiments(runs), tuple(errors)
