"""What an extended model gains, against its definition: by hand, and on the test part of a diagnosis."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from smid.diagnosis import diagnose
from smid.diagnosis.gain import gain
from tests.smid.diagnosis.lag_records import BOUND, LAG, lag, record, steps


def test_by_hand():
    measured = [np.array([0.0, 2.0]), np.array([10.0, 14.0])]  # about their means: -1, 1, -2, 2
    found = gain(measured, [np.array([1.0, -1.0]), np.array([3.0, -3.0])], [np.zeros(2), np.array([0.0, 2.0])], 1.0)
    assert (found.rmse_before, found.rmse_after) == (pytest.approx(np.sqrt(5)), 1.0)
    assert found.fit_percent_before == pytest.approx(100 * (1 - np.sqrt(5 / 2.5)))
    assert found.fit_percent_after == pytest.approx(100 * (1 - np.sqrt(1 / 2.5)))
    assert (found.noise_bound_before, found.noise_bound_after) == (3.0, 2.0)
    assert (found.violations_before, found.violations_after) == (2, 1)  # an error of just the bound is none
    assert found.samples == 4


def test_what_is_not_given_or_not_defined_is_none():
    found = gain([np.full(3, 5.0)], [np.ones(3)], [np.zeros(3)], None)
    assert (found.violations_before, found.violations_after) == (None, None)
    assert (found.fit_percent_before, found.fit_percent_after) == (None, None)


@settings(max_examples=25, deadline=None, derandomize=True)
@given(seed=st.integers(0, 1000), scale=st.floats(1e-3, 1e3))
def test_figures_scale_with_the_unit(seed, scale):
    random = np.random.default_rng(seed)
    measured, before, after = ([random.normal(size=20)] for _ in range(3))
    plain = gain(measured, before, after, 1.0)
    scaled = gain(*([scale * x for x in part] for part in (measured, before, after)), scale)
    assert scaled.rmse_after == pytest.approx(scale * plain.rmse_after)
    assert scaled.noise_bound_before == pytest.approx(scale * plain.noise_bound_before)
    assert scaled.fit_percent_after == pytest.approx(plain.fit_percent_after)
    assert scaled.violations_after == plain.violations_after


@pytest.mark.parametrize("test", [0.3, 0.5])
def test_the_gain_of_a_diagnosis_is_over_the_end_that_no_fit_saw(test):
    u = steps(1)
    data = record(u, lag(u) + 0.4)
    diagnosis = diagnose(LAG, data, BOUND, ["sensor_bias"], test, certify=False, workers=1)
    n = len(u)
    (held,) = diagnosis.test
    assert np.array_equal(np.flatnonzero(held), np.arange(round((1 - test) * n), n))
    measured = data.values("y")
    before, after = measured - diagnosis.simulated[0], measured - diagnosis.extended[0]
    assert diagnosis.gain == gain([measured[held]], [before[held]], [after[held]], BOUND)
    assert diagnosis.gain.rmse_before == pytest.approx(np.sqrt(np.mean(before[held] ** 2)))
    assert diagnosis.gain.violations_before == (np.abs(before[held]) > BOUND).sum()
    assert diagnosis.gain.violations_before > 10 * diagnosis.gain.violations_after
    # What is held out has no say: with another end the fit is the same, to the tolerance at which it stops.
    other = np.where(held, measured + 5.0, measured)
    spoilt = diagnose(LAG, record(u, other, bound=0.0), BOUND, ["sensor_bias"], test, certify=False, workers=1)
    assert spoilt.base.values == pytest.approx(diagnosis.base.values, rel=1e-3)
