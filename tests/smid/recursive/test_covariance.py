"""The covariance over a hundred thousand samples, and where the data say nothing for long."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from smid.recursive import Arx, ForgettingFactor, KalmanFilter, RecursiveEstimator
from smid.signals import prbs
from tests.smid.recursive.arx_records import arx_record, run

LONG = 100_000
PERIOD = 1000


def regressors(apart):
    """A period of rows nearly along one direction: what neighbouring samples or powers of an input look like."""
    rng = np.random.default_rng(1)
    level = rng.uniform(0.9, 1.1, PERIOD)
    return np.stack([level, level + apart * rng.normal(size=PERIOD)], axis=1)


def test_forgetting_over_a_hundred_thousand_samples_gives_the_information_of_the_last_ones():
    rows, method = regressors(1e-4), ForgettingFactor(0.99, spread=1e4)
    root, listed = method.start(2), list(rows)
    for _ in range(LONG // PERIOD):
        for phi in listed:
            _, root = method.correct(root, phi)
    assert np.linalg.svd(root)[1].min() > 0
    # By (3.31) it is the sum of lambda^(N-k) phi[k] phi[k]', and never less than at the start.
    weights = 0.99 ** np.arange(3 * PERIOD)[::-1]
    repeated = np.tile(rows, (3, 1))
    information = (weights[:, None] * repeated).T @ repeated + np.eye(2) * 1e-8
    assert_allclose(np.linalg.inv(root.T @ root) @ information, np.eye(2), atol=1e-6)
    np.linalg.cholesky(root.T @ root)


def test_drift_over_a_hundred_thousand_samples_gives_the_periodic_solution():
    rows, method = regressors(1e-2), KalmanFilter(drift=(0.1, 0.03), noise=0.5, spread=1e4)
    root, listed = method.start(2), list(rows)
    for _ in range(LONG // PERIOD):
        for phi in listed:
            _, root = method.correct(root, phi)
    assert np.linalg.svd(root)[1].min() > 0
    p = root.T @ root
    np.linalg.cholesky(p)
    # The same Riccati recursion in information form, from elsewhere: it must have forgotten where it began.
    other = np.diag([3.0, 0.2])
    for _ in range(15):
        for phi in listed:
            other = np.linalg.inv(np.linalg.inv(other) + np.outer(phi, phi) / 0.25) + np.diag([0.01, 0.0009])
    assert_allclose(p, other, rtol=1e-5)


def test_the_root_stays_definite_under_nearly_parallel_regressors():
    """No forgetting, a wide start and nearly parallel regressors: the small direction is far below the large one."""
    rows, method = regressors(1e-4), ForgettingFactor(1.0, spread=1e9)
    root = method.start(2)
    for phi in rows[:50]:
        _, root = method.correct(root, phi)
        assert np.linalg.svd(root)[1].min() > 0
    assert_allclose(root.T @ root, rows[:50].T @ rows[:50] + np.eye(2) * 1e-18, rtol=1e-9)


METHODS = [ForgettingFactor(0.95, spread=10.0), KalmanFilter(drift=0.05, noise=0.1, spread=10.0)]


@pytest.mark.parametrize("method", METHODS, ids=str)
def test_a_constant_input_does_not_wind_up(method):
    arx, calm, n = Arx(nb=1), 4000, 4400
    u = np.concatenate([prbs(100, seed=2), np.ones(calm), prbs(n - calm - 100, seed=3)])
    u, y = arx_record(arx, [-0.6, 1.0, -0.5], n, seed=4, noise=0.1, u=u)
    history = run(RecursiveEstimator(arx, method), u, y).history
    # With (3.31) as it is P would have grown by 0.95^-4000 = 1e89 where the constant does not excite.
    root = method.start(3)
    for phi in arx.matrix(u, y)[: calm + 90]:
        _, root = method.correct(root, phi)
    known = np.linalg.svd(root)[1]
    largest = 1 / known.min() if isinstance(method, ForgettingFactor) else known.max()
    assert 1 < largest <= 10 * (1 + 1e-9)
    assert np.abs(history.parameters).max() < 20
    excited = history.one_step[100 + calm :]
    assert np.abs(excited).max() < 10
    assert np.sqrt(np.mean(excited[50:] ** 2)) < 0.2


SPREAD = np.array([1.0, 5.0, 0.2])
BOUNDED = [ForgettingFactor(0.9, spread=tuple(SPREAD)), KalmanFilter((0.1, 1.0, 0.05), 0.1, tuple(SPREAD))]


@pytest.mark.parametrize("method", BOUNDED, ids=str)
@pytest.mark.parametrize("rows", [np.zeros((1, 3)), np.ones((1, 3)), np.eye(3)[:2], np.eye(3)], ids=len)
def test_no_direction_is_ever_less_certain_than_at_the_start(method, rows):
    root = method.start(3)
    for k in range(3000):
        _, root = method.correct(root, rows[k % len(rows)])
        # Relative to the start: roots of the information, or of the covariance.
        known = isinstance(method, ForgettingFactor)
        sizes = np.linalg.svd(root * SPREAD if known else root / SPREAD)[1]
        largest = 1 / sizes.min() if known else sizes.max()
        assert largest <= 1 + 1e-9
    # What is never excited is as at the start, no better.
    assert (largest > 0.99) == (np.linalg.matrix_rank(rows) < 3)


def test_what_is_excited_is_still_forgotten_while_the_rest_is_not():
    """Two coefficients under a constant input: only their sum is seen, and when it changes it is followed.

    A bound on the trace would have stopped all forgetting.
    """
    arx = Arx(na=0, nb=1, delay=0)
    n, change = 20_000, 15_000
    y = np.where(np.arange(n) < change, 1.0, 3.0)
    history = run(RecursiveEstimator(arx, ForgettingFactor(0.95)), np.ones(n), y).history
    seen = history.parameters.sum(axis=1)
    assert seen[change - 1] == pytest.approx(1.0, abs=1e-6)
    assert seen[change + 150] == pytest.approx(3.0, abs=2e-3)
    assert np.abs(history.parameters).max() < 10
