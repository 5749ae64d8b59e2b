"""The parts of a set, which are compared with it, lack one of its effects."""

from dataclasses import replace

import numpy as np

from smid.diagnosis import EFFECTS
from smid.diagnosis.effects.effect import Detection
from smid.diagnosis.search.effect_set import EffectSet, reduced
from smid.diagnosis.search.trial import fitted_base, try_effect
from tests.smid.diagnosis.lag_records import LAG, dead_zone, lag, record, steps

BY_NAME = {effect.name: effect for effect in EFFECTS}


def test_of_a_set_with_noise_every_other_effect_is_left_out_too() -> None:
    """What another effect explained before the noise was known may be this noise."""
    u = steps(0, 300)
    data = record(u, lag(dead_zone(u, 0.4)) + 0.15)
    base = fitted_base(LAG, data, (np.ones(300, bool),), "u", "y")
    first = try_effect(BY_NAME["input_dead_zone"], base)
    assert first is not None
    second = try_effect(BY_NAME["sensor_bias"], base.extended(first))
    assert second is not None
    noise = (BY_NAME["input_noise"], Detection(second.fit.model, {}, 0.9, {}))
    both = EffectSet((first, second), second.fit, second.errors, noise)
    parts = [part.names for part in reduced(both, base, BY_NAME, {})]
    assert parts == [("input_dead_zone", "sensor_bias"), ("sensor_bias",), ("input_dead_zone",)]


def test_a_part_has_the_variants_of_the_set_where_they_fit_better() -> None:
    """Alone, the dead zone was tried in another variant, which does nothing."""
    u = steps(0, 300)
    base = fitted_base(LAG, record(u, lag(dead_zone(u, 0.4)) + 0.15), (np.ones(300, bool),), "u", "y")
    first = try_effect(BY_NAME["input_dead_zone"], base)
    assert first is not None
    second = try_effect(BY_NAME["sensor_bias"], base.extended(first))
    assert second is not None
    alone = EffectSet((replace(first, label="another"),), base.fit, base.errors)
    found = reduced(EffectSet((first, second), second.fit, second.errors), base, BY_NAME, {alone.names: alone})
    (part,) = (one for one in found if one.names == alone.names)
    assert [trial.label for trial in part.trials] == [first.label]
    assert part.fit.cost <= first.fit.cost * (1 + 1e-6)
