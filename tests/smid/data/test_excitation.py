import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import max_len_seq

from smid.data import DataError, Dataset, Experiment, excitation, require_excitation

T = np.arange(600)


@pytest.mark.parametrize("offset", [0.0, 3.0, 1e4])
@pytest.mark.parametrize("k", [1, 2, 3, 5])
def test_k_sines_excite_order_2k_whatever_their_mean_and_length(k, offset):
    frequencies = np.pi * (np.arange(k) + 0.7) / (k + 1)
    u = offset + sum(np.sin(w * T + j) for j, w in enumerate(frequencies))
    assert excitation(u).order == 2 * k
    assert excitation(u[:517]).order == 2 * k


@pytest.mark.parametrize("level", [0.0, 0.1, -7e5])
def test_a_constant_excites_nothing(level):
    found = excitation(np.full(100, level))
    assert found.order == 0
    assert found.conditions == (True, True, False)
    assert "3. positive definite      no " in str(found)


@pytest.mark.parametrize("bits", [3, 4, 5])
def test_prbs_excites_its_period_less_one(bits):
    period = 2**bits - 1
    u = np.tile(2.0 * max_len_seq(bits)[0] - 1, 8)
    assert excitation(u).order == period - 1
    assert excitation(u[: 5 * period + 3]).order == period - 1


def test_alternation_excites_order_one():
    assert excitation((-1.0) ** T).order == 1


def test_white_noise_excites_every_order():
    found = excitation(np.random.default_rng(0).normal(size=500), max_order=20)
    assert (found.order, found.max_order) == (20, 20)
    assert found.conditions == (True, True, True)
    assert "at least 20" in str(found)
    assert found.autocovariance[0] == pytest.approx(1, abs=0.2)
    assert np.max(np.abs(found.autocovariance[1:])) < 0.2


def test_tolerance_hides_small_noise():
    u = np.sin(0.8 * T) + 1e-5 * np.random.default_rng(0).normal(size=T.size)
    assert excitation(u).order == 50
    assert excitation(u, tolerance=1e-3).order == 2


def test_ramp_and_step_have_no_mean():
    for u in (T / 600, np.where(T < 300, 0.0, 1.0)):
        assert excitation(u).conditions[0] is False


def test_growing_amplitude_has_no_autocovariance():
    assert excitation(T * np.sin(0.7 * T)).conditions[1] is False
    burst = np.where(T < 300, 0.0, np.sin(0.7 * T))
    assert excitation(burst).variance_ratio == np.inf


@settings(deadline=None, max_examples=20)
@given(st.floats(1e-3, 1e3), st.floats(-1e3, 1e3))
def test_order_does_not_depend_on_the_unit(scale, offset):
    u = np.sin(0.9 * T) + np.sin(2.0 * T)
    assert excitation(scale * (u + offset)).order == 4


def test_short_records_tell_half_their_length():
    assert excitation([0.0, 1.0]).max_order == 1
    assert excitation(np.random.default_rng(0).normal(size=11)).max_order == 5


def test_experiments_excite_together():
    one, two = np.sin(0.5 * T), np.sin(1.5 * T[:200])
    assert excitation(one).order == excitation(two).order == 2
    assert excitation(one, two).order == 4
    # A short run beside a long one neither breaks nor counts.
    assert excitation(one, [0.0, 1.0, 0.0]).order == 2


@pytest.mark.parametrize(
    ("inputs", "message"),
    [
        (([1.0, np.nan],), "vector of finite numbers"),
        ((np.ones((3, 2)),), "vector of finite numbers"),
        (([1.0],), "no experiment has two samples"),
        ((), "no experiment has two samples"),
    ],
)
def test_bad_inputs(inputs, message):
    with pytest.raises(DataError, match=message):
        excitation(*inputs)
    with pytest.raises(DataError, match="max_order = 0"):
        excitation([1.0, 2.0], max_order=0)


def test_require_excitation_names_found_needed_and_cure():
    sine = Dataset.from_arrays(input=np.sin(0.4 * T), output=T, sampling_time=1)
    require_excitation(sine, 2)
    with pytest.raises(DataError, match=r"'input' excites order 2 but the model needs order 5; measure with"):
        require_excitation(sine, 5)
    other = Experiment("other", {"input": np.sin(1.4 * T), "output": T})
    require_excitation(sine.with_experiments([*sine.experiments, other]), 4)
    with pytest.raises(DataError, match="needs order 3"):
        require_excitation(sine.crop(0, 4), 3)
