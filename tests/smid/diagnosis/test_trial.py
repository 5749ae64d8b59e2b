"""An effect tried on one model."""

import numpy as np
from lag_records import lag, record

from smid import OutputError
from smid.diagnosis.effects.sensor_bias import EFFECT
from smid.diagnosis.trial import Base, Trial, refit, try_effect
from smid.fit import fit


def _put_on(pole: float) -> tuple[Trial | None, Base]:
    """Fit a lag to the first 30 of 3000 samples of a plant with that pole, and put a sensor's bias on it twice."""
    u = np.random.default_rng(0).uniform(-1, 1, 3000)
    w = lag(u, pole)
    data = record(u, np.where(np.abs(w) < 1e6, w, 0.0))
    used = (np.arange(len(u)) < 30,)
    base = Base(fit(OutputError(), data, used), data, used, "u", "y")
    trial = try_effect(EFFECT, base)
    assert trial is not None
    return refit(EFFECT, trial, base), base


def test_an_effect_is_put_on_again() -> None:
    again, base = _put_on(0.8)
    assert base.fit.is_finite
    assert again is not None
    assert again.fit.is_finite


def test_what_runs_away_behind_the_fitted_part_is_not_put_on_again() -> None:
    again, base = _put_on(1.5)
    assert not base.fit.is_finite
    assert again is None
