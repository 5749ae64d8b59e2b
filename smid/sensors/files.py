"""Sensors as JSON files: the class and every trained number, exactly."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from relaxations.writing import write_text
from smid.data import DataError
from smid.display.from_plain import fields_from_plain
from smid.display.plugins import find_subclass
from smid.sensors.bounded import BoundedSensor
from smid.sensors.sensor import VirtualSensor

__all__ = ["save_sensor", "sensor_from_dict", "sensor_to_dict"]

SENSOR = "smid.sensor/3"
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
    return {"schema": SENSOR, "kind": kind, **_fields(sensor)}


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


def sensor_from_dict(record: Mapping[str, Any]) -> Sensor:
    """Return the sensor that `sensor_to_dict` described; its predictions are the same to the last bit.

    Raises
    ------
    DataError
        If no known class has this name.
    NotPlainError
        If a field is missing or damaged.

    Examples
    --------
    >>> from smid.sensors import CFPX
    >>> sensor_from_dict(sensor_to_dict(CFPX(order=3))).order
    3
    """
    kind = record.get("kind")
    made = _class_named(kind)
    if record.get("schema") != SENSOR or made is None:
        raise DataError(
            f"this is not a sensor, but kind {kind!r}, schema {record.get('schema')!r}: give a file that save_sensor "
            "wrote, and import the package that defines its class"
        )
    parts = {n: v for n, v in record.items() if isinstance(v, Mapping) and v.get("schema") == SENSOR}
    sensor: Sensor = fields_from_plain(made, record, **{name: sensor_from_dict(part) for name, part in parts.items()})
    return sensor


def save_sensor(sensor: Sensor, path: str | Path) -> None:
    """Write a sensor, trained or not, to a JSON file; `smid.load` reads it.

    Examples
    --------
    >>> import tempfile
    >>> from smid.sensors import CPX
    >>> file = Path(tempfile.mkdtemp()) / "sensor.json"
    >>> save_sensor(CPX(hidden=(5,)), file)
    >>> sensor_from_dict(json.loads(file.read_text())).n_parameters
    31
    """
    write_text(path, json.dumps(sensor_to_dict(sensor), indent=1) + "\n")
