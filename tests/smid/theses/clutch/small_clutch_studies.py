"""Clutch studies on few samples: seconds instead of minutes, computed once for all tests of a process."""

from functools import cache

import numpy as np

from smid.data.bundled import load_clutch
from smid.sensors import CFPX, PTX
from smid.theses.clutch.hammerstein_study import hammerstein_study
from smid.theses.clutch.sensor_chapter import SensorChapter
from smid.theses.clutch.sensor_study import (
    ErrorTable,
    SingleSensorStudy,
    cross_errors,
    interval_study,
    sensor_traces,
    table_5_3,
)
from smid.theses.clutch.set_study import set_study

PART = (2750, 2850)


@cache
def small_hammerstein_study():
    """The study on a fast falling ramp, validated on another ramp and on steps."""
    return hammerstein_study(load_clutch(("20C_ramp_a", "20C_ramp_b", "20C_step_a")), PART, orders=(1, 2))


@cache
def small_set_study():
    """The study on the first 1600 samples of two records."""
    records = load_clutch(("20C_ramp_a", "20C_step_b")).crop(0, 1600)
    return set_study(records, batch=300)


@cache
def small_sensor_chapter():
    """A chapter whose sensors are polynomials, which train at once; PTX is there for its number of parameters."""
    polynomials = {"CFPX20": 8, "CFPX20 order 3": 3}
    data = load_clutch("20C_step_a")
    sensors = {name: CFPX(order).fit(data, seed=1) for name, order in polynomials.items()}
    errors = ErrorTable("RMSE in mm.", ("CPX", "PTX"), ("20C_step_b",), np.array([[0.2, 0.1]]))
    single = SingleSensorStudy(PTX(), {}, errors, errors)
    intervals = interval_study(sensors["CFPX20"], ("20C_ramp_b", "20C_step_b"))
    return SensorChapter((table_5_3(),), cross_errors(sensors), {"5.14": sensor_traces("5.14")}, single, intervals)
