"""What a file says of the record that a result is about; it stands for the record until the record is given."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NoReturn, cast

from smid.data.channel import Channel
from smid.data.dataset import Dataset
from smid.data.errors import DataError
from smid.display.from_plain import Plain, read


@dataclass(frozen=True)
class Reference:
    """A record without its samples. To ask for anything else raises a DataError that names the cure.

    Examples
    --------
    >>> data = Dataset.from_arrays(input={"u": [0, 1]}, output={"y": [0, 2]}, sampling_time=1, units={"y": "bar"})
    >>> known = referred(identity(data))
    >>> known.n_samples, known.channel("y").unit
    (2, 'bar')
    >>> known.experiments
    Traceback (most recent call last):
    ...
    smid.data.errors.DataError: the samples of the record (arrays in memory) are not in the file of this result: give \
them, as in smid.load(path, data=record)
    """

    source: str
    checksum: str
    n_samples: int
    missing: Mapping[str, int]
    sampling_time: float
    experiment_names: tuple[str, ...]
    channels: tuple[Channel, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]

    names = Dataset.names
    channel = Dataset.channel
    role = Dataset.role

    def __getattr__(self, name: str) -> NoReturn:
        if name.startswith("_"):
            raise AttributeError(name)
        raise DataError(
            f"the samples of the record ({self.source or 'arrays in memory'}) are not in the file of this result: give "
            "them, as in smid.load(path, data=record)"
        )


def identity(data: Dataset) -> dict[str, Any]:
    """Return plain data that tell which record it is: the ``data`` of docs/json.md."""
    return {
        "source": data.source,
        "checksum": data.checksum,
        "samples": data.n_samples,
        "missing": dict(data.missing),
        "sampling_time": data.sampling_time,
        "experiments": list(data.experiment_names),
        "channels": [{"name": c.name, "unit": c.unit, "role": data.role(c.name)} for c in data.channels],
    }


def referred(stated: Mapping[str, Any], data: Dataset | None = None) -> Dataset:
    """Return the record that `identity` described: the one given, or else what is known of it without its samples.

    Raises
    ------
    DataError
        If another record is given.
    """
    source, checksum = read(stated, "source", str), read(stated, "checksum", str)
    if data is not None:
        if data.checksum != checksum:
            raise DataError(
                f"the result is about another record ({source or 'arrays in memory'}; SHA-256 {checksum[:12]}..., not "
                f"{data.checksum[:12]}...): give the record that it was computed from"
            )
        return data
    told = read(stated, "channels", tuple[Plain, ...])
    channels = [{key: read(one, key, str) for key in ("name", "unit", "role")} for one in told]
    known = Reference(
        source,
        checksum,
        read(stated, "samples", int),
        read(stated, "missing", Mapping[str, int]),
        read(stated, "sampling_time", float),
        read(stated, "experiments", tuple[str, ...]),
        tuple(Channel(c["name"], c["unit"]) for c in channels),
        tuple(c["name"] for c in channels if c["role"] == "input"),
        tuple(c["name"] for c in channels if c["role"] == "output"),
    )
    return cast(Dataset, known)
