"""The estimator object: what every method must do, the structure of models, the stability rule, and bad input."""

from dataclasses import FrozenInstanceError

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from smid.data import DataError
from smid.models import ModelError
from smid.recursive import (
    Arx,
    ForgettingFactor,
    KalmanFilter,
    NormalisedGradient,
    RecursiveEstimator,
    UnnormalisedGradient,
)
from smid.recursive.poles import RADIUS, largest_pole, put_inside, stable
from tests.smid.recursive.arx_records import STRUCTURES, TRUE, arx_record, run

METHODS = [ForgettingFactor(), KalmanFilter(drift=0.01), NormalisedGradient(0.5), UnnormalisedGradient(0.02)]
every_method = pytest.mark.parametrize("method", METHODS, ids=str)


@every_method
@pytest.mark.parametrize("name", STRUCTURES)
def test_every_method_learns_constant_parameters(method, name):
    arx = STRUCTURES[name]
    n = 20_000 if isinstance(method, NormalisedGradient | UnnormalisedGradient) else 1000
    u, y = arx_record(arx, TRUE[name], n, seed=1, noise=0.0)
    estimator = RecursiveEstimator(arx, method)
    run(estimator, u, y)
    np.testing.assert_allclose(estimator.parameters, TRUE[name], atol=0.02)


@every_method
def test_every_method_holds_no_data(method):
    memory, phi = method.start(3), np.array([1.0, -2.0, 0.5])
    kept = memory.copy()
    first, second = method.correct(memory, phi), method.correct(memory, phi)
    np.testing.assert_array_equal(memory, kept)
    np.testing.assert_array_equal(first[0], second[0])
    assert first[0].shape == (3,)
    assert phi @ first[0] > 0  # a step towards the sample
    with pytest.raises(FrozenInstanceError):
        method.gain = 3.0


@every_method
def test_history_is_what_updates_returned(method):
    arx, n = Arx(na=2, nb=1, delay=2), 1500  # more than the room at first
    u, y = arx_record(arx, [-0.9, 0.3, 1.0, 0.5], n, seed=2)
    estimator = RecursiveEstimator(arx, method, start=[0.1, 0.2, 0.3, 0.4])
    returned = [estimator.update(*sample) for sample in zip(u, y, strict=True)]
    history = estimator.history
    assert history.parameters.shape == (n, 4)
    np.testing.assert_array_equal(history.one_step, returned)
    assert np.isnan(returned[:3]).all()
    assert np.isfinite(returned[3:]).all()
    np.testing.assert_array_equal(history.parameters[2], [0.1, 0.2, 0.3, 0.4])
    np.testing.assert_array_equal(history.parameters[-1], estimator.parameters)
    regressors = arx.matrix(u, y)
    np.testing.assert_allclose(history.one_step[3:], y[3:] - (regressors * history.parameters[2:-1]).sum(axis=1))
    np.testing.assert_allclose(history.a_posteriori[3:], y[3:] - (regressors * history.parameters[3:]).sum(axis=1))
    history.parameters[:] = 0  # a copy: what is done to it does not reach the estimator
    assert estimator.history.parameters.any()


def test_names_and_regressors():
    arx = Arx(na=2, nb=1, delay=0, powers=(3, 1), input_scale=0.5, offset=True)
    assert arx.names == ("a1", "a2", "b0_v3", "b1_v3", "b0_v1", "b1_v1", "offset")
    assert (arx.max_lag, Arx(na=1, nb=2, delay=3).max_lag) == (2, 5)
    matrix = arx.matrix([2.0, 4.0, 6.0], [1.0, 5.0, 7.0])
    np.testing.assert_array_equal(matrix, [[-5.0, -1.0, 27.0, 8.0, 3.0, 2.0, 1.0]])
    assert arx.row([5.0, 1.0], [3.0, 2.0]) == matrix[0].tolist()
    # The thesis's model (3.24): the regressors are (3.28).
    np.testing.assert_array_equal(Arx().matrix([1, 2], [3, 4]), [[-3.0, 1.0]])


@settings(deadline=None)
@given(st.lists(st.floats(-3, 3), min_size=0, max_size=5))
def test_step_down_agrees_with_the_roots(denominator):
    radius = largest_pole(denominator)
    if abs(radius - 1) > 1e-6:
        assert stable(denominator) == (radius < 1)


@settings(deadline=None)
@given(st.lists(st.floats(-3, 3), min_size=1, max_size=4))
@example([0.5, 0.0, 0.5])  # a pole at -1, whose computed root lies inside
@example([-2.0, 1.0])
@example([-4.0, 6.0, -4.0, 1.0])
def test_poles_are_put_inside_and_those_inside_stay(denominator):
    moved = put_inside(denominator)
    assert largest_pole(moved) < 0.995
    assert stable(moved)
    if largest_pole(denominator) < 0.98:
        np.testing.assert_allclose(moved, denominator, atol=1e-6)


def test_one_pole_is_put_where_the_thesis_puts_it():
    for pole in (1.0, 1.7, -1.0, -25.0):
        assert put_inside([pole]) == pytest.approx([np.copysign(RADIUS, pole)])


@every_method
@pytest.mark.parametrize("arx", [Arx(), Arx(na=2, nb=1)], ids=str)
def test_estimates_stay_stable_on_an_unstable_plant(method, arx):
    u, y = np.ones(60), np.zeros(60)
    for k in range(1, 60):
        y[k] = 1.05 * y[k - 1] + u[k - 1]
    scaled = UnnormalisedGradient(1e-4) if isinstance(method, UnnormalisedGradient) else method
    history = run(RecursiveEstimator(arx, scaled), u, y).history
    assert history.put_inside.any()
    assert all(stable(row[: arx.na]) for row in history.parameters)


def test_after_the_rule_the_gain_takes_the_rest_of_the_error():
    """One pole, gain 1: where the rule moves the pole, b is computed anew so that the sample is met again."""
    history = run(RecursiveEstimator(Arx(), NormalisedGradient()), [1.0, 1.0, 1.0], [0.0, 1.0, 9.0]).history
    assert history.put_inside.tolist() == [False, False, True]
    np.testing.assert_allclose(history.parameters[2], [-0.99, 9 - 0.99])
    assert abs(history.a_posteriori[2]) < 1e-14


@pytest.mark.parametrize(
    ("sample", "message"),
    [
        ((np.nan, 1.0), "sample 3: the input is nan: leave the sample out, or fill the gap"),
        ((1.0, np.nan), "sample 3: the output is nan"),
        ((1.0, np.inf), "sample 3: the output is inf"),
        ((None, 1.0), "sample 3: the input is None"),
        ((1e40, 1.0), "sample 3: input 1e\\+40 or output 1 is too large: scale"),
    ],
)
def test_a_bad_sample_is_refused_and_leaves_no_trace(sample, message):
    arx, samples = Arx(powers=(3, 1)), [(1.0, 0.0), (0.5, 1.0), (-1.0, 0.7)]
    estimators = [RecursiveEstimator(arx, ForgettingFactor()) for _ in range(2)]
    for estimator in estimators:
        run(estimator, *zip(*samples, strict=True))
    with pytest.raises(DataError, match=message):
        estimators[0].update(*sample)
    for estimator in estimators:
        run(estimator, [2.0, 1.0], [0.3, -0.2])
    np.testing.assert_array_equal(estimators[0].history.parameters, estimators[1].history.parameters)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Arx(na=-1), "na = -1 is not a valid order"),
        (lambda: Arx(powers=()), "must be distinct and at least one"),
        (lambda: Arx(powers=(0,)), "a power = 0 is not a valid order"),
        (lambda: Arx(powers=(2, 2)), "must be distinct"),
        (lambda: Arx(input_scale=0.0), "input_scale = 0.0 is refused"),
        (lambda: ForgettingFactor(0.0), "factor = 0.0 is not a forgetting factor: give a number above 0, at most 1"),
        (lambda: ForgettingFactor(1.01), "factor = 1.01"),
        (lambda: ForgettingFactor(spread=0.0), "spread = 0.0 is refused: give a number that is positive"),
        (lambda: ForgettingFactor(spread=(1.0, np.nan)), "spread = .* is refused"),
        (lambda: ForgettingFactor(spread="wide"), "spread = 'wide' is refused"),
        (lambda: KalmanFilter(drift=-1.0), "drift = -1.0 is refused: give a number that is not negative"),
        (lambda: KalmanFilter(drift=0.1, noise=0.0), "without noise the updated model fits every sample"),
        (lambda: RecursiveEstimator(Arx(), KalmanFilter(5.0, spread=(9.0, 5.0))), "a drift is not below its spread"),
        (lambda: NormalisedGradient(0.0), "gain = 0.0 is not an adaptation gain: give a positive number"),
        (lambda: NormalisedGradient(bias=-1.0), "bias = -1.0 is refused"),
        (lambda: UnnormalisedGradient(np.nan), "gain = nan is not an adaptation gain"),
        (lambda: RecursiveEstimator(Arx(), ForgettingFactor(spread=(1.0, 2.0, 3.0))), "spread has 3 numbers for 2 par"),
        (lambda: RecursiveEstimator(Arx(), KalmanFilter(drift=(1.0,))), "drift has 1 numbers for 2 parameters"),
        (lambda: RecursiveEstimator(Arx(), ForgettingFactor(), start=[1.0]), "give 2 finite numbers, for a1, b0"),
        (lambda: RecursiveEstimator(Arx(), ForgettingFactor(), start=[1.0, np.inf]), "give 2 finite numbers"),
    ],
)
def test_bad_settings_are_refused(make, message):
    with pytest.raises(ModelError, match=message):
        make()


def test_bad_records_are_refused():
    with pytest.raises(DataError, match=r"shapes \(3,\) and \(2,\): give series of equal length"):
        Arx().matrix([1, 2, 3], [1, 2])
    with pytest.raises(DataError, match="1 samples are too few: the model looks back 1, give at least 2"):
        Arx().matrix([1], [1])
    with pytest.raises(DataError, match="a sample is not finite or too large: fill gaps"):
        Arx().matrix([1, np.nan], [1, 2])
