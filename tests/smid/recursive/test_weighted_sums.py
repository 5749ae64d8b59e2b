"""No noise within its bound makes a weighted sum larger than is said, and near the truth that is hardly more than D."""

from fractions import Fraction

import numpy as np
import pytest

from smid.recursive.polytope import Polytope
from smid.recursive.weighted_sums import Noise, WeightedSums, principal_axes


def enclosed(centre, half, turn):
    """Return a box around a, turned about its centre, with one numerator coefficient beside."""
    na = len(centre)
    polytope = Polytope.box(np.append(centre - 3 * half.max(), -1.0), np.append(centre + 3 * half.max(), 1.0), 200)
    padded = np.concatenate([turn, np.zeros((na, 1))], axis=1)
    middle = turn @ centre
    return polytope.cut(np.concatenate([padded, -padded]), np.append(middle + half, half - middle))


def of_output(na, bound=1.0):
    return [Noise(bound, 1.0, tuple(range(na)), tuple(range(1, na + 1)))]


def turned(generator, na):
    return np.linalg.qr(generator.normal(size=(na, na)))[0]


@pytest.mark.parametrize("na", [1, 2, 3])
@pytest.mark.parametrize("length", [1, 7, 60])
def test_the_worst_noise_of_every_plant_in_the_set_is_below_the_level(na, length):
    generator = np.random.default_rng(10 * na + length)
    for _ in range(10):
        centre = np.poly(generator.uniform(-0.9, 0.95, na))[1:]
        half, turn = 10.0 ** generator.uniform(-6, 0, na), turned(generator, na)
        polytope = enclosed(centre, half, turn)
        axes, _ = principal_axes(polytope, na)
        polytope = polytope.along(np.concatenate([axes, np.zeros((na, 1))], axis=1))
        sums = WeightedSums.around(of_output(na), polytope, axes, length)
        assert sums.weights.shape[1] <= length
        for _ in range(20):
            a = centre + turn.T @ (half * generator.choice([-1.0, 1.0], na) * generator.uniform(0.5, 1.0 - 1e-9, na))
            for weights, slope, level in zip(sums.weights, sums.slopes, sums.levels, strict=True):
                worst = np.abs(np.convolve(np.append(1.0, a), weights)).sum()
                assert worst <= level + slope[:na] @ a


def test_near_the_truth_the_noise_is_counted_once():
    a, half = np.poly([0.9, 0.5])[1:], np.full(2, 1e-6)
    polytope = enclosed(a, half, np.eye(2)).along(np.eye(2, 3))
    sums = WeightedSums.around(of_output(2), polytope, np.eye(2), 200)
    noise = sums.levels + sums.slopes[:, :2] @ a
    assert noise[0] == pytest.approx(1 + np.abs(a).sum(), abs=1e-4)
    assert noise[3] == pytest.approx(1.0, abs=1e-3)
    assert (np.diff(noise) < 0).all()


def test_no_sum_of_true_equations_is_cut_off():
    """The rows hold for the truth, at noise that makes one of the sums as large as it can be."""
    generator = np.random.default_rng(1)
    theta = np.array([-1.4, 0.48, 1.0])
    polytope = enclosed(theta[:2], np.full(2, 0.05), np.eye(2)).along(np.eye(2, 3))
    length, n = 30, 400
    sums = WeightedSums.around(of_output(2, 0.1), polytope, np.eye(2), length)
    u, w = generator.choice([-1.0, 1.0], n), np.zeros(n)
    for t in range(2, n):
        w[t] = -theta[0] * w[t - 1] - theta[1] * w[t - 2] + theta[2] * u[t - 1]
    size = np.maximum(np.abs(polytope.lower), np.abs(polytope.upper))
    for weights in sums.weights:
        signs = np.sign(np.convolve(np.append(1.0, theta[:2]), weights))
        for sign in (1.0, -1.0):
            noise = generator.choice([-1.0, 1.0], n)
            noise[n - len(signs) :] = sign * signs[::-1]
            y = w + 0.1 * (1 - 1e-12) * noise
            equations = [[y[t], -y[t - 1], -y[t - 2], u[t - 1]] for t in range(n - 1, n - 1 - length, -1)]
            normals, offsets = sums.rows(np.array([equations]), size, 0.0)
            assert normals.shape == (8, 3)
            assert (normals @ theta <= offsets).all()
            # The worst noise of a sum brings its row close to the truth.
        assert (offsets - normals @ theta).min() < 0.2


def exact_sum(values, others):
    return sum((Fraction(x) * Fraction(y) for x, y in zip(values.tolist(), others.tolist(), strict=True)), Fraction(0))


@pytest.mark.parametrize("length", [1, 5, 40])
def test_the_rows_hold_in_exact_arithmetic(length):
    """The level is the least float above the noise of the sum: only a bound on all rounding keeps the truth inside."""
    generator = np.random.default_rng(length)
    for _ in range(50):
        theta, weights = generator.normal(size=3), generator.normal(size=length)
        regressors = generator.normal(size=(length, 3)) * 10.0 ** generator.integers(-3, 4, 3)
        y = regressors @ theta + generator.uniform(-1, 1, length)
        errors = [Fraction(v) - exact_sum(row, theta) for v, row in zip(y.tolist(), regressors, strict=True)]
        noise = sum((Fraction(w) * e for w, e in zip(weights.tolist(), errors, strict=True)), Fraction(0))
        level = np.nextafter(abs(float(noise)), np.inf)
        assert abs(noise) <= Fraction(level)
        sums = WeightedSums(weights[None], np.zeros((1, 3)), np.array([level]))
        normals, offsets = sums.rows(np.column_stack([y, regressors])[None], np.abs(theta), 0.0)
        for normal, offset in zip(normals, offsets.tolist(), strict=True):
            assert exact_sum(normal, theta) <= Fraction(offset)
        assert (offsets - normals @ theta).min() < 1e-6
