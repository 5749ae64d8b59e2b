"""Virtual sensors: those of the clutch thesis, and one with temperature and hysteresis, for channels of any name.

To add a sensor from another package, subclass `VirtualSensor` as a frozen dataclass. `save_sensor` and `smid.load`
find the class by its name and read each field as its annotation says (numbers, tuples, arrays, networks, dataclasses,
sensors). No file of this package changes::

    @dataclass(frozen=True, eq=False)
    class MySensor(VirtualSensor):
        slope: float | None = None
        trained_on: TrainedOn | None = None
        ...                                     # channels, output, n_parameters, fit, program

If files may be read before the class is imported, offer the class as an entry point::

    [project.entry-points."smid.sensors"]
    MySensor = "my_package:MySensor"
"""

from smid.sensors.bounded import (
    BoundedSensor,
    IntervalPrediction,
    bound_error,
)
from smid.sensors.certified import TrainedRange, trained_range
from smid.sensors.cfpx import CFPX
from smid.sensors.check import SensorCheck, SensorScore, check_sensor
from smid.sensors.choose import Candidate, SensorTraining, train_sensor
from smid.sensors.cpx import CPX
from smid.sensors.dead_zone import DeadZone
from smid.sensors.export import export_c
from smid.sensors.export_onnx import export_onnx
from smid.sensors.files import save_sensor, sensor_from_dict, sensor_to_dict
from smid.sensors.median_filtered import MedianFiltered
from smid.sensors.prediction import Prediction
from smid.sensors.program import Block, Code, Program
from smid.sensors.ptx import PTX
from smid.sensors.px import PX
from smid.sensors.sensor import VirtualSensor
from smid.sensors.stream import Estimate, Stream
from smid.sensors.trained_on import TrainedOn

__all__ = [
    "CFPX",
    "CPX",
    "PTX",
    "PX",
    "Block",
    "BoundedSensor",
    "Candidate",
    "Code",
    "DeadZone",
    "Estimate",
    "IntervalPrediction",
    "MedianFiltered",
    "Prediction",
    "Program",
    "SensorCheck",
    "SensorScore",
    "SensorTraining",
    "Stream",
    "TrainedOn",
    "TrainedRange",
    "VirtualSensor",
    "bound_error",
    "check_sensor",
    "export_c",
    "export_onnx",
    "save_sensor",
    "sensor_from_dict",
    "sensor_to_dict",
    "train_sensor",
    "trained_range",
]
