"""One uniformly sampled run of an experiment."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from smid.data.errors import DataError


def _read_only(values: ArrayLike) -> NDArray[np.float64]:
    if np.iscomplexobj(values):
        raise TypeError("complex numbers")
    # Adding 0.0 copies, and turns -0.0 into 0.0, so that equal numbers have equal bytes and equal checksums.
    array: NDArray[np.float64] = np.asarray(values, dtype=np.float64) + 0.0
    array[np.isnan(array)] = np.nan  # NaN has many bit patterns
    array.setflags(write=False)
    return array


@dataclass(frozen=True, eq=False)
class Experiment:
    """One run: every channel as a read-only array over the same uniform instants.

    Parameters
    ----------
    name
        Unique in its data set.
    values
        Shape (N,). Samples of each channel, in the channel's unit; copied. A missing sample is NaN.
    start_time
        Time of the first sample, in seconds.

    Raises
    ------
    DataError
        If a channel is not a vector of real numbers, is empty, or differs in length from the others.

    Examples
    --------
    >>> run = Experiment("step", {"u": [0, 1, 1], "y": [0, 0, 0.5]})
    >>> run.n_samples, run.values["y"]
    (3, array([0. , 0. , 0.5]))
    """

    name: str
    values: Mapping[str, NDArray[np.float64]]
    start_time: float = 0.0

    def __post_init__(self) -> None:
        arrays: dict[str, NDArray[np.float64]] = {}
        for channel, values in self.values.items():
            try:
                arrays[channel] = _read_only(values)
            except (TypeError, ValueError):
                raise DataError(
                    f"channel {channel!r} of experiment {self.name!r} is not a vector of real numbers; "
                    "convert it to floats first"
                ) from None
            if arrays[channel].ndim != 1:
                raise DataError(
                    f"channel {channel!r} of experiment {self.name!r} has shape {arrays[channel].shape}; "
                    "give one vector per channel"
                )
        lengths = {channel: array.size for channel, array in arrays.items()}
        if len(set(lengths.values())) > 1:
            listed = ", ".join(f"{channel!r} {length}" for channel, length in lengths.items())
            raise DataError(
                f"the channels of experiment {self.name!r} differ in length ({listed}); cut them to the same instants"
            )
        if not arrays or 0 in lengths.values():
            raise DataError(f"experiment {self.name!r} has no samples; leave it out or widen its range")
        if not np.isfinite(self.start_time):
            raise DataError(f"experiment {self.name!r} starts at {self.start_time} s; give a finite start_time")
        object.__setattr__(self, "values", MappingProxyType(arrays))

    @property
    def n_samples(self) -> int:
        """Return the number of samples N of every channel."""
        return int(next(iter(self.values.values())).size)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Experiment):
            return NotImplemented
        return (
            (self.name, self.start_time) == (other.name, other.start_time)
            and self.values.keys() == other.values.keys()
            and all(np.array_equal(array, other.values[name], equal_nan=True) for name, array in self.values.items())
        )

    def __hash__(self) -> int:
        return hash((self.name, self.start_time, self.n_samples))

    def __reduce__(self) -> tuple[type["Experiment"], tuple[str, dict[str, NDArray[np.float64]], float]]:
        # A mapping proxy cannot be pickled, and unpickled arrays would be writable: construct again instead.
        return Experiment, (self.name, dict(self.values), self.start_time)
