"""Loader of measured sets by name; the user provides the files."""

import hashlib
import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from smid.data.channel import name_hint
from smid.data.dataset import Dataset
from smid.data.errors import DataError
from smid.data.experiment import Experiment
from smid.data.read_csv import read_csv, read_text
from smid.data.record_specs import RECORDS, RecordFile, RecordSpec


def load_record(name: str, folder: str | Path) -> Dataset:
    """Load a measured set with its names, units and sampling time, one experiment per run.

    Parameters
    ----------
    name
        One of `RECORDS`: "daisy_hairdryer", "box_jenkins_gas_furnace", "silverbox", ...
    folder
        The folder of the set, or a folder that holds it under its name.

    Raises
    ------
    DataError
        If the name is unknown, a file is missing, or its MD5 is not that of the published file.

    Examples
    --------
    >>> load_record("hairdryer", ".")
    Traceback (most recent call last):
    ...
    smid.data.errors.DataError: no measured set 'hairdryer'; did you mean 'daisy_hairdryer'?
    """
    if name not in RECORDS:
        raise DataError(f"no measured set {name!r}; {name_hint(name, RECORDS)}")
    spec = RECORDS[name]
    within = Path(folder) / name
    home = within if within.is_dir() else Path(folder)
    experiments: list[Experiment] = []
    for file in spec.files:
        path = home / file.path
        _check_md5(path, file.md5)
        experiments += _runs_of_columns(path, file, spec) if file.parts else _runs_of_json(path, spec)
    names = tuple(channel.name for channel in spec.channels)
    return Dataset(
        experiments=tuple(experiments),
        channels=spec.channels,
        inputs=names[: spec.n_inputs],
        outputs=names[spec.n_inputs : spec.n_inputs + spec.n_outputs],
        sampling_time=spec.sampling_time,
        n_init=spec.n_init,
        source=spec.title,
    )


def _check_md5(path: Path, expected: str) -> None:
    if not path.is_file():
        raise DataError(f"no file {str(path)!r}; give the folder that holds {path.name!r}")
    found = hashlib.md5(path.read_bytes(), usedforsecurity=False).hexdigest()
    if found != expected:
        raise DataError(
            f"{path.name} has md5 {found} but the published file has {expected}; "
            "download it again, or read your own version with Dataset.from_file"
        )


def _runs_of_columns(path: Path, file: RecordFile, spec: RecordSpec) -> list[Experiment]:
    table = read_csv(path)
    runs = []
    for part in file.parts:
        values: dict[str, NDArray[np.float64]] = {
            channel.name: table.numbers(table.find(column))[part.start : part.stop]
            for channel, column in zip(spec.channels, part.columns, strict=True)
        }
        runs.append(Experiment(part.name, values, part.start_time))
    return runs


def _runs_of_json(path: Path, spec: RecordSpec) -> list[Experiment]:
    command, angle = (channel.name for channel in spec.channels)
    runs = []
    for k, run in enumerate(json.loads(read_text(path))["data"]):
        # In the drop runs the motor is switched off after some samples; the command ends there.
        n_commanded = int(np.count_nonzero(np.isfinite(np.array(run["actions"], dtype=np.float64))))
        values = {command: run["actions"][:n_commanded], angle: run["sensor_data"][:n_commanded]}
        runs.append(Experiment(f"{run['type']}_{k}", values))
    return runs
