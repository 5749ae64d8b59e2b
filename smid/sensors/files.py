"""Sensors as JSON: what they are, and every number that training found, to the last bit."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from smid.data import DataError
from smid.networks import TanhNetwork
from smid.sensors.bounded import BoundedSensor
from smid.sensors.cfpx import CFPX
from smid.sensors.cpx import CPX
from smid.sensors.dead_zone import DeadZone
from smid.sensors.median_filtered import MedianFiltered
from smid.sensors.ptx import PTX
from smid.sensors.ptx_dynamics import Dynamics
from smid.sensors.px import PX
from smid.sensors.sensor import VirtualSensor

__all__ = ["load_sensor", "save_sensor", "sensor_from_dict", "sensor_to_dict"]

FORMAT = 1
Sensor = VirtualSensor | BoundedSensor
KINDS: dict[str, Callable[..., Sensor]] = {
    "BoundedSensor": BoundedSensor,
    "CFPX": CFPX,
    "CPX": CPX,
    "DeadZone": DeadZone,
    "MedianFiltered": MedianFiltered,
    "PTX": PTX,
    "PX": PX,
}


def sensor_to_dict(sensor: Sensor) -> dict[str, Any]:
    """Return plain numbers, strings, lists and dictionaries.

    Parameters
    ----------
    sensor
        Trained or not.

    Examples
    --------
    >>> sensor_to_dict(CFPX(order=3))["order"]
    3
    """
    parts = {field.name: _plain(getattr(sensor, field.name)) for field in fields(sensor)}  # type: ignore[arg-type]
    return {"format": FORMAT, "kind": type(sensor).__name__, **parts}


def _plain(value: Any) -> Any:
    if isinstance(value, (VirtualSensor, BoundedSensor)):
        return sensor_to_dict(value)
    if isinstance(value, TanhNetwork):
        return value.to_dict()
    if isinstance(value, Dynamics):
        return {field.name: _plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, (tuple, np.ndarray)):
        return [_plain(part) for part in np.asarray(value).tolist()]
    return value


def _dynamics(record: dict[str, Any]) -> Dynamics:
    parts: dict[str, Any] = {name: tuple(v) if isinstance(v, list) else v for name, v in record.items()}
    return Dynamics(**parts)


READERS: dict[str, Callable[[Any], Any]] = {
    "coefficients": np.array,
    "dynamics": _dynamics,
    "hidden": tuple,
    "knots": np.array,
    "network": TanhNetwork.from_dict,
    "pressure_range": tuple,
    "sensor": lambda record: sensor_from_dict(record),
    "temperature_range": tuple,
    "weights": np.array,
}


def sensor_from_dict(record: Mapping[str, Any]) -> Sensor:
    """Make the sensor that `sensor_to_dict` described.

    Returns
    -------
    VirtualSensor or BoundedSensor
        What it predicts is the same to the last bit.

    Raises
    ------
    DataError
        If the record is of no known sensor.

    Examples
    --------
    >>> sensor_from_dict(sensor_to_dict(CFPX(order=3))).order
    3
    """
    kind = record.get("kind")
    if record.get("format") != FORMAT or kind not in KINDS:
        raise DataError(
            f"this is no sensor of format {FORMAT}, but kind {kind!r}, format {record.get('format')!r}: "
            "give a file that save_sensor wrote"
        )
    parts = {name: value for name, value in record.items() if name not in ("format", "kind")}
    try:
        read = {name: READERS[name](v) if name in READERS and v is not None else v for name, v in parts.items()}
        return KINDS[kind](**read)
    except (TypeError, KeyError) as error:
        raise DataError(f"the record of a {kind} is damaged ({error}): give a file that save_sensor wrote") from None


def save_sensor(sensor: Sensor, path: str | Path) -> None:
    """Write a sensor to a file.

    Parameters
    ----------
    sensor
        Trained or not.
    path
        Of the JSON file.

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "sensor.json"
    >>> save_sensor(CPX(hidden=(5,)), file)
    >>> load_sensor(file).n_parameters
    31
    """
    Path(path).write_text(json.dumps(sensor_to_dict(sensor), indent=1) + "\n", encoding="utf-8")


def load_sensor(path: str | Path) -> Sensor:
    """Read a sensor from a file.

    Parameters
    ----------
    path
        Of a file that `save_sensor` wrote.

    Raises
    ------
    DataError
        If there is no such file, or it holds no sensor.

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "sensor.json"
    >>> save_sensor(CPX(hidden=(5,)), file)
    >>> load_sensor(file).n_parameters
    31
    """
    try:
        record = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError:
        raise DataError(f"no file {str(path)!r} to read: give one that save_sensor wrote") from None
    except json.JSONDecodeError as error:
        raise DataError(f"{Path(path).name} is no JSON ({error}): give a file that save_sensor wrote") from None
    if not isinstance(record, dict):
        raise DataError(f"{Path(path).name} holds no sensor: give a file that save_sensor wrote")
    return sensor_from_dict(record)
