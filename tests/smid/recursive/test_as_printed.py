"""Without stabilisation the estimators are (3.30) to (3.33) of the clutch thesis, as printed."""

import numpy as np
import pytest

from smid.models import ModelError
from smid.recursive import ForgettingFactor, KalmanFilter


def estimates(method, phis, outputs):
    memory, theta, found = method.start(2), np.zeros(2), []
    for phi, y in zip(phis, outputs, strict=True):
        gain, memory = method.correct(memory, phi)
        theta = theta + gain * (y - phi @ theta)
        found.append(theta)
    return np.array(found)


@pytest.fixture
def record():
    generator = np.random.default_rng(4)
    phis = generator.normal(size=(200, 2))
    return phis, phis @ [0.5, -2.0] + 0.1 * generator.normal(size=200)


def test_forgetting_factor(record):
    phis, outputs = record
    factor, p, theta, expected = 0.98, 100.0 * np.eye(2), np.zeros(2), []
    for phi, y in zip(phis, outputs, strict=True):
        size = factor + phi @ p @ phi
        theta = theta + p @ phi / size * (y - phi @ theta)
        p = (p - np.outer(p @ phi, phi @ p) / size) / factor
        expected.append(theta)
    printed = ForgettingFactor(factor, spread=10.0, stabilised=False)
    np.testing.assert_allclose(estimates(printed, phis, outputs), expected, rtol=1e-8)
    assert not np.allclose(estimates(ForgettingFactor(factor, spread=10.0), phis, outputs), expected, rtol=1e-8)


@pytest.mark.parametrize("noise", [0.5, 0.0])
def test_kalman_filter(record, noise):
    phis, outputs = record
    p, theta, expected = 100.0 * np.eye(2), np.zeros(2), []
    for phi, y in zip(phis, outputs, strict=True):
        size = noise**2 + phi @ p @ phi
        theta = theta + p @ phi / size * (y - phi @ theta)
        p = p + 0.01**2 * np.eye(2) - np.outer(p @ phi, phi @ p) / size
        expected.append(theta)
    printed = KalmanFilter(0.01, noise, 10.0, stabilised=False)
    found = estimates(printed, phis, outputs)
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6)
    if noise == 0:
        # without noise the updated model fits every sample, whatever the data are
        np.testing.assert_allclose(np.sum(found * phis, axis=1), outputs, atol=1e-9)


def test_no_noise_is_refused_unless_as_printed():
    with pytest.raises(ModelError, match="fits every sample exactly"):
        KalmanFilter(0.01, 0.0)
    assert str(KalmanFilter(0.01, 0.0, stabilised=False)) == "Kalman filter, drift 0.01, noise 0, as printed"
    gain, _ = KalmanFilter(0.01, 0.0, stabilised=False).correct(np.eye(2), np.zeros(2))
    assert not gain.any()
