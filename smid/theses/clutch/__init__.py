"""The clutch thesis: a simulated actuator, from current to pressure to position, and its records."""

from smid.theses.clutch.plant import ClutchPlant, clutch_record, ramp_current, simulate_clutch, step_current
from smid.theses.clutch.position import POSITION_NOISE_BOUND, ReturnSpring, simulate_position
from smid.theses.clutch.records import actuator_record

__all__ = [
    "POSITION_NOISE_BOUND",
    "ClutchPlant",
    "ReturnSpring",
    "actuator_record",
    "clutch_record",
    "ramp_current",
    "simulate_clutch",
    "simulate_position",
    "step_current",
]
