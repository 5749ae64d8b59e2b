"""Virtual sensors of the clutch's position: those of the thesis, and one for all temperatures and hysteresis."""

from smid.clutch.virtual_sensors.bounded import (
    BoundedSensor,
    IntervalEstimate,
    IntervalPrediction,
    IntervalStream,
    bound_error,
)
from smid.clutch.virtual_sensors.cfpx import CFPX
from smid.clutch.virtual_sensors.cpx import CPX
from smid.clutch.virtual_sensors.dead_zone import DeadZone
from smid.clutch.virtual_sensors.files import load_sensor, save_sensor, sensor_from_dict, sensor_to_dict
from smid.clutch.virtual_sensors.median_filtered import MedianFiltered
from smid.clutch.virtual_sensors.prediction import Prediction
from smid.clutch.virtual_sensors.ptx import PTX
from smid.clutch.virtual_sensors.px import PX
from smid.clutch.virtual_sensors.sensor import VirtualSensor
from smid.clutch.virtual_sensors.stream import Estimate, Stream

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
