"""The virtual sensors of chapter 5 of the clutch thesis on the bundled records, and one sensor for all temperatures."""

from smid.theses.clutch.sensor_study.cross import ErrorTable, cross_errors
from smid.theses.clutch.sensor_study.foreign import ForeignRow, ForeignStudy, foreign_study
from smid.theses.clutch.sensor_study.intervals import IntervalRow, IntervalStudy, interval_study
from smid.theses.clutch.sensor_study.sensors import THESIS_SENSORS, train_thesis_sensors
from smid.theses.clutch.sensor_study.single_sensor import (
    HELD_OUT,
    TRAINING,
    SingleSensorStudy,
    single_sensor_study,
    train_single_sensor,
)
from smid.theses.clutch.sensor_study.structures import (
    StructureRow,
    StructureTable,
    table_5_1,
    table_5_2,
    table_5_3,
    table_5_4,
)
from smid.theses.clutch.sensor_study.traces import THESIS_FIGURES, SensorTraces, sensor_traces

__all__ = [
    "HELD_OUT",
    "THESIS_FIGURES",
    "THESIS_SENSORS",
    "TRAINING",
    "ErrorTable",
    "ForeignRow",
    "ForeignStudy",
    "IntervalRow",
    "IntervalStudy",
    "SensorTraces",
    "SingleSensorStudy",
    "StructureRow",
    "StructureTable",
    "cross_errors",
    "foreign_study",
    "interval_study",
    "sensor_traces",
    "single_sensor_study",
    "table_5_1",
    "table_5_2",
    "table_5_3",
    "table_5_4",
    "train_single_sensor",
    "train_thesis_sensors",
]
