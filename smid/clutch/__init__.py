"""The clutch thesis: a simulated actuator, from current to pressure to position, and its records."""

from smid.clutch.plant import ClutchPlant, clutch_record, ramp_current, simulate_clutch, step_current
from smid.clutch.position import POSITION_NOISE_BOUND, ReturnSpring, simulate_position
from smid.clutch.records import CLUTCH_RECORDS, actuator_record, load_clutch_records

__all__ = [
    "CLUTCH_RECORDS",
    "POSITION_NOISE_BOUND",
    "ClutchPlant",
    "ReturnSpring",
    "actuator_record",
    "clutch_record",
    "load_clutch_records",
    "ramp_current",
    "simulate_clutch",
    "simulate_position",
    "step_current",
]
