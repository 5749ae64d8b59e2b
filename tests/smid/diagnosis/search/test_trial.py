"""An effect tried on one model."""

import numpy as np
import pytest

from benchmarks.blind.cases import draw
from smid import Hammerstein, OutputError
from smid.diagnosis.effects.input_dead_zone import EFFECT as ZONE
from smid.diagnosis.effects.input_delay import EFFECT as DELAY
from smid.diagnosis.effects.sensor_bias import EFFECT
from smid.diagnosis.search.trial import Base, Trial, fitted_base, refit, try_effect
from tests.smid.diagnosis.lag_records import lag, record


def _put_on(pole: float) -> tuple[Trial | None, Base]:
    """Fit a lag to the first 30 of 3000 samples of a plant with that pole, and put its sensor's bias on it twice."""
    u = np.random.default_rng(0).uniform(-1, 1, 3000)
    w = lag(u, pole)
    data = record(u, np.where(np.abs(w) < 1e6, w, 0.0) + 1.0)
    used = (np.arange(len(u)) < 30,)
    base = fitted_base(OutputError(), data, used, "u", "y")
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


def test_part_of_a_sample_later_behind_a_curve_is_exact() -> None:
    """An input held between samples comes late to the lag, not to the curve before it: its cube is late."""
    late, tau, bound = 0.4, 2.0, 1e-3
    u = np.repeat(np.random.default_rng(0).uniform(-1, 1, 100), 3)
    x = u**3
    old, pole = np.exp(-(1 - late) / tau) - np.exp(-1 / tau), np.exp(-1 / tau)
    w = np.zeros(300)
    for k in range(1, 300):  # the exact solution of tau w' + w = x, held, `late` samples later
        w[k] = pole * w[k - 1] + old * x[max(k - 2, 0)] + (1 - pole - old) * x[k - 1]
    data = record(u, w, bound=bound)
    used = (np.ones(300, bool),)
    model = Hammerstein(powers=(3,), stable=True)
    trial = try_effect(DELAY, fitted_base(model, data, used, "u", "y"))
    assert trial is not None
    assert trial.values["delay_samples"] == pytest.approx(old / (1 - pole), abs=0.01)
    assert max(np.abs(e).max() for e in trial.fit.residual(data, "y")) < 1.1 * bound


def test_a_fit_of_the_whole_that_is_ahead_after_a_few_steps_takes_no_place_of_a_better_one() -> None:
    case = draw(120044, 1, 1000)
    base = fitted_base(case.model, case.data.crop(0, 800), (np.ones(800, bool),), "u", "y")
    trial = try_effect(ZONE, base)
    assert trial is not None
    assert trial.values == pytest.approx({"dead_zone_upper": 0.283, "dead_zone_lower": -0.137}, abs=0.001)
