"""Records of the package `nonlinear_benchmarks` (nonlinearbenchmark.org), which is not imported.

Its loaders return objects with `u`, `y`, `sampling_time`, `name` and `state_initialization_window_length`, or tuples of
them. That window, the samples that a model may use to find its state, becomes the warm-up `n_init`.
"""

from collections.abc import Sequence
from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from smid.data.channel import Channel
from smid.data.errors import DataError
from smid.data.experiment import Experiment

if TYPE_CHECKING:
    from smid.data.dataset import Dataset

_ATTRIBUTES = ("u", "y", "sampling_time")


def read_nonlinear_benchmarks(records: Any, sampling_time: float | None = None) -> "Dataset":
    """Return the data set of one record, or of several as its experiments; see `Dataset.from_nonlinear_benchmarks`."""
    from smid.data.dataset import Dataset  # it imports this file's function

    runs = _flat(records)
    values = [_channels(run) for run in runs]
    if any(found.keys() != values[0].keys() for found in values):
        shapes = "; ".join(", ".join(found) for found in values)
        raise DataError(f"the records have different channels ({shapes}); read them one at a time")
    names = [str(getattr(run, "name", "") or "experiment") for run in runs]
    numbered = [name if names.count(name) == 1 else f"{name}_{k}" for k, name in enumerate(names, start=1)]
    windows = [getattr(run, "state_initialization_window_length", None) or 0 for run in runs]
    inputs = tuple(channel for channel in values[0] if channel.startswith("u"))
    return Dataset(
        experiments=tuple(Experiment(name, found) for name, found in zip(numbered, values, strict=True)),
        channels=tuple(Channel(channel) for channel in values[0]),
        inputs=inputs,
        outputs=tuple(channel for channel in values[0] if channel not in inputs),
        sampling_time=_sampling_time(runs, sampling_time),
        n_init=int(max(windows)),
        source=f"nonlinear_benchmarks: {', '.join(dict.fromkeys(names))}",
    )


def _flat(records: Any) -> list[Any]:
    # A record can be unpacked like a tuple, so its attributes decide, not its methods.
    if all(hasattr(records, attribute) for attribute in _ATTRIBUTES):
        return [records]
    if isinstance(records, list | tuple) and records:
        return [run for record in records for run in _flat(record)]
    raise DataError(
        f"{type(records).__name__} is not a record of nonlinear_benchmarks: give an Input_output_data, with the "
        f"attributes {', '.join(_ATTRIBUTES)}, or a tuple of them"
    )


def _channels(run: Any) -> dict[str, NDArray[np.float64]]:
    found: dict[str, NDArray[np.float64]] = {}
    for stem in ("u", "y"):
        try:
            array = np.asarray(getattr(run, stem), dtype=np.float64)
        except (TypeError, ValueError):
            raise DataError(f"{stem} of the record is not an array of numbers: convert it to floats first") from None
        if array.ndim not in (1, 2) or not array.size:
            raise DataError(f"{stem} of the record has shape {array.shape}: give (N,) or (N, channels), not empty")
        columns = array.reshape(len(array), -1).T
        found |= {stem if len(columns) == 1 else f"{stem}{k}": column for k, column in enumerate(columns, start=1)}
    return found


def _sampling_time(runs: Sequence[Any], given: float | None) -> float:
    times = {run.sampling_time if given is None else given for run in runs}
    known = [float(time) for time in times if isinstance(time, Real)]
    if len(times) > 1 or not known:
        listed = ", ".join(sorted(map(str, times)))
        raise DataError(f"the records' sampling time is {listed}: give one number of seconds as sampling_time")
    return known[0]
