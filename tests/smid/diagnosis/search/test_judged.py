"""The last comparison after a search that was ended."""

import numpy as np

from smid.diagnosis import EFFECTS
from smid.diagnosis.search.effect_set import EffectSet
from smid.diagnosis.search.judged import judged
from smid.diagnosis.search.record import Record
from smid.diagnosis.search.trial import fitted_base, try_effect
from tests.smid.diagnosis.lag_records import LAG, dead_zone, lag, record, steps

BY_NAME = {effect.name: effect for effect in EFFECTS}


def test_an_effect_that_is_not_needed_drops_out_where_there_is_time() -> None:
    """The search ended before it had tried the dead zone without the bias."""
    u, used = steps(0, 300), (np.ones(300, bool),)
    data = record(u, lag(dead_zone(u, 0.4)))
    base = fitted_base(LAG, data, used, "u", "y")
    bias = try_effect(BY_NAME["sensor_bias"], base)
    assert bias is not None
    dead = try_effect(BY_NAME["input_dead_zone"], base.extended(bias))
    assert dead is not None
    sets = (EffectSet((), base.fit, base.errors), EffectSet((bias, dead), dead.fit, dead.errors))
    seen = Record(data, used, "u", "y")
    assert judged(seen, base, sets, EFFECTS)[0].names == ("input_dead_zone",)
