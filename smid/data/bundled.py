"""The records that come with the package. They are simulated: data/README.md in the repository says how."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

from smid.data.channel import name_hint
from smid.data.dataset import Dataset
from smid.data.errors import DataError


def record_path(name: str) -> Path:
    """Return the path of a bundled record.

    Parameters
    ----------
    name
        File name, such as ``"clutch_20C_ramp_a.csv"``.

    Raises
    ------
    DataError
        When there is no such record.

    Examples
    --------
    >>> record_path("clutch_20C_ramp_a.csv").name
    'clutch_20C_ramp_a.csv'
    """
    package = Path(str(files("smid")))
    # A wheel carries the records inside the package; a checkout has them beside it.
    for folder in (package / "_records", package.parent / "data"):
        if (folder / name).is_file():
            return folder / name
    raise DataError(f"no bundled record {name!r}: choose another name, or install smid again")


def load_clutch(name: str) -> Dataset:
    """Load a bundled clutch record: current in, pressure out, labelled as simulated.

    Parameters
    ----------
    name
        Such as ``"clutch_20C_ramp_a"``.

    Examples
    --------
    >>> load_clutch("clutch_20C_ramp_a").source
    'clutch_20C_ramp_a.csv (simulated)'
    """
    data = Dataset.from_csv(record_path(f"{name}.csv"), input="current", output="pressure")
    return replace(data, source=f"{name}.csv (simulated)")


def true_parameters(name: str) -> dict[str, float]:
    """Return the parameters that made a bundled clutch record, from the comment at its top.

    Parameters
    ----------
    name
        Such as ``"clutch_20C_ramp_a"``.

    Examples
    --------
    >>> true_parameters("clutch_20C_ramp_a")["alpha"]
    -0.65142
    """
    text = record_path(f"{name}.csv").read_text(encoding="utf-8")
    line = next(line for line in text.splitlines() if line.startswith("# True parameters:"))
    return {key: float(value) for key, value in re.findall(r"(\w+) = (-?[\d.]+)", line)}


CLUTCH_RECORDS = (
    "20C_ramp_a",
    "20C_ramp_b",
    "20C_step_a",
    "20C_step_b",
    "60C_ramp_a",
    "60C_ramp_b",
    "60C_step_a",
    "60C_step_c",
    "m20C_ramp_a",
    "m20C_step_a",
    "m20C_step_c",
)
"""The data sets that the thesis names; ``20C_step_b``, ``60C_step_c`` and ``m20C_step_c`` are those with hysteresis."""


def load_clutch_records(names: str | Sequence[str] | None = None) -> Dataset:
    """Load bundled records of current, pressure and position, labelled as simulated.

    Parameters
    ----------
    names
        Among `CLUTCH_RECORDS`; all of them by default.

    Returns
    -------
    Dataset
        One experiment per record, at 2 ms.  Channels ``current`` (input, mA), ``pressure`` (output, bar), ``position``
        (output, mm) and ``temperature`` (degC, without a role).  For a model from current to pressure alone, take
        ``dataclasses.replace(data, outputs=("pressure",))``.

    Raises
    ------
    DataError
        If a name is unknown or occurs twice, or none is given.

    Examples
    --------
    >>> data = load_clutch_records("m20C_step_a")
    >>> data.names, data.sampling_time, data.n_samples
    (('current', 'pressure', 'position', 'temperature'), 0.002, 5001)

    References
    ----------
    Clutch thesis, figures 3.3, 3.4 and 3.13 to 3.20.
    """
    wanted = CLUTCH_RECORDS if names is None else (names,) if isinstance(names, str) else tuple(names)
    for name in wanted:
        if name not in CLUTCH_RECORDS:
            raise DataError(f"no clutch record {name!r}; {name_hint(str(name), CLUTCH_RECORDS)}")
    data = Dataset.from_csv(
        [record_path(f"clutch/{name}.csv") for name in wanted],
        input="current",
        output=("pressure", "position"),
        sampling_time=0.002,
    )
    return replace(data, source=f"{data.source} (simulated)")
