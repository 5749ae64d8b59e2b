"""Sensors as JSON files: the class and every trained number, exactly."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from types import UnionType
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np

from smid.data import DataError
from smid.display.plugins import find_subclass
from smid.sensors.bounded import BoundedSensor
from smid.sensors.sensor import VirtualSensor

__all__ = ["load_sensor", "save_sensor", "sensor_from_dict", "sensor_to_dict"]

FORMAT = 1
GROUP = "smid.sensors"
Sensor = VirtualSensor | BoundedSensor


def sensor_to_dict(sensor: Sensor) -> dict[str, Any]:
    """Return plain numbers, strings, lists and dictionaries.

    Raises
    ------
    DataError
        If another class of sensors has the same name.

    Examples
    --------
    >>> from smid.sensors import CFPX
    >>> sensor_to_dict(CFPX(order=3))["order"]
    3
    """
    kind = type(sensor).__name__
    if _class_named(kind) is not type(sensor):
        raise DataError(f"two classes of sensors have the name {kind}: rename yours")
    return {"format": FORMAT, "kind": kind, **_fields(sensor)}


def _class_named(kind: object) -> type[Sensor] | None:
    """Return the class of a sensor, also of another package."""
    if kind == BoundedSensor.__name__:
        return BoundedSensor
    return find_subclass(VirtualSensor, str(kind), GROUP, lambda item: item.__name__)


def _fields(value: Any) -> dict[str, Any]:
    return {field.name: _plain(getattr(value, field.name)) for field in fields(value)}


def _plain(value: Any) -> Any:
    """Return a field as JSON can hold it."""
    if isinstance(value, Sensor):
        return sensor_to_dict(value)
    if hasattr(value, "to_dict"):
        return value.to_dict()
    if is_dataclass(value):
        return _fields(value)
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    return [_plain(part) for part in value] if isinstance(value, tuple) else value


def _read(kind: Any, value: Any) -> Any:
    """Return a field as the type that its class declares."""
    choices = [item for item in get_args(kind) if item is not type(None)]
    if value is None:
        return None
    if isinstance(kind, UnionType):  # such as Array | None
        kind = choices[0]
    made = get_origin(kind) or kind
    if not isinstance(made, type):
        return value
    if issubclass(made, np.ndarray | tuple):
        return np.array(value) if issubclass(made, np.ndarray) else tuple(value)
    if issubclass(made, Sensor):
        return sensor_from_dict(value)
    if hasattr(made, "from_dict"):
        return made.from_dict(value)
    return made(**_read_fields(made, value)) if is_dataclass(made) else value


def _read_fields(made: type, record: Mapping[str, Any]) -> dict[str, Any]:
    kinds = get_type_hints(made)
    return {name: _read(kinds[name], value) for name, value in record.items()}


def sensor_from_dict(record: Mapping[str, Any]) -> Sensor:
    """Return the sensor that `sensor_to_dict` described; its predictions are the same to the last bit.

    Raises
    ------
    DataError
        If no known class has this name, or the record is damaged.

    Examples
    --------
    >>> from smid.sensors import CFPX
    >>> sensor_from_dict(sensor_to_dict(CFPX(order=3))).order
    3
    """
    kind = record.get("kind")
    made = _class_named(kind)
    if record.get("format") != FORMAT or made is None:
        raise DataError(
            f"this is not a sensor of format {FORMAT}, but kind {kind!r}, format {record.get('format')!r}: "
            "give a file that save_sensor wrote, and import the package that defines its class"
        )
    parts = {name: value for name, value in record.items() if name not in ("format", "kind")}
    try:
        return made(**_read_fields(made, parts))
    except (AttributeError, TypeError, KeyError) as error:
        raise DataError(f"the record of a {kind} is damaged ({error}): give a file that save_sensor wrote") from None


def save_sensor(sensor: Sensor, path: str | Path) -> None:
    """Write a sensor, trained or not, to a JSON file.

    Examples
    --------
    >>> import tempfile
    >>> from smid.sensors import CPX
    >>> file = Path(tempfile.mkdtemp()) / "sensor.json"
    >>> save_sensor(CPX(hidden=(5,)), file)
    >>> load_sensor(file).n_parameters
    31
    """
    Path(path).write_text(json.dumps(sensor_to_dict(sensor), indent=1) + "\n", encoding="utf-8")


def load_sensor(path: str | Path) -> Sensor:
    """Return the sensor of a file that `save_sensor` wrote.

    Raises
    ------
    DataError
        If there is no such file, or it holds no sensor.

    Examples
    --------
    >>> import tempfile
    >>> from smid.sensors import CPX
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
        raise DataError(f"{Path(path).name} is not valid JSON ({error}): give a file that save_sensor wrote") from None
    if not isinstance(record, dict):
        raise DataError(f"{Path(path).name} holds no sensor: give a file that save_sensor wrote")
    return sensor_from_dict(record)
