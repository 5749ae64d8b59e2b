"""Descents in lockstep: each start goes its own way, to the minimum that SciPy finds, within its box, in any units."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pytest
from scipy.optimize import least_squares

from smid.networks import lockstep, stacked_normal_equations

TIMES = np.linspace(0.0, 3.0, 40)
SEEN = 2.0 * np.exp(-1.3 * TIMES) + 0.3 + 0.01 * np.sin(9.0 * TIMES)
FREE = (np.full(3, -np.inf), np.full(3, np.inf))


@dataclass(frozen=True, eq=False)
class Decay:
    """a exp(-k t) + c, with numbers in units; there is no error where k is negative."""

    thetas: np.ndarray
    units: np.ndarray

    @cached_property
    def residuals(self):
        a, k, c = (self.thetas * self.units).T[:, :, None]
        return a * np.exp(-k * TIMES) + c - SEEN

    @property
    def errors(self):
        return np.where(self.thetas[:, 1] < 0, np.inf, np.mean(self.residuals**2, axis=1))

    def jacobian(self, rows):
        a, k, _ = (self.thetas[rows] * self.units).T[:, :, None]
        fall = np.exp(-k * TIMES)
        return np.stack([fall, -a * TIMES * fall, np.ones_like(fall)], axis=2) * self.units

    def normal_equations(self, rows):
        return stacked_normal_equations(self.residuals, self.jacobian, rows)


def _decay(units=(1.0, 1.0, 1.0)):
    return lambda thetas: Decay(thetas, np.array(units))


def _starts(count):
    return np.random.default_rng(3).uniform(0.1, 3.0, (count, 3))


def test_finds_what_scipy_finds():
    starts = _starts(12)
    found, errors = lockstep(_decay(), starts, *FREE, evaluations=200)
    oracle = least_squares(lambda theta: Decay(theta[None], np.ones(3)).residuals[0], starts[0])
    np.testing.assert_allclose(found, np.tile(oracle.x, (12, 1)), rtol=1e-5)
    np.testing.assert_allclose(errors, 2.0 * oracle.cost / TIMES.size, rtol=1e-9)


def test_a_start_goes_the_same_way_alone():
    starts = _starts(5)
    for evaluations in (1, 4, 9):
        together, _ = lockstep(_decay(), starts, *FREE, evaluations=evaluations)
        alone = [lockstep(_decay(), start[None], *FREE, evaluations=evaluations)[0][0] for start in starts]
        np.testing.assert_allclose(together, alone, rtol=1e-9)


def test_units_do_not_matter():
    units = np.array([1e-3, 50.0, 1e4])
    plain, _ = lockstep(_decay(), _starts(4), *FREE, evaluations=6)
    scaled, _ = lockstep(_decay(units), _starts(4) / units, *FREE, evaluations=6)
    np.testing.assert_allclose(scaled * units, plain, rtol=1e-8)


def test_keeps_the_box():
    lower, upper = np.array([0.0, 0.0, 0.4]), np.array([5.0, 5.0, 5.0])
    starts = np.clip(_starts(6), lower, upper)
    found, _ = lockstep(_decay(), starts, lower, upper, evaluations=300)
    oracle = least_squares(
        lambda theta: Decay(theta[None], np.ones(3)).residuals[0], starts[0] + 1e-3, bounds=(lower, upper), xtol=1e-14
    )
    assert (found[:, 2] == 0.4).all()
    np.testing.assert_allclose(found, np.tile(oracle.x, (6, 1)), rtol=1e-4)


def test_the_error_never_rises_and_a_start_without_one_stays():
    starts = _starts(3)
    starts[1, 1] = -1.0
    before = Decay(starts, np.ones(3)).errors
    found, errors = lockstep(_decay(), starts, *FREE, evaluations=3)
    assert (errors[[0, 2]] < before[[0, 2]]).all()
    assert errors[1] == np.inf
    assert found[1] == pytest.approx(starts[1])


def test_normal_equations_of_some_points_are_theirs_whatever_the_blocks():
    points = Decay(_starts(120), np.ones(3))
    rows = np.arange(3, 120, 2)
    gradient, gram = points.normal_equations(rows)
    steep = points.jacobian(rows)
    np.testing.assert_allclose(gradient, np.einsum("knp,kn->kp", steep, points.residuals[rows]) / TIMES.size)
    np.testing.assert_allclose(gram, np.einsum("knp,knq->kpq", steep, steep) / TIMES.size)
