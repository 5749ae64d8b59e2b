"""The 99 % bands hold what they say, and a missed delay lies outside them."""

import numpy as np
import pytest
from scipy.signal import lfilter

from smid.validation.correlation import autocorrelation, cross_correlation

RUNS = 200


def shares(make):
    """Return the shares of lags outside the bands over many records: own past, and input."""
    found = [make(np.random.default_rng(seed)) for seed in range(RUNS)]
    own = np.mean([autocorrelation([e]).outside.mean() for e, _ in found])
    return own, np.mean([cross_correlation([e], [u], "u").outside.mean() for e, u in found])


def test_white_noise_is_inside_99_times_in_100():
    own, with_input = shares(lambda random: (random.standard_normal(600), random.standard_normal(600)))
    assert own == pytest.approx(0.01, abs=0.004)
    assert with_input == pytest.approx(0.01, abs=0.004)


def test_a_slow_error_is_not_taken_for_one_that_follows_a_slow_input():
    def slow(random):
        return tuple(lfilter([1], [1, -0.8], random.standard_normal(900)) for _ in range(2))

    own, with_input = shares(slow)
    assert own > 0.2, "its own past explains it"
    assert with_input == pytest.approx(0.01, abs=0.012)


def test_a_missed_delay_is_outside_where_it_is():
    random = np.random.default_rng(0)
    u = random.standard_normal(600)
    late = np.concatenate([np.zeros(4), u[:-4]])
    error = 0.3 * (late - u) + 0.1 * random.standard_normal(600)  # the model acts at once
    found = cross_correlation([error], [u], "u")
    outside = set(found.lags[found.outside])
    assert {0, 4} <= outside
    assert len(outside) <= 4
    assert dict(zip(found.lags, found.values, strict=True))[4] > 0.5


def test_stretches_are_not_joined():
    """The end of one has nothing to do with the start of the next."""
    random = np.random.default_rng(0)
    parts = [random.standard_normal(n) for n in (150, 90, 12)]
    centred = [e - np.concatenate(parts).mean() for e in parts]
    expected = sum(float(e[1:] @ e[:-1]) for e in centred) / sum(float(e @ e) for e in centred)
    assert autocorrelation(parts).values[0] == pytest.approx(expected)


def test_nothing_is_told_of_a_constant():
    assert autocorrelation([np.zeros(100)]) is None
    assert cross_correlation([np.arange(100.0)], [np.ones(100)], "u") is None
    assert autocorrelation([np.ones(3)]) is None
