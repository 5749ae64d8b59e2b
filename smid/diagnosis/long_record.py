"""Long records: what a search fits of them.

A search fits some thousand models, and more than some thousand samples make each fit slower without telling more about
what is missing. Two steps, each only as far as it is needed:

1. *Thinning.* A model in differential equations is the same at any sampling time. Where every output moves so slowly
   that a coarser grid shows it, the whole record is taken at that grid: inputs as means over its intervals, the others
   through a filter without phase.
2. *Windows.* Of what is still too long, the search is given windows that differ most in level and spread of the
   channels, the first with the largest spread. The chosen models are then fitted to the whole record without its test
   part, and the gain is measured on the whole test part.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from smid.data import Dataset, Experiment
from smid.data.edit import slice_samples
from smid.diagnosis.parts import Parts, split
from smid.fitting.problem import Fit, Fitting
from smid.models import Model

MOST_SAMPLES = 2500
_WINDOWS = 5
_LOST = 0.01  # of an output's standard deviation, at most, between the samples of a coarser grid
_LONG = 200


@dataclass(frozen=True, eq=False)
class Shortened:
    """A record as a diagnosis uses it.

    Parameters
    ----------
    data
        The record, on a coarser grid where it was thinned.
    parts
        Of `data`.
    searched
        What the search is given of the part that may be seen: all, or windows.
    said
        Sentences about what was done.
    """

    data: Dataset
    parts: Parts
    searched: Dataset
    said: tuple[str, ...]


def shorten(model: Model, data: Dataset, test: float | Sequence[str], *, bounded: bool) -> Shortened:
    """Return a record thinned and cut to windows, as far as its length needs it.

    Parameters
    ----------
    test
        As for :func:`smid.diagnose`.
    bounded
        Whether a noise bound has to hold for the samples that are left: then outputs are not filtered.

    Raises
    ------
    DataError
        As `smid.diagnosis.parts.split`.
    """
    parts, said = split(model, data, test), []
    factor = _factor(model, data, -(-_length(parts.seen) // MOST_SAMPLES), bounded)
    if factor > 1:
        data = _coarse(model, data, factor, bounded)
        parts = split(model, data, test)
        how = "as they are" if bounded else "through a filter without phase"
        said.append(
            f"The record is taken every {data.sampling_time:g} s, one sample of {factor}: inputs as means, outputs "
            f"{how}."
        )
    searched = windows(parts.seen, (*model.input_channels, *model.output_channels))
    if searched is not parts.seen:
        said.append(
            f"The search fits {len(searched.experiments)} windows with {_length(searched)} of {_length(parts.seen)} "
            "samples; what it finds is fitted to all of them."
        )
    return Shortened(data, parts, searched, tuple(said))


def _length(data: Dataset) -> int:
    return sum(run.n_samples for run in data.experiments)


def _coarse(model: Model, data: Dataset, factor: int, bounded: bool) -> Dataset:
    return data.decimate(factor, antialias=not bounded, held=model.input_channels)


def _factor(model: Model, data: Dataset, needed: int, bounded: bool) -> int:
    """Return how many samples one may stand for: so many as are needed, and as the outputs and the model allow."""
    for factor in range(needed, 1, -1) if _is_continuous(model) else ():
        coarse = _coarse(model, data, factor, bounded)
        if all(_shows(data, coarse, channel, factor) for channel in model.output_channels):
            return factor
    return 1


def _is_continuous(model: Model) -> bool:
    """Return whether the model has no memory but that of differential equations."""
    return all(lag == 0 for line in model.lines for _, lag in line.reads)


def _shows(data: Dataset, coarse: Dataset, channel: str, factor: int) -> bool:
    """Return whether straight lines between the samples of a coarse grid follow a channel."""
    lost, samples = [], []
    for fine, thin in zip(data.experiments, coarse.experiments, strict=True):
        y, kept = fine.values[channel], thin.values[channel]
        lost.append(y - np.interp(np.arange(y.size), factor * np.arange(kept.size), kept))
        samples.append(y)
    return bool(np.std(np.concatenate(lost)) <= _LOST * np.std(np.concatenate(samples)))


def windows(data: Dataset, channels: Sequence[str]) -> Dataset:
    """Return a record with at most `MOST_SAMPLES` samples: itself, or windows as experiments of their own."""
    if _length(data) <= MOST_SAMPLES:
        return data
    size = MOST_SAMPLES // _WINDOWS
    pieces = [
        _piece(run, first, min(size, run.n_samples - data.n_init), data.sampling_time)
        for run in data.experiments
        for first in range(data.n_init, max(data.n_init, run.n_samples - size) + 1, size)
    ]
    # Level and spread in units of what each channel does over the record.
    scale = [float(np.std(np.concatenate([run.values[c] for run in data.experiments]))) or 1.0 for c in channels]
    levels, spreads = (
        np.array([[float(f(piece.values[c])) for c in channels] for piece in pieces]) / scale for f in (np.mean, np.std)
    )
    chosen = [int(np.argmax(spreads.sum(axis=1)))]
    features = np.hstack([levels, spreads])
    # What is farthest from those chosen comes next (Gonzalez, Clustering to minimize the maximum distance, 1985).
    while len(chosen) < min(_WINDOWS, len(pieces)):
        distances = np.min([np.linalg.norm(features - features[k], axis=1) for k in chosen], axis=0)
        chosen.append(int(np.argmax(distances)))
    return replace(data, experiments=tuple(pieces[k] for k in sorted(chosen)), resampling=(), n_init=0)


def _piece(run: Experiment, first: int, size: int, sampling_time: float) -> Experiment:
    piece = slice_samples(run, range(first, first + size), sampling_time)
    return replace(piece, name=f"{run.name}, samples {first} to {first + size - 1}")


def fitted_to(fit: Fit, data: Dataset) -> Fit:
    """Return a model fitted to a whole record from the values that it has."""
    used = [np.arange(run.n_samples) >= data.n_init for run in data.experiments]
    problem = Fitting(fit.model, data, used)
    return problem.result(*problem.solve(problem.start(fit.model.values), _LONG))
