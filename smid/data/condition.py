"""Trends and frequencies taken out of a data set; `Dataset` offers each as a method."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from smid.data.errors import DataError

if TYPE_CHECKING:
    from smid.data.dataset import Dataset

Trend = Literal["constant", "linear"]
_REMOVED = {"constant": ("mean", 0), "linear": ("straight line", 1)}


def detrend(dataset: "Dataset", kind: Trend, channels: str | Sequence[str] | None) -> "Dataset":
    """See `Dataset.detrend`."""
    if kind not in _REMOVED:
        raise DataError(f"detrend removes 'constant' or 'linear', not {kind!r}: choose one of them")
    what, degree = _REMOVED[kind]

    def rest(x: NDArray[np.float64]) -> NDArray[np.float64]:
        times, there = np.arange(x.size), ~np.isnan(x)
        return np.asarray(x - (np.polyval(np.polyfit(times[there], x[there], 1), times) if degree else x[there].mean()))

    return _changed(dataset, channels, rest, f"{what} of each experiment removed from")


def filter(
    dataset: "Dataset", above: float | None, below: float | None, order: int, channels: str | Sequence[str] | None
) -> "Dataset":
    """See `Dataset.filter`."""
    highest = 0.5 / dataset.sampling_time
    edges = [edge for edge in (above, below) if edge is not None]
    if not edges:
        raise DataError("the filter has no edge: give above, below, or both, in Hz")
    for edge in edges:
        if not 0 < edge < highest:
            raise DataError(
                f"the filter has an edge at {edge:g} Hz: give one between 0 and {highest:g} Hz, half the sampling rate"
            )
    if above is not None and below is not None and above >= below:
        raise DataError(f"the band from {above:g} Hz to {below:g} Hz is empty: give above < below")
    if isinstance(order, bool) or not isinstance(order, int) or not 1 <= order <= 10:
        raise DataError(f"the order of the filter is {order!r}: give a whole number from 1 to 10")
    shape: Literal["bandpass", "lowpass", "highpass"] = (
        "bandpass" if len(edges) == 2 else "lowpass" if above is None else "highpass"
    )
    from scipy import signal  # takes a second to load

    rate = 1 / dataset.sampling_time
    sections = signal.butter(order, edges if len(edges) == 2 else edges[0], shape, output="sos", fs=rate)
    padding = 3 * (2 * len(sections) + 1)  # samples that scipy adds at each end; it needs more than these
    for run in dataset.experiments:
        if run.n_samples <= padding:
            raise DataError(
                f"experiment {run.name!r} has {run.n_samples} samples, and this filter needs {padding + 1}: lower its "
                "order, or leave the experiment out"
            )
    kept = " and ".join(
        f"{side} {edge:g} Hz" for side, edge in (("above", above), ("below", below)) if edge is not None
    )
    lost = [name for name in _named(dataset, channels) if dataset.missing[name]]
    if lost:
        raise DataError(
            f"samples of {lost[0]!r} are missing, and the filter would read them: leave it out of channels, or call "
            "without_gaps() first"
        )
    return _changed(
        dataset,
        channels,
        lambda x: signal.sosfiltfilt(sections, x, padlen=padding),
        f"zero-phase Butterworth filter of order {order} keeps {kept} of",
    )


def _named(dataset: "Dataset", channels: str | Sequence[str] | None) -> list[str]:
    named = (*dataset.inputs, *dataset.outputs) if channels is None else channels
    names = [named] if isinstance(named, str) else list(named)
    for name in names:
        dataset.channel(name)
    return names


def _changed(
    dataset: "Dataset",
    channels: str | Sequence[str] | None,
    change: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    how: str,
) -> "Dataset":
    """Return the data set with these channels changed, and say so in its source."""
    if dataset.normalisation is not None:
        raise DataError("the data are normalised, and denormalise() would add offsets again; call it first")
    names = _named(dataset, channels)
    return replace(
        dataset,
        experiments=tuple(
            replace(run, values={n: change(x) if n in names else x for n, x in run.values.items()})
            for run in dataset.experiments
        ),
        source=f"{dataset.source}; {how} {', '.join(names)}".removeprefix("; "),
    )
