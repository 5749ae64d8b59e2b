"""The data that a function is given: a data set, a pandas frame, or arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from numbers import Real
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from smid.data.channel import name_hint
from smid.data.columns import split_unit
from smid.data.dataset import Dataset, check_dataset
from smid.data.errors import DataError
from smid.models import Model

if TYPE_CHECKING:
    import pandas

Given: TypeAlias = "Dataset | pandas.DataFrame | tuple[Any, ...]"
"""A data set, a frame with an index of times, or arrays ``(u, y)`` or ``(u, y, sampling_time)``."""

_ARRAYS = "give (u, y, sampling_time), or Dataset.from_arrays(input=..., output=..., sampling_time=...)"


def as_dataset(data: Given, model: Model | None, sampling_time: float | None = None) -> Dataset:
    """Return the data set of what a function was given with a model.

    Parameters
    ----------
    data
        A data set as it is. A frame whose columns have the names of the model's channels: its times are a
        DatetimeIndex, an index of seconds, or a column `time`. Arrays ``(u, y)`` or ``(u, y, sampling_time)`` of
        shape (n,); of several inputs or outputs a mapping of such arrays by channel.
    sampling_time
        In seconds, for data without one. A discrete-time model needs none: a sample then counts as 1 s, and the
        `source` of the data set says so.

    Raises
    ------
    DataError
        If a channel or the sampling time cannot be told, or the arrays do not match the model.
    TypeError
        For anything else, and for a model that is none.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> as_dataset(([0.0, 1, 1], [0.0, 0, 1], 0.1), OutputError(input="valve", output="level")).names
    ('valve', 'level')
    """
    if model is not None and not isinstance(model, Model):
        cure = (
            f"call it, {model.__name__}(...)"
            if callable(model)
            else "make one, such as OutputError(2, 1), or load_model(path)"
        )
        raise TypeError(f"the model is a {type(model).__name__}, not a Model: {cure}")
    if model is not None and isinstance(data, tuple):
        return _of_arrays(data, model, sampling_time)
    if model is not None and type(data).__name__ == "DataFrame":  # pandas is not loaded for the question
        return _of_frame(data, model, sampling_time)
    check_dataset(data)
    assert isinstance(data, Dataset)
    return data


def _of_arrays(arrays: tuple[Any, ...], model: Model, sampling_time: float | None) -> Dataset:
    """Return the data set of ``(u, y)`` or ``(u, y, sampling_time)``."""
    if len(arrays) not in (2, 3):
        raise DataError(f"the data are a tuple of {len(arrays)}: {_ARRAYS}")
    u, y, *stated = arrays
    interval, note = sampling_time, ""
    if stated:
        if not isinstance(stated[0], Real):
            raise DataError(f"the third of the data is no sampling time in seconds: {_ARRAYS}")
        interval = float(stated[0])
    elif interval is None:
        if model.continuous:
            raise DataError(f"the model {model.name!r} has rates, and the arrays no sampling time: {_ARRAYS}")
        interval, note = 1.0, "arrays without a sampling time: a sample counts as 1 s"
    columns = {
        **_columns("u", "input", u, model.exogenous_channels),
        **_columns("y", "output", y, model.output_channels),
    }
    data = Dataset.from_arrays(
        input={name: columns[name] for name in model.exogenous_channels},
        output={name: columns[name] for name in model.output_channels},
        sampling_time=interval,
    )
    return replace(data, source="; ".join(filter(None, (note, data.source))))


def _columns(name: str, role: str, given: Any, channels: tuple[str, ...]) -> dict[str, Any]:
    """Return the samples by channel: of several channels by their names only, for equations have no order of inputs."""
    if isinstance(given, Mapping):
        if set(given) != set(channels):
            raise DataError(f"{name} has the channels {', '.join(map(str, given))}: give {_listed(channels)}")
        return dict(given)
    if len(channels) != 1:
        kind = f"{len(channels)} {role}s" if channels else f"no {role}"
        raise DataError(
            f"the model has {kind}, and {name} is an array without names: give {name} as {_listed(channels)}"
        )
    try:
        values = np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError):
        raise DataError(f"{name} is no array of numbers: give shape (n,)") from None
    if values.ndim != 1 and values.shape != (values.size, 1):
        raise DataError(f"{name} has the shape {values.shape}, and the model one {role}: give shape (n,)")
    return {channels[0]: values.reshape(-1)}


def _listed(channels: tuple[str, ...]) -> str:
    return f"{{{', '.join(f'{channel!r}: array' for channel in channels)}}}"


def _of_frame(frame: Any, model: Model, sampling_time: float | None) -> Dataset:
    """Return the data set of a frame whose columns are named as the model's channels."""
    columns = [split_unit(str(title))[0] for title in frame.columns]
    missing = [channel for channel in model.channels if channel not in columns]
    if missing:
        raise DataError(
            f"the model reads {', '.join(model.channels)}, and the frame has no column {missing[0]!r} "
            f"({name_hint(missing[0], columns)}): rename the columns, name the channels in the model, or make a "
            "Dataset.from_pandas(frame, input=..., output=...)"
        )
    time = _time_of(frame)
    if time is not None and frame.index.name is None:
        frame = frame.rename_axis("time")
    named = {str(name).casefold() for name in (*columns, *frame.index.names)}
    if time is None and sampling_time is None and "time" not in named:
        raise DataError(
            "the frame has no times: give it a DatetimeIndex, an index of seconds or a column time, or make a "
            "Dataset.from_pandas(frame, input=..., output=..., sampling_time=...)"
        )
    return Dataset.from_pandas(frame, model.exogenous_channels, model.output_channels, sampling_time, time)


def _time_of(frame: Any) -> str | None:
    """Return the name of the index if it holds times; whole numbers without a name may be numbers of rows."""
    index = frame.index
    if index.nlevels > 1 or index.dtype.kind not in "fMm":
        return None
    return split_unit(str(index.name or "time"))[0]
