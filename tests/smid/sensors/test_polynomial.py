"""CFPX to order 100, and the dead zone, against other arithmetic."""

import numpy as np
import pytest
from numpy.polynomial import chebyshev, legendre

from smid.data import Dataset
from smid.data.bundled import CLUTCH_RECORDS, load_clutch
from smid.models import ModelError
from smid.sensors import CFPX, DeadZone, MedianFiltered
from smid.sensors.cfpx import scale_pressure


def static(pressure, position):
    return Dataset.from_arrays(
        input={"pressure": pressure}, output={"position": position}, sampling_time=0.002, current=pressure
    )


@pytest.mark.parametrize("name", CLUTCH_RECORDS)
def test_order_100_is_well_conditioned(name):
    pressure = load_clutch(name).values("pressure")
    ends = float(pressure.min()), float(pressure.max())
    assert np.linalg.cond(chebyshev.chebvander(scale_pressure(pressure, ends), 100)) < 1e4
    assert np.linalg.cond(np.vander(pressure, 101)) > 1e100


def test_a_polynomial_of_order_100_is_found_again():
    generator = np.random.default_rng(1)
    truth = generator.normal(size=101)
    scaled = np.concatenate([[-1.0, 1.0], generator.uniform(-1, 1, 3000)])
    pressure = 15.0 + 15.0 * scaled
    sensor = CFPX(100).fit(static(pressure, chebyshev.chebval(scaled, truth)), seed=1)
    np.testing.assert_allclose(sensor.coefficients, truth, atol=1e-9)


@pytest.mark.parametrize("order", [5, 20, 100])
def test_another_basis_gives_the_same_sensor(order):
    data = load_clutch("60C_ramp_b")
    pressure, position = data.values("pressure"), data.values("position")
    scaled = scale_pressure(pressure, (float(pressure.min()), float(pressure.max())))
    basis = legendre.legvander(scaled, order)
    expected = basis @ np.linalg.lstsq(basis, position, rcond=None)[0]
    np.testing.assert_allclose(CFPX(order).fit(data, seed=1).predict(data).position[0], expected, atol=1e-9)


def test_the_error_falls_with_the_order():
    data = load_clutch("20C_step_a")
    errors = [CFPX(order).fit(data, seed=1).predict(data).mse(data) for order in (0, 5, 10, 20, 50, 100)]
    assert errors == sorted(errors, reverse=True)
    assert errors[0] == pytest.approx(np.var(data.values("position")))


def test_beyond_the_range_the_end_is_held():
    data = load_clutch("20C_step_a")
    sensor = CFPX(100).fit(data, seed=1)
    low, high = sensor.trained_on.inputs[0].lower, sensor.trained_on.inputs[0].upper
    said = sensor.evaluate({"pressure": np.array([low, high, low - 9.0, high + 9.0])})
    np.testing.assert_array_equal(said[:2], said[2:])


def test_no_order():
    with pytest.raises(ModelError, match="order = -1"):
        CFPX(-1)


def test_the_dead_zone_is_the_best_of_all_thresholds():
    generator = np.random.default_rng(2)
    pressure = generator.uniform(0, 10, 300)
    data = static(pressure, 0.3 + np.maximum(0, pressure - 3.0) + generator.normal(0, 0.1, 300))
    plain = CFPX(3).fit(data, seed=1)
    found = DeadZone(CFPX(3)).fit(data, seed=1)
    assert found.threshold == pytest.approx(3.0, abs=0.6)
    assert found.rest == pytest.approx(0.3, abs=0.05)
    said, position = plain.predict(data).position[0], data.values("position")
    errors = []
    for threshold in pressure:
        below = pressure <= threshold
        errors.append(np.mean((position - np.where(below, position[below].mean(), said)) ** 2))
    assert found.predict(data).mse(data) == pytest.approx(min(errors), rel=1e-12)


def test_no_dead_zone_is_found_where_there_is_none():
    pressure = np.random.default_rng(3).uniform(0, 10, 300)
    data = static(pressure, 2.0 * pressure)
    found = DeadZone(CFPX(1)).fit(data, seed=1)
    assert found.predict(data).mse(data) < 1e-20
    assert found.threshold is None or found.threshold == pressure.min()


def test_a_median_inside_a_dead_zone_sees_the_sensor():
    data = load_clutch("20C_step_a")
    sensor = DeadZone(MedianFiltered(CFPX(20), 50)).fit(data, seed=1)
    said = sensor.predict(data).position[0]
    np.testing.assert_array_equal(said[data.values("pressure") <= sensor.threshold], sensor.rest)
