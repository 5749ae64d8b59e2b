"""The running medians are those of the definition, and of scipy."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import median_filter
from scipy.signal import medfilt

from smid.data import DataError
from smid.data.bundled import load_clutch
from smid.models import ModelError
from smid.sensors import CFPX, MedianFiltered
from smid.sensors.median import Median, centred_median


def causal_median(x, order):
    return Median(order).advance([x], np.zeros(0))[0]


SIGNALS = st.lists(st.floats(-5, 5) | st.integers(0, 2).map(float), min_size=1, max_size=60)


@given(SIGNALS, st.integers(1, 60))
def test_medians_are_those_of_their_windows(signal, order):
    x = np.array(signal)
    order = min(order, x.size)
    centred = [np.median(x[max(0, t - order // 2) : t + order - order // 2]) for t in range(x.size)]
    np.testing.assert_array_equal(centred_median(x, order), centred)
    causal = [np.median(x[max(0, t - order + 1) : t + 1]) for t in range(x.size)]
    np.testing.assert_array_equal(causal_median(x, order), causal)


@pytest.mark.parametrize("order", [3, 51, 251])
def test_odd_orders_agree_with_scipy(order):
    x = np.random.default_rng(order).normal(size=1000)
    inside = slice(order // 2, -(order // 2))
    np.testing.assert_array_equal(centred_median(x, order)[inside], median_filter(x, order)[inside])
    np.testing.assert_array_equal(centred_median(x, order)[inside], medfilt(x, order)[inside])


@pytest.mark.parametrize("order", [50, 250])
def test_the_orders_of_the_thesis_lie_between_scipys_two_ranks(order):
    # Of an even window scipy takes the upper of the middle two; the lower is that of the signal turned over.
    x = np.random.default_rng(order).normal(size=1000)
    inside = slice(order // 2, -(order // 2))
    upper, lower = median_filter(x, order)[inside], -median_filter(-x, order)[inside]
    np.testing.assert_allclose(centred_median(x, order)[inside], 0.5 * (upper + lower), rtol=1e-12)


@pytest.mark.parametrize("order", [7, 50, 250])
def test_the_causal_median_is_late_by_what_it_states(order):
    rise = np.arange(1000.0)
    late = rise[order:] - causal_median(rise, order)[order:]
    np.testing.assert_array_equal(late, MedianFiltered(CFPX(), order, causal=True).delay)
    glitch = np.zeros(1000)
    glitch[400 : 400 + (order - 1) // 2] = 9.0
    assert causal_median(glitch, order).max() == 0.0


def test_the_delay_in_milliseconds():
    sensor = CFPX(3).fit(load_clutch("20C_step_a"), seed=1)
    assert MedianFiltered(sensor, 50, causal=True).delay_ms == pytest.approx(49.0)
    assert MedianFiltered(sensor, 250, causal=True).delay_ms == pytest.approx(249.0)
    assert MedianFiltered(sensor, 250).delay_ms == 0.0


def test_a_median_longer_than_the_record():
    data = load_clutch("20C_step_a").crop(200, 240)
    sensor = MedianFiltered(CFPX(3), 50).fit(data, seed=1)
    with pytest.raises(DataError, match="order 50 is longer than the record of 40 samples"):
        sensor.predict(data)


def test_a_centred_median_cannot_stream():
    sensor = MedianFiltered(CFPX(3)).fit(load_clutch("20C_step_a").crop(200, 300), seed=1)
    with pytest.raises(ModelError, match="future samples: take causal=True"):
        sensor.stream()


@pytest.mark.parametrize("order", [0, 2.5])
def test_no_order(order):
    with pytest.raises(ModelError, match=f"order = {order} of the median"):
        MedianFiltered(CFPX(3), order)
