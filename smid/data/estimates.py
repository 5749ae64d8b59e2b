"""Estimates of a noisy channel from its own record: what it may be without its noise.

*Smoothed*: each sample as a weighted sum of its neighbours, the same on both sides, with the weights of least squares.
White noise in a sample is not in its neighbours. How many count, generalised cross-validation says. This serves what
moves smoothly.

*Levels*: a sample and its two neighbours move to the mean of those of the record that are like them, until they stay
(mean shift). This serves what jumps between levels. How far noise reaches is not known, so there is one estimate for
each width, as a share of the channel's deviation.

References: Golub, Heath and Wahba, Technometrics 21 (1979) 215-223; Comaniciu and Meer, IEEE Transactions on Pattern
Analysis and Machine Intelligence 24 (2002) 603-619.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data.channel import Channel

if TYPE_CHECKING:
    from smid.data.dataset import Dataset

__all__ = [
    "estimate_names",
    "estimates_of",
    "in_words",
    "levels",
    "smoothed",
    "with_estimates",
    "without_estimates",
]

_NEIGHBOURS = (6, 12, 25, 50, 100)  # on each side
_FEWEST = 5  # samples for each weight
_WIDTHS = (0.1, 0.2, 0.4)
_STEPS = 8
_MOST = 1000  # samples that others are compared with
_PIECE = 5000  # samples that are compared at a time


def smoothed(x: Array) -> Array:
    """Return each sample as its neighbours on both sides tell it, in the unit of x; x itself where it is too short.

    Parameters
    ----------
    x
        Shape (n,).

    Examples
    --------
    >>> t = np.arange(600)
    >>> noise = np.random.default_rng(0).uniform(-0.1, 0.1, 600)
    >>> left = smoothed(np.sin(t / 9) + noise) - np.sin(t / 9)
    >>> print(f"{np.std(left) / np.std(noise):.2f}")
    0.50
    """
    fits = [_interpolated(x, count) for count in _NEIGHBOURS if count * _FEWEST <= x.size]
    best = min(range(len(fits)), key=lambda k: fits[k][0], default=-1)
    found = x.copy()
    # Nearer to the ends fewer neighbours count.
    for count, (_, told) in zip(_NEIGHBOURS, fits[: best + 1], strict=False):
        found[count:-count] = told
    return found


def _interpolated(x: Array, count: int) -> tuple[float, Array]:
    """Return what so many neighbours a side tell of the samples that have them: the criterion, and these samples."""
    windows = np.lib.stride_tricks.sliding_window_view(x - x.mean(), 2 * count + 1)
    # The covariance of a stationary record is the same on both sides, and so are the best weights.
    pairs, middle = windows[:, :count] + windows[:, :count:-1], windows[:, count]
    told = pairs @ np.linalg.lstsq(pairs, middle, rcond=None)[0]
    criterion = float(np.mean((middle - told) ** 2)) / (1 - count / len(windows)) ** 2
    return criterion, told + x.mean()


def levels(x: Array, width: float) -> Array:
    """Return the level that each sample belongs to, in the unit of x.

    Parameters
    ----------
    x
        Shape (n,).
    width
        Of the kernel, as a share of the standard deviation of x.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> true = np.repeat(rng.choice([-1.0, 1.0], 60), 5)
    >>> noise = rng.uniform(-0.2, 0.2, 300)
    >>> bool(np.std(levels(true + noise, 0.2) - true) < 0.3 * np.std(noise))
    True
    """
    size = width * float(np.std(x))
    if not size:
        return x
    triples = np.lib.stride_tricks.sliding_window_view(np.pad(x, 1, mode="edge"), 3) / size
    known = triples[np.unique(np.linspace(0, x.size - 1, min(x.size, _MOST)).astype(int))]
    pieces = [triples[first : first + _PIECE] for first in range(0, x.size, _PIECE)]
    return size * np.concatenate([_shifted(piece, known)[:, 1] for piece in pieces])


def _shifted(found: Array, known: Array) -> Array:
    """Move points, shape (n, 3), to the means of the known ones that are near."""
    for _ in range(_STEPS):
        apart = (found**2).sum(1)[:, None] + (known**2).sum(1) - 2 * found @ known.T
        # Those nearest count fully, also where none is near.
        weights = np.exp(-0.5 * (apart - apart.min(axis=1, keepdims=True)))
        found = weights @ known / weights.sum(axis=1, keepdims=True)
    return found


_ESTIMATES: dict[str, Callable[[Array], Array]] = {
    "__smoothed": smoothed,
    **{f"__levels_{100 * width:.0f}": partial(levels, width=width) for width in _WIDTHS},
}
"""By what is appended to the name of a channel."""


def estimate_names(channel: str) -> tuple[str, ...]:
    """Return the names of the estimates of a channel.

    Examples
    --------
    >>> estimate_names("u")
    ('u__smoothed', 'u__levels_10', 'u__levels_20', 'u__levels_40')
    """
    return tuple(channel + ending for ending in _ESTIMATES)


def in_words(name: str) -> str:
    """Return how the estimate of a name is made.

    Examples
    --------
    >>> in_words("u__levels_20"), in_words("u__smoothed")
    ('levels 20 % wide', 'smoothed')
    """
    kind, _, width = name.rpartition("__")[2].partition("_")
    return f"{kind} {width} % wide" if width else kind


def with_estimates(data: Dataset, names: Iterable[str]) -> Dataset:
    """Return the data with further channels: those of the names that estimate one of its channels and are not there.

    Parameters
    ----------
    names
        See `estimate_names`; others are passed over.

    Examples
    --------
    >>> from smid.data import Dataset
    >>> data = Dataset.from_arrays(input={"u": [0.0, 1, 1]}, output={"y": [0.0, 0, 1]}, sampling_time=1.0)
    >>> with_estimates(data, ["y", "u__levels_20"]).names
    ('u', 'y', 'u__levels_20')
    """
    sources = {estimate: channel for channel in data.names for estimate in estimate_names(channel)}
    for name in names:
        if name in sources and name not in data.names:
            channel = data.channel(sources[name])
            estimate = _ESTIMATES[name.removeprefix(channel.name)]
            runs = tuple(
                replace(run, values={**run.values, name: estimate(run.values[channel.name])})
                for run in data.experiments
            )
            channels = (*data.channels, Channel(name, channel.unit, estimate_of=channel.name))
            data = replace(data, experiments=runs, channels=channels)
    return data


def estimates_of(data: Dataset, channel: str) -> tuple[str, ...]:
    """Return the channels of the data that estimate a channel.

    Examples
    --------
    >>> from smid.data import Dataset
    >>> data = Dataset.from_arrays(input={"u": [0.0, 1, 1]}, output={"y": [0.0, 0, 1]}, sampling_time=1.0)
    >>> estimates_of(with_estimates(data, ["u__smoothed"]), "u")
    ('u__smoothed',)
    """
    return tuple(c.name for c in data.channels if c.estimate_of == channel)


def without_estimates(data: Dataset) -> Dataset:
    """Return the data with the measured channels only.

    Examples
    --------
    >>> from smid.data import Dataset
    >>> data = Dataset.from_arrays(input={"u": [0.0, 1, 1]}, output={"y": [0.0, 0, 1]}, sampling_time=1.0)
    >>> without_estimates(with_estimates(data, ["u__smoothed"])).names
    ('u', 'y')
    """
    measured = tuple(channel for channel in data.channels if not channel.estimate_of)
    runs = tuple(replace(run, values={c.name: run.values[c.name] for c in measured}) for run in data.experiments)
    return replace(data, experiments=runs, channels=measured)
