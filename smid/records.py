"""The records that come with the package. They are simulated: data/README.md in the repository says how."""

from __future__ import annotations

import re
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

from smid.data import DataError, Dataset


def record_path(name: str) -> Path:
    """Return the path of a bundled record.

    Parameters
    ----------
    name : str
        File name, such as ``"clutch_20C_ramp_a.csv"``.

    Returns
    -------
    Path

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
    name : str
        Such as ``"clutch_20C_ramp_a"``.

    Returns
    -------
    Dataset

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
    name : str
        Such as ``"clutch_20C_ramp_a"``.

    Examples
    --------
    >>> true_parameters("clutch_20C_ramp_a")["alpha"]
    -0.65142
    """
    text = record_path(f"{name}.csv").read_text(encoding="utf-8")
    line = next(line for line in text.splitlines() if line.startswith("# True parameters:"))
    return {key: float(value) for key, value in re.findall(r"(\w+) = (-?[\d.]+)", line)}
