"""Missing samples: NaN at an instant of a channel. A missing sample is no constraint; nothing is interpolated.

A missing *output* stays in its experiment, and each method leaves it out: its noise is free in a proof, and no error
is taken there by a fit or a score. Every other channel drives a model, so a record is split where a sample of it is
missing: each part starts from an unknown state, as every experiment does. The equations of the parts are some of those
of the whole record, so an interval that holds for the parts holds the parameters of the whole.
"""

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from smid.data.errors import DataError
from smid.data.experiment import Experiment

if TYPE_CHECKING:
    from smid.data.dataset import Dataset

LEAST = 10  # samples; a shorter part carries next to nothing, and may be too short for a model


def missing_samples(experiment: Experiment, channels: Collection[str]) -> NDArray[np.bool_]:
    """Return at which instants one of these channels is missing, shape (N,)."""
    missing = np.zeros(experiment.n_samples, dtype=bool)
    for name in channels:
        missing |= np.isnan(experiment.values[name])
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


def bridged(samples: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return samples with lines across the gaps, for what reads a sample but must not take it for a measured one.

    Examples
    --------
    >>> bridged(np.array([np.nan, 1.0, np.nan, 3.0]))
    array([1., 1., 2., 3.])
    """
    there = np.flatnonzero(~np.isnan(samples))
    return np.interp(np.arange(samples.size), there, samples[there]).astype(np.float64)


def split_at_gaps(experiment: Experiment, sampling_time: float, channels: Collection[str]) -> tuple[Experiment, ...]:
    """Return the parts in which these channels are complete, numbered from 1.

    A part of fewer than `LEAST` samples is left out, and one in which another channel is missing throughout.

    Raises
    ------
    DataError
        If no part is left.

    Examples
    --------
    >>> run = Experiment("run", {"u": [*range(12), np.nan, *range(10)]})
    >>> [(part.name, part.n_samples, part.start_time) for part in split_at_gaps(run, 0.5, ["u"])]
    [('run_1', 12, 0.0), ('run_2', 10, 6.5)]
    """
    missing = missing_samples(experiment, channels)
    if not missing.any():
        return (experiment,)
    long = [(a, b) for a, b in stretches(~missing) if b - a >= LEAST]
    kept = [(a, b) for a, b in long if not any(np.isnan(array[a:b]).all() for array in experiment.values.values())]
    if not kept:
        k = int(np.flatnonzero(missing)[0])
        name = next(name for name in channels if np.isnan(experiment.values[name][k]))
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


def split_note(wholes: Sequence[Experiment], parts: Sequence[Experiment], channels: Collection[str]) -> str:
    """Return what was split, for the source of a data set; empty where nothing was."""
    lost = sum(int(missing_samples(whole, channels).sum()) for whole in wholes)
    if not lost:
        return ""
    whole, kept = sum(run.n_samples for run in wholes), sum(part.n_samples for part in parts)
    short = (
        f"; {whole - lost - kept} samples in parts of fewer than {LEAST} are left out" if whole - lost > kept else ""
    )
    named = [name for name in channels if any(np.isnan(whole.values[name]).any() for whole in wholes)]
    return (
        f" ({lost} of {whole} samples of {', '.join(named)} are missing: the record is split there into {len(parts)} "
        f"experiments of {kept} samples, and nothing is interpolated{short})"
    )


def without_gaps(data: "Dataset") -> "Dataset":
    """Return the parts of a data set without missing samples, for methods that read every sample of every channel.

    The source of the result says what was split. DataError if no part is left.
    """
    parts = [split_at_gaps(run, data.sampling_time, data.names) for run in data.experiments]
    runs = tuple(part for own in parts for part in own)
    note = split_note(data.experiments, runs, data.names)
    if not note:
        return data
    records = tuple(record for record, own in zip(data.resampling, parts, strict=False) for _ in own)
    return replace(data, experiments=runs, resampling=records, source=data.source + note)


def require_complete(data: "Dataset", what: str) -> None:
    """Refuse missing samples, for methods that read every sample: DataError with the cure."""
    lost = next((name for name, count in data.missing.items() if count), None)
    if lost is not None:
        raise DataError(
            f"{what} reads every sample, and {data.missing[lost]} of {data.n_samples} samples of {lost!r} are missing; "
            "give data.without_gaps(), the parts between them"
        )
