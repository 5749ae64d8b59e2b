"""The clutch thesis: a simulated actuator that its Hammerstein model cannot follow."""

from smid.clutch.plant import ClutchPlant, clutch_record, ramp_current, simulate_clutch, step_current

__all__ = ["ClutchPlant", "clutch_record", "ramp_current", "simulate_clutch", "step_current"]
