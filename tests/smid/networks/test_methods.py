"""Every method finds known minima of problems that hold no network, and says why it stopped."""

from dataclasses import dataclass, field

import numpy as np
import pytest
from scipy.optimize import least_squares

from smid.models import ModelError
from smid.networks import (
    Iterate,
    NetworkError,
    Stop,
    descend,
    gauss_newton,
    gradient_descent,
    levenberg_marquardt,
    multistart,
    nguyen_widrow,
    sum_normal_equations,
)

METHODS = (levenberg_marquardt, gauss_newton, gradient_descent)


@dataclass
class Rosenbrock:
    """Residuals 10 (y - x^2) and 1 - x: the minimum is zero, at (1, 1), at the end of a bent valley."""

    evaluations: int = field(default=0)

    def residuals(self, theta):
        x, y = theta
        return np.array([10.0 * (y - x**2), 1.0 - x])

    def error(self, theta):
        self.evaluations += 1
        return float(np.mean(self.residuals(theta) ** 2))

    def normal_equations(self, theta):
        jacobian = np.array([[-20.0 * theta[0], 10.0], [-1.0, 0.0]])
        return sum_normal_equations([(self.residuals(theta), jacobian)])


@dataclass
class Decay:
    """An exponential through four points: a nonlinear problem whose minimum is not zero."""

    t = np.array([0.0, 1.0, 2.0, 3.0])
    y = np.array([2.0, 0.9, 0.55, 0.1])

    def residuals(self, theta):
        return theta[0] * np.exp(-theta[1] * self.t) - self.y

    def error(self, theta):
        with np.errstate(over="ignore"):
            return float(np.mean(self.residuals(theta) ** 2))

    def normal_equations(self, theta):
        e = np.exp(-theta[1] * self.t)
        return sum_normal_equations([(self.residuals(theta), np.stack([e, -theta[0] * self.t * e], axis=1))])


@pytest.mark.parametrize("method", METHODS)
def test_a_linear_problem_is_solved_like_lstsq(method):
    generator = np.random.default_rng(1)
    a, b = generator.normal(size=(30, 4)), generator.normal(size=30)

    class Linear:
        def error(self, theta):
            return float(np.mean((a @ theta - b) ** 2))

        def normal_equations(self, theta):
            return sum_normal_equations((a[k : k + 7] @ theta - b[k : k + 7], a[k : k + 7]) for k in range(0, 30, 7))

    found = descend(method, Linear(), np.ones(4), iterations=3000)
    np.testing.assert_allclose(found.theta, np.linalg.lstsq(a, b, rcond=None)[0], atol=1e-5)


@pytest.mark.parametrize("method", [levenberg_marquardt, gauss_newton])
def test_rosenbrock(method):
    found = descend(method, Rosenbrock(), np.array([-1.2, 1.0]))
    np.testing.assert_allclose(found.theta, 1.0, atol=1e-6)
    assert found.stop is Stop.CONVERGED


@pytest.mark.parametrize("method", METHODS)
def test_a_minimum_that_is_not_zero(method):
    problem = Decay()
    expected = least_squares(problem.residuals, [1.0, 1.0], xtol=1e-14, ftol=1e-14, gtol=1e-14)
    found = descend(method, problem, np.array([1.0, 0.1]), iterations=5000)
    np.testing.assert_allclose(found.theta, expected.x, atol=1e-3)
    assert found.best == pytest.approx(2 * expected.cost / 4, rel=1e-5)


@pytest.mark.parametrize("method", METHODS)
def test_the_error_never_rises(method):
    errors = descend(method, Rosenbrock(), np.array([-1.2, 1.0]), iterations=200).training
    assert (np.diff(errors) < 0).all()


def test_levenberg_marquardt_wastes_few_evaluations():
    problem = Rosenbrock()
    found = descend(levenberg_marquardt, problem, np.array([-1.2, 1.0]))
    # Steps are refused at the end, where rounding hides any fall.
    assert problem.evaluations < 2 * found.training.size + 30


def test_the_three_methods_agree_on_a_network():
    x = np.linspace(-1, 1, 60)[:, None]
    problem = NetworkError((1, 2), x, np.tanh(2 * x[:, 0]) - 0.5)
    start = nguyen_widrow((1, 2), seed=4).weights
    ends = [descend(method, problem, start, iterations=4000).best for method in METHODS]
    assert max(ends[:2]) < 1e-8
    assert ends[2] < 1e-3


def test_blocks_do_not_change_the_normal_equations():
    generator = np.random.default_rng(3)
    residual, jacobian = generator.normal(size=10), generator.normal(size=(10, 3))
    whole = sum_normal_equations([(residual, jacobian)])
    parts = sum_normal_equations([(residual[:4], jacobian[:4]), (residual[4:], jacobian[4:])])
    np.testing.assert_allclose(parts.gram, whole.gram)
    np.testing.assert_allclose(parts.gradient, whole.gradient)
    np.testing.assert_allclose(whole.gram, jacobian.T @ jacobian / 10)
    assert parts.error == pytest.approx(whole.error)
    with pytest.raises(ModelError, match="without samples"):
        sum_normal_equations([])


def steps(errors):
    return lambda _, start: (Iterate(start + k, e) for k, e in enumerate(errors))


def test_the_least_validation_error_wins_and_stops():
    validation = iter([5.0, 4.0, 1.0, 2.0, 3.0, 4.0, 0.0])
    found = descend(
        steps([9.0, 8.0, 7.0, 6.0, 5.0, 4.0, 3.0]),
        Rosenbrock(),
        np.zeros(2),
        validation=lambda _: next(validation),
        patience=3,
    )
    assert found.stop is Stop.VALIDATION
    assert found.theta.tolist() == [2.0, 2.0]
    assert found.best == 1.0


def test_the_limit_of_iterations():
    found = descend(steps(np.arange(100.0, 0, -1)), Rosenbrock(), np.zeros(2), iterations=7)
    assert (found.stop, found.training.size) == (Stop.ITERATIONS, 8)


def test_a_flat_end_is_convergence():
    found = descend(steps(1.0 + 1e-9 * np.arange(200.0, 0, -1)), Rosenbrock(), np.zeros(2))
    assert found.stop is Stop.CONVERGED
    assert found.training.size < 30


def test_an_interruption_keeps_the_best():
    def stop_at_three(progress):
        if (progress.start, progress.iteration) == (1, 3):
            raise KeyboardInterrupt

    starts = [np.array([-1.2, 1.0]), np.array([3.0, -2.0]), np.array([0.0, 0.0])]
    search = multistart(levenberg_marquardt, Rosenbrock(), starts, progress=stop_at_three)
    assert [descent.stop for descent in search.descents] == [Stop.CONVERGED, Stop.INTERRUPTED]
    assert search.winner == 0
    assert "start 1 of 2" in str(search)


def test_an_interruption_before_anything_is_known_goes_on():
    class Slow(Rosenbrock):
        def normal_equations(self, _):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        multistart(levenberg_marquardt, Slow(), [np.zeros(2)])


def test_a_start_without_an_error():
    with pytest.raises(ModelError, match="error at the start is not finite"):
        descend(steps([np.nan]), Rosenbrock(), np.zeros(2))
    with pytest.raises(ModelError, match="no start"):
        multistart(levenberg_marquardt, Rosenbrock(), [])
