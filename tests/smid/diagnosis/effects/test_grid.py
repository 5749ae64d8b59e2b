"""Starts from a grid: several where a thing sticks, the best one, not refined, where nothing does; none unasked."""

import numpy as np
import pytest

from smid import OutputError
from smid.diagnosis.effects import valve_stiction
from smid.diagnosis.search.trial import fitted_base, refit, try_effect
from tests.smid.diagnosis.lag_records import lag, record, steps

N = 400


def stuck(u, band, jump):
    """Return what a valve makes of a command, by He's model (see `valve_stiction`)."""
    static, sliding = (band + jump) / 2, (band - jump) / 2
    left, valve = 0.0, []
    for now, last in zip(u, [u[0], *u[:-1]], strict=True):
        pull = left + now - last
        left = pull if abs(pull) <= static else sliding * np.sign(pull)
        valve.append(now - left)
    return np.array(valve)


def based(sticks):
    """Return a fitted lag, with a record whose valve sticks or does not."""
    u = np.cumsum(np.random.default_rng(3).normal(size=N)) + steps(0, N)
    noise = 0.02 * np.random.default_rng(4).normal(size=N)
    data = record(u, lag(stuck(u, 3.0, 1.5) if sticks else u) + noise, bound=0.0)
    return fitted_base(OutputError(), data, (np.ones(N, bool),), "u", "y")


@pytest.mark.parametrize("sticks", [True, False])
def test_starts_are_spent_where_the_grid_promises_something(sticks):
    base = based(sticks)
    (extension,) = valve_stiction.EFFECT.extensions(base.fit.model, base.site())
    assert len(extension.starts) == (3 if sticks else 1)
    jump, sliding = (next(iter(extension.starts))[name] for name in ("slip_jump", "sliding_friction"))
    assert not sticks or (jump, sliding) == pytest.approx((1.5, 0.75), rel=0.1)


def test_an_effect_that_is_fitted_again_from_known_values_searches_no_grid(monkeypatch):
    base = based(True)
    trial = try_effect(valve_stiction.EFFECT, base)
    monkeypatch.setattr(valve_stiction, "best_of", lambda *_: pytest.fail("the grid is searched"))
    again = refit(valve_stiction.EFFECT, trial, base, trial.fit.model.values)
    assert again.fit.cost == pytest.approx(trial.fit.cost, rel=1e-6)
