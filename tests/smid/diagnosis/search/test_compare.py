"""Telling better from chance: the bootstrap's level and power, correlation lengths, and what is white."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from smid.diagnosis.search.compare import chance, correlation_length, rms, structure
from tests.smid.diagnosis.lag_records import autoregressive

DRAWS = 200


def draws(n, pole, shared=1.0, better=1.0):
    """Pairs of residuals that share a part and differ in another of the same law, unless one is better."""
    for seed in range(DRAWS):
        random = np.random.default_rng(seed)
        common, first, second = (autoregressive(random, n, pole) for _ in range(3))
        yield seed, [shared * common + first], [shared * common + better * second]


# The length of a block is estimated too, from few independent samples where the noise is slow: hence 6 % there.
@pytest.mark.parametrize(("pole", "most"), [(0.0, 0.03), (0.5, 0.03), (0.8, 0.06), (0.9, 0.08)])
def test_what_is_chance_is_seldom_taken_for_a_gain(pole, most):
    share = np.mean([chance(first, second, seed) <= 0.01 for seed, first, second in draws(300, pole)])
    assert share <= most


def test_many_short_experiments_are_judged_alike():
    low = 0
    for seed in range(DRAWS):
        random = np.random.default_rng(seed)
        first, second = ([autoregressive(random, 40, 0.5) for _ in range(6)] for _ in range(2))
        low += chance(first, second, seed) <= 0.01
    assert low / DRAWS <= 0.04


@pytest.mark.parametrize("pole", [0.0, 0.5, 0.8])
def test_a_gain_that_is_there_is_seen(pole):
    share = np.mean([chance(first, second, seed) <= 0.01 for seed, first, second in draws(300, pole, 1.0, 0.2)])
    assert share >= 0.8


def test_correlated_blocks_are_kept_together():
    """Drawn sample by sample, the same data would be taken for a gain far more often."""
    kept, torn = 0, 0
    for seed, (first,), (second,) in draws(300, 0.9, 0.0):
        kept += chance([first], [second], seed) <= 0.01
        single = np.random.default_rng(seed).choice(first**2 - second**2, size=(500, 300)).mean(axis=1)
        torn += np.mean(single <= 0) <= 0.01
    assert torn > 2 * kept


@pytest.mark.parametrize("pole", [0.0, 0.3, 0.6, 0.8, 0.9])
def test_correlation_length_of_an_autoregression_is_its_formula(pole):
    lengths = [correlation_length([autoregressive(np.random.default_rng(seed), 20_000, pole)]) for seed in range(20)]
    assert np.median(lengths) == pytest.approx((1 + pole) / (1 - pole), rel=0.06)


def test_correlation_length_of_an_alternating_residual_is_one():
    assert correlation_length([np.tile([1.0, -1.0], 50)]) == 1.0
    assert correlation_length([np.zeros(50)]) == 1.0


@pytest.mark.parametrize("n", [60, 90, 200, 1000])
def test_white_noise_has_no_structure_on_average(n):
    """Also in short records, where each autocorrelation differs from zero by chance."""
    found = [structure([np.random.default_rng(seed).standard_normal(n)]) for seed in range(DRAWS)]
    assert np.median(found) < 0.02
    assert np.mean(np.array(found) > 0.2) <= 0.02


@pytest.mark.parametrize("pole", [0.5, 0.8])
def test_structure_of_an_autoregression_is_its_formula(pole):
    found = [structure([autoregressive(np.random.default_rng(seed), 5000, pole)]) for seed in range(10)]
    # The sum of pole^(2k) is p^2 / (1 - p^2); as a share of it and one that is p^2.
    assert np.median(found) == pytest.approx(pole**2, rel=0.06)


def test_structure_needs_a_past():
    assert structure([np.arange(20.0)]) == 0.0
    assert structure([np.full(200, 3.0)]) == 0.0


@settings(max_examples=25, deadline=None, derandomize=True)
@given(seed=st.integers(0, 1000), scale=st.floats(1e-6, 1e6), pole=st.floats(0, 0.9))
def test_units_do_not_matter(seed, scale, pole):
    random = np.random.default_rng(seed)
    first, second = ([autoregressive(random, n, pole) for n in (80, 120)] for _ in range(2))
    scaled = [scale * r for r in first], [scale * r for r in second]
    assert correlation_length(scaled[0]) == pytest.approx(correlation_length(first))
    assert structure(scaled[0]) == pytest.approx(structure(first), abs=1e-9)
    assert rms(scaled[0]) == pytest.approx(scale * rms(first))
    assert chance(*scaled) == pytest.approx(chance(first, second), abs=0.002)


@settings(max_examples=25, deadline=None, derandomize=True)
@given(seed=st.integers(0, 1000), order=st.permutations(range(4)))
def test_the_order_of_experiments_does_not_matter(seed, order):
    random = np.random.default_rng(seed)
    first, second = ([autoregressive(random, n, 0.5) for n in (60, 80, 100, 150)] for _ in range(2))
    turned = [[r[k] for k in order] for r in (first, second)]
    assert correlation_length(turned[0]) == pytest.approx(correlation_length(first))
    assert structure(turned[0]) == pytest.approx(structure(first), abs=1e-12)
    assert rms(turned[0]) == pytest.approx(rms(first))
    assert chance(*turned) == pytest.approx(chance(first, second), abs=0.05)  # other blocks are drawn


@settings(max_examples=25, deadline=None, derandomize=True)
@given(seed=st.integers(0, 1000))
def test_a_model_against_itself_gains_nothing(seed):
    residual = [np.random.default_rng(seed).standard_normal(100)]
    assert chance(residual, residual) == 1.0
    better = [0.5 * residual[0]]
    assert chance(residual, better) < 0.05 < 0.95 < chance(better, residual)
