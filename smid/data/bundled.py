"""The records that come with the package. They are simulated: data/README.md in the repository says how."""

from __future__ import annotations

import glob
import re
from collections.abc import Sequence
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

from smid.data.channel import name_hint
from smid.data.dataset import Dataset
from smid.data.errors import DataError

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
"""Records of the whole actuator, named as in the clutch thesis; hysteresis: 20C_step_b, 60C_step_c, m20C_step_c."""

SHORT_RECORDS = (
    "hammerstein_20C_ramp_a",
    "hammerstein_20C_ramp_b",
    "hammerstein_60C_ramp_a",
    "hammerstein_60C_ramp_b",
    "hammerstein_m20C_ramp_a",
    "varying_pole_20C_steps",
)
"""Short records of current and pressure: of the Hammerstein model, and of a plant with another pole."""


def record_path(name: str) -> Path:
    """Return the path of a bundled record.

    Raises
    ------
    DataError
        If there is no such record.

    Examples
    --------
    >>> record_path("hammerstein_20C_ramp_a").name
    'hammerstein_20C_ramp_a.csv'
    """
    package = Path(str(files("smid")))
    # A wheel carries the records inside the package; a checkout has them beside it.
    for folder in (package / "_records", package.parent / "data"):
        for path in folder.glob(f"*/{glob.escape(name)}.csv"):
            return path
    raise DataError(f"no bundled record {name!r}: choose another name, or install smid again")


def load_clutch(names: str | Sequence[str] = CLUTCH_RECORDS) -> Dataset:
    """Load bundled clutch records, labelled as simulated: one experiment per record, every 2 ms.

    Channels are ``current`` (input, mA), ``pressure`` (output, bar), ``temperature`` (degC, without a role) and, of the
    whole actuator, ``position`` (output, mm). For a model from current to pressure alone, take
    ``dataclasses.replace(data, outputs=("pressure",))``.

    Parameters
    ----------
    names
        Among `CLUTCH_RECORDS`, or among `SHORT_RECORDS`.

    Raises
    ------
    DataError
        If a name is unknown or occurs twice, none is given, or both kinds of records are mixed.

    Examples
    --------
    >>> load_clutch("m20C_step_a").names
    ('current', 'pressure', 'position', 'temperature')
    >>> load_clutch("hammerstein_20C_ramp_a").source
    'hammerstein_20C_ramp_a.csv (simulated)'

    References
    ----------
    Clutch thesis, figures 3.3, 3.4 and 3.13 to 3.20.
    """
    wanted = (names,) if isinstance(names, str) else tuple(names)
    for name in wanted:
        if name not in CLUTCH_RECORDS + SHORT_RECORDS:
            raise DataError(f"no clutch record {name!r}; {name_hint(str(name), CLUTCH_RECORDS + SHORT_RECORDS)}")
    short = {name in SHORT_RECORDS for name in wanted}
    if len(short) > 1:
        raise DataError(f"{', '.join(wanted)}: short records have no position; load them on their own")
    # Only the actuator's time stamps are irregular, and need a sampling time.
    data = Dataset.from_file(
        [record_path(name) for name in wanted],
        input="current",
        output="pressure" if True in short else ("pressure", "position"),
        sampling_time=None if True in short else 0.002,
    )
    return replace(data, source=f"{', '.join(f'{name}.csv' for name in wanted)} (simulated)")


def true_parameters(name: str) -> dict[str, float]:
    """Return the parameters that made a record of the Hammerstein model, from the comment at the top of its file.

    Examples
    --------
    >>> true_parameters("hammerstein_20C_ramp_a")["alpha"]
    -0.65142
    """
    text = record_path(name).read_text(encoding="utf-8")
    line = next(line for line in text.splitlines() if line.startswith("# True parameters:"))
    return {key: float(value) for key, value in re.findall(r"(\w+) = (-?[\d.]+)", line)}
