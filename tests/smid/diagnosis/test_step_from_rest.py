"""A record that begins at its only step: the input is constant, and the output goes from rest to another level."""

import numpy as np
import pytest
from scipy.signal import lfilter

from smid import DataError, identify
from smid.diagnosis import diagnose
from tests.smid.diagnosis.lag_records import BOUND, LAG, lag, record

LEVEL = np.full(300, 1.5)


def test_a_second_lag_shows_in_a_step_from_rest():
    """The two lags are slow, so that the test part still moves."""
    slow = lfilter([0.0, 0.02], [1.0, -0.98], lfilter([0.0, 0.03], [1.0, -0.97], LEVEL))
    effects = ["extra_lag", "sensor_bias", "input_dead_zone", "input_delay"]
    found = diagnose(LAG, record(LEVEL, slow), BOUND, effects, certify=False, workers=1)
    assert [c.effect for c in found.causes] == ["extra_lag"]
    assert found.gain.rmse_after < 0.25 * found.gain.rmse_before
    assert [fault.kind for fault in found.faults] == ["excitation"]


@pytest.mark.parametrize("level", [1.5, -1.5e6])
def test_a_step_that_the_model_explains_names_nothing(level):
    held = np.full(300, level)
    found = diagnose(LAG, record(held, lag(held, 0.97), bound=abs(level) / 75), workers=1)
    assert found.verdict == "none"
    assert found.failed == ()


def test_an_output_that_comes_back_was_moved_by_something_else():
    pulses = np.where(np.arange(300) % 80 < 40, 1.0, 0.0)
    with pytest.raises(DataError, match="'u' does not excite"):
        diagnose(LAG, record(LEVEL, lag(pulses)), BOUND, ["sensor_bias"], workers=1)


def test_identify_refuses_it_as_before():
    with pytest.raises(DataError, match="'u' does not excite"):
        identify(LAG, record(LEVEL, lag(LEVEL, 0.97)), BOUND)
