"""Virtual sensors of the clutch's position: those of the thesis, and one for all temperatures and hysteresis."""

from smid.sensors.bounded import (
    BoundedSensor,
    IntervalEstimate,
    IntervalPrediction,
    IntervalStream,
    bound_error,
)
from smid.sensors.cfpx import CFPX
from smid.sensors.cpx import CPX
from smid.sensors.dead_zone import DeadZone
from smid.sensors.files import load_sensor, save_sensor, sensor_from_dict, sensor_to_dict
from smid.sensors.median_filtered import MedianFiltered
from smid.sensors.prediction import Prediction
from smid.sensors.ptx import PTX
from smid.sensors.px import PX
from smid.sensors.sensor import VirtualSensor
from smid.sensors.stream import Estimate, Stream

__all__ = [
    "CFPX",
    "CPX",
    "PTX",
    "PX",
    "BoundedSensor",
    "DeadZone",
    "Estimate",
    "IntervalEstimate",
    "IntervalPrediction",
    "IntervalStream",
    "MedianFiltered",
    "Prediction",
    "Stream",
    "VirtualSensor",
    "bound_error",
    "load_sensor",
    "save_sensor",
    "sensor_from_dict",
    "sensor_to_dict",
]
