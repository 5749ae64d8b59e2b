"""Missing samples: an experiment is split where one is missing, so that nothing is interpolated into a proof.

Each part starts from an unknown state, as every experiment does. The equations that read a missing sample are thereby
left out. The equations of the parts are some of those of the whole record, so an interval that holds for the parts
holds the parameters of the whole.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from smid.data.errors import DataError
from smid.data.experiment import Experiment

MISSING = "samples are missing"  # what the source of a data set says where an experiment was split
LEAST = 10  # samples; a shorter part carries next to nothing, and may be too short for a model


def missing_samples(experiment: Experiment) -> NDArray[np.bool_]:
    """Return at which instants some channel is missing (NaN), shape (N,)."""
    missing: NDArray[np.bool_] = np.any([np.isnan(array) for array in experiment.values.values()], axis=0)
    return missing


def stretches(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return where a mask holds without a break: first sample, and the first after it.

    Examples
    --------
    >>> stretches(np.array([True, True, False, True]))
    [(0, 2), (3, 4)]
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def split_at_gaps(experiment: Experiment, sampling_time: float) -> tuple[Experiment, ...]:
    """Return the parts without missing samples, numbered from 1; a part shorter than `LEAST` samples is left out.

    Raises
    ------
    DataError
        If no part is left.

    Examples
    --------
    >>> run = Experiment("run", {"y": [*range(12), np.nan, *range(10)]})
    >>> [(part.name, part.n_samples, part.start_time) for part in split_at_gaps(run, 0.5)]
    [('run_1', 12, 0.0), ('run_2', 10, 6.5)]
    """
    missing = missing_samples(experiment)
    if not missing.any():
        return (experiment,)
    kept = [(a, b) for a, b in stretches(~missing) if b - a >= LEAST]
    if not kept:
        k = int(np.flatnonzero(missing)[0])
        name = next(name for name, array in experiment.values.items() if np.isnan(array[k]))
        instant = experiment.start_time + k * sampling_time
        raise DataError(
            f"{int(missing.sum())} of {missing.size} samples of experiment {experiment.name!r} are missing, first "
            f"{name!r} at sample {k} (t = {instant:g} s), and nowhere {LEAST} in a row are there; "
            "correct the cells, or take another column"
        )
    return tuple(
        replace(
            experiment,
            name=f"{experiment.name}_{number}",
            values={name: array[a:b] for name, array in experiment.values.items()},
            start_time=experiment.start_time + a * sampling_time,
        )
        for number, (a, b) in enumerate(kept, 1)
    )
