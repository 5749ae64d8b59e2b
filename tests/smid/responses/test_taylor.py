"""A Taylor model encloses its function at every point of the box, by exact arithmetic."""

from fractions import Fraction

import numpy as np
import pytest

from smid.responses.taylor import Taylor


def expression(x, y, number):
    """A rational function; the same text for fractions and Taylor models."""
    return (x * y - x * x + number(3)) / (number(2) + x * x * y) - y / (number(4) - x)


def bounds(model, t):
    """The interval of a model at a point, in fractions."""
    value = Fraction(float(model.value))
    value += sum(Fraction(float(s)) * t[i] for i, s in enumerate(model.slopes))
    value += sum(Fraction(float(c)) * t[i] * t[j] for (i, j), c in np.ndenumerate(model.curvature))
    error = Fraction(float(model.error))
    return value - error, value + error


@pytest.mark.parametrize("radius", [0.0, 1e-9, 1e-3, 0.1, 0.4])
def test_a_rational_function_is_enclosed(radius):
    random = np.random.default_rng(7)
    for _ in range(20):
        centre = random.uniform(-0.5, 0.5, 2)
        x, y = (Taylor.linear(c, radius * unit) for c, unit in zip(centre, np.eye(2), strict=True))
        model = expression(x, y, lambda v: Taylor.linear(float(v), np.zeros(2)))
        assert np.isfinite(model.error)
        for t in (*random.uniform(-1, 1, (20, 2)), *np.array(np.meshgrid([-1.0, 1], [-1.0, 1])).reshape(2, 4).T):
            exact_t = [Fraction(float(v)) for v in t]
            point = [Fraction(float(c)) + Fraction(radius) * v for c, v in zip(centre, exact_t, strict=True)]
            low, high = bounds(model, exact_t)
            assert low <= expression(*point, Fraction) <= high


def test_the_error_falls_with_the_third_power():
    errors = []
    for radius in (0.1, 0.05):
        x = Taylor.linear(1.0, np.array([radius]))
        errors.append(float((x * x * x / (x + x * x)).error))
    assert 6 < errors[0] / errors[1] < 12


def test_a_divisor_that_may_be_zero_gives_an_infinite_error():
    one = Taylor.linear(1.0, np.zeros(1))
    assert np.isinf((one / Taylor.linear(0.5, np.array([0.5]))).error)
    assert np.isinf((one / Taylor.linear(0.0, np.array([0.0]))).error)
    assert np.isfinite((one / Taylor.linear(0.5, np.array([0.4]))).error)
