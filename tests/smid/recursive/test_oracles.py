"""The covariance methods against batch least squares and batch Bayes, which share no recursion with them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from smid.recursive import Arx, ForgettingFactor, KalmanFilter, RecursiveEstimator
from smid.recursive.poles import RADIUS
from tests.smid.recursive.arx_records import STRUCTURES, TRUE, arx_record, run


def weighted_least_squares(regressors, outputs, factor, spread, start):
    """Minimise the forgetting cost: samples and, as further rows, the start."""
    age = np.arange(len(outputs))[::-1]
    weights = np.sqrt(factor) ** age
    prior = np.sqrt(factor) ** len(outputs) / spread
    rows = np.vstack([weights[:, None] * regressors, prior * np.eye(regressors.shape[1])])
    return np.linalg.lstsq(rows, np.concatenate([weights * outputs, prior * start]), rcond=None)[0]


@pytest.mark.parametrize("name", STRUCTURES)
@pytest.mark.parametrize("factor", [1.0, 0.97])
def test_forgetting_factor_equals_weighted_least_squares(name, factor):
    arx, spread = STRUCTURES[name], 1e5
    u, y = arx_record(arx, TRUE[name], 300, seed=1)
    start = np.linspace(-1, 1, len(arx.names))
    estimator = run(RecursiveEstimator(arx, ForgettingFactor(factor, spread=spread), start), u, y)
    regressors, outputs = arx.matrix(u, y), y[arx.max_lag :]
    for count in (len(arx.names) + 2, 40, len(outputs)):
        batch = weighted_least_squares(regressors[:count], outputs[:count], factor, spread, start)
        found = estimator.history.parameters[arx.max_lag + count - 1]
        assert_allclose(found, batch, rtol=1e-6, atol=1e-8)


def test_forgetting_nothing_keeps_the_start_at_its_weight():
    """With factor 1 the start counts as much at the end as in the cost; a spread of one makes that visible."""
    arx = STRUCTURES["three poles"]
    u, y = arx_record(arx, TRUE["three poles"], 30, seed=2)
    start = np.ones(6)
    found = run(RecursiveEstimator(arx, ForgettingFactor(1.0, spread=1.0), start), u, y).parameters
    batch = weighted_least_squares(arx.matrix(u, y), y[arx.max_lag :], 1.0, 1.0, start)
    assert_allclose(found, batch, rtol=1e-10)
    assert np.abs(found - np.array(TRUE["three poles"])).max() > 0.01


def test_kalman_filter_without_drift_equals_the_bayes_posterior():
    name, noise = "Hammerstein", 0.3
    arx, spread, start = STRUCTURES[name], (0.5, 2.0, 1.0, 0.1), np.array([-0.5, 0.0, 0.0, 0.9])
    u, y = arx_record(arx, TRUE[name], 60, seed=3, noise=noise)
    method = KalmanFilter(drift=0.0, noise=noise, spread=spread)
    found = run(RecursiveEstimator(arx, method, start), u, y).parameters
    regressors, outputs = arx.matrix(u, y), y[arx.max_lag :]
    information = regressors.T @ regressors / noise**2 + np.diag(1 / np.square(spread))
    batch = np.linalg.solve(information, regressors.T @ outputs / noise**2 + start / np.square(spread))
    assert_allclose(found, batch, rtol=1e-9)
    root = method.start(4)
    for phi in regressors:
        _, root = method.correct(root, phi)
    assert_allclose(root.T @ root, np.linalg.inv(information), rtol=1e-8)


def test_kalman_filter_with_drift_equals_least_squares_over_the_whole_walk():
    """All parameters of all samples at once: steps, noise and start are rows of one least-squares problem."""
    arx, drift, noise, spread, n = STRUCTURES["one pole"], (0.02, 0.1), 0.2, 1e4, 25
    u, y = arx_record(arx, TRUE["one pole"], n + 1, seed=4, noise=noise)
    found = run(RecursiveEstimator(arx, KalmanFilter(drift, noise, spread)), u, y).parameters
    regressors, outputs = arx.matrix(u, y), y[1:]
    rows, right = [], []
    for k in range(n):
        one = np.zeros((2, n, 2))
        one[:, k, :] = np.eye(2)
        if k == 0:
            rows.append(one.reshape(2, -1) / spread)
        else:
            before = np.zeros((2, n, 2))
            before[:, k - 1, :] = np.eye(2)
            rows.append((one - before).reshape(2, -1) / np.array(drift)[:, None])
        right.append(np.zeros(2))
        rows.append(np.tensordot(regressors[k], one, axes=1).reshape(1, -1) / noise)
        right.append(outputs[k : k + 1] / noise)
    walk = np.linalg.lstsq(np.vstack(rows), np.concatenate(right), rcond=None)[0].reshape(n, 2)
    assert_allclose(found, walk[-1], rtol=1e-6)


def test_what_is_forgotten_is_replaced_by_the_start():
    """The exact cost: all estimates before are further observations of the parameters, of the start's certainty."""
    arx, factor, spread = STRUCTURES["three poles"], 0.9, np.array([0.1, 0.2, 0.1, 0.5, 0.3, 0.2])
    u, y = arx_record(arx, TRUE["three poles"], 50, seed=5)
    history = run(RecursiveEstimator(arx, ForgettingFactor(factor, spread=tuple(spread))), u, y).history
    start, n = arx.max_lag, 50 - arx.max_lag
    regressors, outputs, age = arx.matrix(u, y), y[start:], np.sqrt(factor) ** np.arange(n)[::-1]
    anchors = history.parameters[start - 1 : -1]
    blocks, right = [np.sqrt(factor) ** n * np.diag(1 / spread)], [np.zeros(6)]
    for k in range(n):
        blocks += [age[k] * regressors[k : k + 1], age[k] * np.sqrt(1 - factor) * np.diag(1 / spread)]
        right += [age[k] * outputs[k : k + 1], age[k] * np.sqrt(1 - factor) * anchors[k] / spread]
    batch = np.linalg.lstsq(np.vstack(blocks), np.concatenate(right), rcond=None)[0]
    assert_allclose(history.parameters[-1], batch, rtol=1e-9)


@pytest.mark.parametrize("drift", [0.0, 0.3, (0.1, 0.5, 0.2)])
def test_one_correction_of_the_kalman_filter_is_the_textbook_formula(drift):
    rng = np.random.default_rng(5)
    root, phi, noise = rng.normal(size=(3, 3)), rng.normal(size=3), 0.7
    p, walk = root.T @ root, np.diag(np.broadcast_to(drift, 3) ** 2)
    gain, after = KalmanFilter(drift, noise, spread=1e6).correct(root, phi)
    total = noise**2 + phi @ p @ phi
    assert_allclose(gain, p @ phi / total, rtol=1e-9)
    assert_allclose(after.T @ after, p - np.outer(p @ phi, p @ phi) / total + walk, atol=1e-10)
    assert_allclose(after, np.triu(after))


def test_one_correction_of_the_forgetting_factor_is_the_textbook_formula():
    rng = np.random.default_rng(6)
    root, phi, factor = rng.normal(size=(3, 3)), rng.normal(size=3), 0.9
    p = np.linalg.inv(root.T @ root)
    gain, after = ForgettingFactor(factor, spread=1e8).correct(root, phi)
    total = factor + phi @ p @ phi
    assert_allclose(gain, p @ phi / total, rtol=1e-9)
    assert_allclose(np.linalg.inv(after.T @ after), (p - np.outer(p @ phi, p @ phi) / total) / factor, rtol=1e-9)


@pytest.mark.parametrize("method", [ForgettingFactor(1.0, spread=50.0), KalmanFilter(0.0, 1.0, 50.0)], ids=str)
def test_held_poles_leave_the_least_squares_estimate_of_the_rest(method):
    """Section 3.3.2.1 on an unstable plant: b is what batch least squares gives for the pole where it is held."""
    arx = Arx(nb=1)
    rng = np.random.default_rng(7)
    u, y = rng.uniform(-1, 1, 12), np.zeros(12)
    for k in range(2, 12):
        y[k] = 1.3 * y[k - 1] + u[k - 1] - 0.4 * u[k - 2]
    estimator, count = RecursiveEstimator(arx, method), 0
    while not estimator.history.put_inside.any():
        estimator.update(u[count], y[count])
        count += 1
    regressors, outputs = arx.matrix(u, y)[: count - 2], y[2:count]
    rows = np.vstack([regressors, np.eye(3) / 50.0])
    right = np.concatenate([outputs, np.zeros(3)])
    a1 = estimator.parameters[0]
    assert abs(a1) == pytest.approx(RADIUS)
    rest = np.linalg.lstsq(rows[:, 1:], right - a1 * rows[:, 0], rcond=None)[0]
    assert_allclose(estimator.parameters[1:], rest, rtol=1e-8)
