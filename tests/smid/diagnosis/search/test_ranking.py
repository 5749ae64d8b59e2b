"""Which set leads: with a noise bound, no set whose error cannot be the noise."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.blind.cases import draw
from smid.diagnosis import EFFECTS
from smid.diagnosis.search import noise_model
from smid.diagnosis.search.effect_set import EffectSet
from smid.diagnosis.search.ranking import Ranking
from smid.diagnosis.search.record import Record
from smid.diagnosis.search.trial import fitted_base, try_effect
from smid.fitting.binding import bind


def test_a_drift_is_no_noise_where_the_noise_bound_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    # Without a bound, and if laws could leave nothing, the slow drift of this sensor may as well be a random walk.
    monkeypatch.setattr(noise_model, "DISCREPANCY", 0.0)
    case = draw(71019, 3, 1000)
    model = bind(case.model, case.data)
    used = (np.arange(1000) < 800,)
    channels = model.input_channels[0], model.output_channels[0]
    base = fitted_base(model, case.data, used, *channels)
    trial = try_effect(next(e for e in EFFECTS if e.name == "sensor_drift"), base)
    assert trial is not None
    sets = [EffectSet((), base.fit, base.errors), EffectSet((trial,), trial.fit, trial.errors)]
    free = Record(case.data, used, *channels)
    for record, leader in ((free, ()), (replace(free, noise_bound=case.noise_bound), ("sensor_drift",))):
        ranking = Ranking(record, base.errors, len(EFFECTS))
        ranking.rank(sets[:1])  # as the search begins
        assert ranking.rank(sets)[0].names == leader


def test_of_tied_variants_the_one_with_the_largest_merit_leads() -> None:
    case = draw(92010, 1, 1000)  # a sensor's lag
    model = bind(case.model, case.data)
    used = (np.arange(1000) < 800,)
    channels = model.input_channels[0], model.output_channels[0]
    base = fitted_base(model, case.data, used, *channels)
    by_name = {effect.name: effect for effect in EFFECTS}
    lag, bias = (try_effect(by_name[name], base) for name in ("sensor_lag", "sensor_bias"))
    assert lag is not None
    assert bias is not None
    # Two variants of one effect, as the search finds them: here the one that fits worse stands first.
    better, worse = (
        EffectSet((lag,), lag.fit, lag.errors),
        EffectSet((replace(bias, effect="sensor_lag"),), bias.fit, bias.errors),
    )
    plain = EffectSet((), base.fit, base.errors)
    ranking = Ranking(Record(case.data, used, *channels), base.errors, len(EFFECTS))
    first, second = ranking.rank([plain, replace(worse, tied=(better,))])
    assert first.effects.fit is lag.fit
    assert [one.fit for one in first.effects.tied] == [bias.fit]
    assert second.effects is plain
    # What leads stays the same set, and nothing is computed again.
    again, _ = ranking.rank([plain, first.effects])
    assert again == first
