"""The effects: causes that a model may lack, each in one file, each a rewrite of a symbolic model.

To add one to the package, write a file with ``EFFECT = Effect(...)`` and a line here. An effect of your own needs no
edit: give it to `diagnose`. `check_effect` checks it.
"""

from smid.diagnosis.effects import (
    coulomb_friction,
    direction_dependence,
    elastic_coupling,
    extra_lag,
    gain,
    hysteresis,
    input_backlash,
    input_curve,
    input_dead_zone,
    input_delay,
    input_noise,
    input_saturation,
    load_friction,
    missing_input,
    operating_point,
    outliers,
    output_curve,
    output_saturation,
    parameter_change,
    parameter_drift,
    periodic_disturbance,
    power_law,
    quadratic_drag,
    quantisation,
    rate_limit,
    resonance,
    scheduled_parameter,
    sensor_bias,
    sensor_drift,
    sensor_lag,
    stribeck_friction,
    time_constant,
    variable_delay,
    viscous_friction,
)
from smid.diagnosis.effects.check import check_effect
from smid.diagnosis.effects.effect import Effect, Extension, Site

__all__ = ["EFFECTS", "Effect", "Extension", "Site", "check_effect"]

EFFECTS: tuple[Effect, ...] = (
    input_dead_zone.EFFECT,
    input_saturation.EFFECT,
    input_backlash.EFFECT,
    input_curve.EFFECT,
    input_delay.EFFECT,
    variable_delay.EFFECT,
    rate_limit.EFFECT,
    input_noise.EFFECT,
    gain.EFFECT,
    time_constant.EFFECT,
    extra_lag.EFFECT,
    resonance.EFFECT,
    elastic_coupling.EFFECT,
    power_law.EFFECT,
    operating_point.EFFECT,
    direction_dependence.EFFECT,
    parameter_change.EFFECT,
    parameter_drift.EFFECT,
    scheduled_parameter.EFFECT,
    missing_input.EFFECT,
    coulomb_friction.EFFECT,
    stribeck_friction.EFFECT,
    load_friction.EFFECT,
    viscous_friction.EFFECT,
    quadratic_drag.EFFECT,
    hysteresis.EFFECT,
    output_curve.EFFECT,
    output_saturation.EFFECT,
    sensor_bias.EFFECT,
    sensor_drift.EFFECT,
    sensor_lag.EFFECT,
    outliers.EFFECT,
    quantisation.EFFECT,
    periodic_disturbance.EFFECT,
)
"""All effects that ship, in the order in which they are documented."""
