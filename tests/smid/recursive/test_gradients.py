"""The gradient methods: what gain 1 makes of any data, the stability rule, and parameters that move."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from smid.recursive import (
    Arx,
    DivergenceError,
    ForgettingFactor,
    KalmanFilter,
    NormalisedGradient,
    RecursiveEstimator,
    UnnormalisedGradient,
    gain_study,
    track,
)
from tests.smid.recursive.arx_records import arx_record, as_data, run

# Zero or neither tiny nor huge: squares of smaller numbers underflow.
NUMBERS = st.one_of(st.just(0.0), st.floats(1e-6, 1e6), st.floats(-1e6, -1e-6))


@settings(max_examples=150, deadline=None)
@given(
    arrays.arrays(float, st.tuples(st.integers(3, 25), st.just(2)), elements=NUMBERS),
    st.sampled_from([Arx(stable=False), Arx(na=2, nb=1, stable=False), Arx(powers=(3, 1), stable=False)]),
)
def test_gain_one_makes_the_a_posteriori_error_zero_for_any_data(samples, arx):
    """This is what the thesis's 2e-14 means: it holds for numbers that no plant has made."""
    u, y = samples.T
    if len(u) <= arx.max_lag:
        return
    history = run(RecursiveEstimator(arx, NormalisedGradient(1.0, bias=0.0)), u, y).history
    regressors = np.abs(arx.matrix(u, y))
    before = np.abs(history.parameters[arx.max_lag - 1 : -1])
    after = np.abs(history.parameters[arx.max_lag :])
    # Rounding: a few units in the last place of the products that are summed up.
    rounding = np.abs(y[arx.max_lag :]) + (regressors * (before + after)).sum(axis=1)
    error = np.abs(history.a_posteriori[arx.max_lag :])
    assert (error[regressors.any(axis=1)] <= 2e-15 * rounding[regressors.any(axis=1)]).all()


def test_the_error_is_multiplied_by_what_the_gain_says():
    arx, gain, bias = Arx(na=2, nb=1, stable=False), 0.4, 0.7
    u, y = arx_record(arx, [-0.5, 0.1, 1.0, 0.5], 50, seed=1)
    history = run(RecursiveEstimator(arx, NormalisedGradient(gain, bias)), u, y).history
    norms = (arx.matrix(u, y) ** 2).sum(axis=1)
    np.testing.assert_allclose(
        history.a_posteriori[2:], (1 - gain * norms / (norms + bias)) * history.one_step[2:], rtol=1e-9
    )
    history = run(RecursiveEstimator(arx, UnnormalisedGradient(0.01)), u, y).history
    np.testing.assert_allclose(history.a_posteriori[2:], (1 - 0.01 * norms) * history.one_step[2:], rtol=1e-9)


CONSTANT = Arx(na=0, delay=0)


@pytest.mark.parametrize(("method", "gain"), [(NormalisedGradient, 2.0), (UnnormalisedGradient, 0.5)])
def test_below_the_largest_gain_it_is_bounded_and_above_it_diverges(method, gain):
    """``y = 3 u`` with ``u = 2``: the error is multiplied by 1 - gamma or by 1 - 4 gamma at each sample."""
    n = 6000
    assert method(gain).largest_gain(np.full((5, 1), 2.0)) == pytest.approx(gain)
    below = run(RecursiveEstimator(CONSTANT, method(0.98 * gain)), np.full(n, 2.0), np.full(n, 6.0))
    assert below.parameters == pytest.approx([3.0], abs=1e-9)
    above = RecursiveEstimator(CONSTANT, method(1.02 * gain))
    with pytest.raises(DivergenceError, match=r"grown without bound before sample \d+: give a smaller gain"):
        run(above, np.full(n, 2.0), np.full(n, 6.0))
    assert abs(above.parameters[0]) > 1e90
    found = track(CONSTANT, method(1.02 * gain), as_data(np.full(n, 2.0), np.full(n, 6.0)))
    assert found.diverged is not None
    assert found.diverged == len(found.history.one_step) < n
    assert f"parameters diverged at sample {found.diverged}" in str(found)
    assert np.isnan(found.one_step.rmse)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10_000), st.floats(0.01, 1.99), st.booleans())
def test_up_to_the_largest_gain_the_parameter_error_never_grows(seed, share, normalised):
    arx, true = Arx(na=0, nb=3, delay=0), np.array([1.0, -2.0, 0.5, 3.0])
    u, y = arx_record(arx, true, 60, seed=seed, noise=0.0)
    method = NormalisedGradient(share) if normalised else UnnormalisedGradient(1.0)
    if not normalised:
        method = UnnormalisedGradient(share / 2 * method.largest_gain(arx.matrix(u, y)))
    history = run(RecursiveEstimator(arx, method), u, y).history
    errors = np.linalg.norm(history.parameters - true, axis=1)[arx.max_lag :]
    assert (np.diff(errors) <= 1e-12 * errors[0]).all()
    assert errors[-1] < np.linalg.norm(true)


def test_regressors_that_vanish_change_nothing():
    for method in (NormalisedGradient(1.0, bias=0.0), NormalisedGradient(), UnnormalisedGradient(1.0)):
        estimator = run(RecursiveEstimator(Arx(), method, start=[0.5, 2.0]), np.zeros(5), [0, 0, 0, 0, 1])
        np.testing.assert_array_equal(estimator.parameters, [0.5, 2.0])


def test_the_gain_study_tells_which_error_chose_gain_one():
    """On noise that no model can follow the a posteriori error is least at gain 1, and the one step ahead is not."""
    rng = np.random.default_rng(8)
    data = as_data(rng.normal(size=500), rng.normal(size=500))
    study = gain_study(Arx(), NormalisedGradient(), data)
    assert study.largest_gain == 2
    seen = [t.largest_left_alone for t in study.trackings]
    assert study.gains[int(np.argmin(seen))] == 1
    assert seen[study.gains.index(1.0)] < 1e-13 < 0.01 < np.partition(seen, 1)[1]
    assert study.best < 0.2
    lines = str(study).splitlines()
    assert "stability rule: gain < 2" in lines[0]
    assert [line.split()[1] for line in lines[2:-2]] == ["satisfied"] * 7 + ["violated"]
    assert len(study.plot().axes) == 1
    assert len(study.to_dict()["trackings"]) == 8


TRACKERS = [
    ForgettingFactor(0.9),
    KalmanFilter(drift=0.05, noise=0.05),
    NormalisedGradient(0.5),
    UnnormalisedGradient(0.3),
]


@pytest.mark.parametrize("method", TRACKERS, ids=str)
def test_a_drifting_parameter_is_tracked(method):
    arx, n = Arx(na=0, nb=1, delay=0), 2000
    gain = 2 + np.sin(2 * np.pi * np.arange(n) / 500)
    true = np.stack([gain, np.full(n, -1.0)], axis=1)
    u, y = arx_record(arx, true, n, seed=9, noise=0.05)

    def miss(method):
        return np.sqrt(np.mean((run(RecursiveEstimator(arx, method), u, y).history.parameters - true)[200:] ** 2))

    assert miss(method) < 0.15 < 0.4 < miss(ForgettingFactor(1.0))
