"""An effect that was put on first chooses its variant again beside what came later."""

import numpy as np

from benchmarks.blind.cases import draw
from smid.diagnosis import EFFECTS
from smid.diagnosis.search.effect_set import EffectSet, reopened
from smid.diagnosis.search.trial import fitted_base, try_effect
from smid.fitting.binding import bind

BY_NAME = {effect.name: effect for effect in EFFECTS}


def test_the_order_in_which_two_effects_were_put_on_does_not_matter() -> None:
    """Without the bias, the second mass is put on without its play."""
    case = draw(70100, 2)
    model = bind(case.model, case.data)
    base = fitted_base(model, case.data, (np.arange(1000) < 800,), model.input_channels[0], model.output_channels[0])
    found = []
    for order in (case.truth, case.truth[::-1]):
        trials, grown = [], base
        for name in order:
            trial = try_effect(BY_NAME[name], grown)
            assert trial is not None
            grown = grown.extended(trial)
            trials.append(trial)
        found.append(EffectSet(tuple(trials), grown.fit, grown.errors))
    costs = sorted(one.fit.cost for one in found)
    assert costs[1] > 10 * costs[0]
    again = [reopened(one, base, BY_NAME).fit.cost for one in found]
    np.testing.assert_allclose(again, costs[0], rtol=1e-3)
