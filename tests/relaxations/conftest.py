"""Small identification problems and exact arithmetic that the tests of ``relaxations`` share."""

from dataclasses import dataclass
from fractions import Fraction
from math import prod

import numpy as np
import pytest
from scipy.optimize import linprog, minimize_scalar

from relaxations.algebra.polynomial import Polynomials
from relaxations.problem.problem import PolynomialProblem


@dataclass(frozen=True)
class Model:
    """A first-order model y_t = x_t + e_t, x_t + pole x_{t-1} = sum_k c_k drive[t-1, k], with its data.

    ``unit_gain``: the coefficients c_k are (1 + pole) gamma_k (the Hammerstein model with unit gain).
    """

    problem: PolynomialProblem
    truth: np.ndarray  # a feasible point: pole, linear parameters, noise
    drive: np.ndarray
    y: np.ndarray
    noise_bound: float
    unit_gain: bool

    @property
    def n_linear(self):
        return self.drive.shape[1]

    def simulate(self, pole, linear, start):
        """Return the noise-free output."""
        gain = 1 + pole if self.unit_gain else 1.0
        x = np.empty(len(self.y))
        x[0] = start
        for t in range(1, len(x)):
            x[t] = -pole * x[t - 1] + gain * self.drive[t - 1] @ linear
        return x

    def responses(self, pole):
        """Return the matrix G with x = G (x_0, linear parameters) at a fixed pole."""
        eye = np.eye(1 + self.n_linear)
        return np.stack([self.simulate(pole, row[1:], row[0]) for row in eye], axis=1)

    # ---- an oracle that shares nothing with the package: linear programs at fixed poles

    def least_noise(self, pole):
        """Return the least noise bound that this pole allows, with the linear parameters in their box."""
        g = self.responses(pole)
        ones = np.ones((len(g), 1))
        lower, upper = self.problem.lower[1 : 1 + self.n_linear], self.problem.upper[1 : 1 + self.n_linear]
        found = linprog(
            np.r_[np.zeros(g.shape[1]), 1.0],
            A_ub=np.block([[g, -ones], [-g, -ones]]),
            b_ub=np.r_[self.y, -self.y],
            bounds=[(None, None), *zip(lower, upper, strict=True), (0, None)],
            options={"primal_feasibility_tolerance": 1e-10},
        )
        return found.fun

    def least_linear(self, pole, k, sign):
        """Return the least sign * (linear parameter k) at a fixed pole; infinity where there is none."""
        g = self.responses(pole)
        lower, upper = self.problem.lower[1 : 1 + self.n_linear], self.problem.upper[1 : 1 + self.n_linear]
        cost = np.zeros(g.shape[1])
        cost[1 + k] = sign
        found = linprog(
            cost,
            A_ub=np.r_[g, -g],
            b_ub=np.r_[self.y + self.noise_bound, self.noise_bound - self.y],
            bounds=[(None, None), *zip(lower, upper, strict=True)],
            options={"primal_feasibility_tolerance": 1e-10},
        )
        return found.fun if found.status == 0 else np.inf

    def pole_interval(self, grid=41):
        """Return the range of the pole: a grid over its box, then bisection outwards."""
        low, high = self.problem.lower[0], self.problem.upper[0]
        poles = np.unique(np.r_[np.linspace(low, high, grid), self.truth[0]])
        feasible = [p for p in poles if self.least_noise(p) <= self.noise_bound]
        ends = []
        for inside, outside in ((min(feasible), low), (max(feasible), high)):
            if inside != outside:
                beyond = poles[poles < inside][-1] if outside == low else poles[poles > inside][0]
                for _ in range(44):
                    middle = 0.5 * (inside + beyond)
                    if self.least_noise(middle) <= self.noise_bound:
                        inside = middle
                    else:
                        beyond = middle
            ends.append(inside)
        return tuple(ends)

    def linear_interval(self, k, poles, grid=25):
        """Return the range of a linear parameter: a grid over the feasible poles, then golden section."""
        ends = []
        for sign in (1, -1):
            points = np.linspace(*poles, grid)
            values = [self.least_linear(p, k, sign) for p in points]
            best = int(np.argmin(values))
            bracket = points[max(best - 1, 0)], points[min(best + 1, grid - 1)]
            polished = minimize_scalar(
                self.least_linear, args=(k, sign), bounds=bracket, method="bounded", options={"xatol": 1e-11}
            )
            ends.append(sign * min(polished.fun, values[best]))
        return tuple(ends)

    def sample(self, count, rng):
        """Return feasible points: steps around the truth, kept where the noise is inside its bound."""
        points = [self.truth]
        spread = np.abs(self.truth[: 1 + self.n_linear]) * 0.1 + 1e-3
        while len(points) < count:
            base = points[rng.integers(len(points))]
            size = 10.0 ** rng.uniform(-4, 0)
            parameters = base[: 1 + self.n_linear] + size * spread * rng.normal(size=1 + self.n_linear)
            start = self.y[0] - base[1 + self.n_linear] + size * self.noise_bound * rng.normal()
            noise = self.y - self.simulate(parameters[0], parameters[1:], start)
            point = np.r_[parameters, noise]
            if (point >= self.problem.lower).all() and (point <= self.problem.upper).all():
                points.append(point)
        return np.array(points)


def first_order(pole, linear, drive, noise_bound, seed, lower, upper, unit_gain=False, start=0.0):
    """Build a first-order model; ``lower`` and ``upper`` are the box of (pole, linear parameters)."""
    rng = np.random.default_rng(seed)
    n, width = drive.shape
    gain = 1 + pole if unit_gain else 1.0
    x = np.empty(n)
    x[0] = start
    for t in range(1, n):
        x[t] = -pole * x[t - 1] + gain * drive[t - 1] @ np.asarray(linear)
    noise = rng.uniform(-noise_bound, noise_bound, n)
    y = x + noise
    first = 1 + width  # the number of the first noise
    rows = []
    for t in range(1, n):
        row = {
            (): y[t],
            (first + t,): -1.0,
            (0,): y[t - 1],
            (0, first + t - 1): -1.0,
        }
        for k in range(width):
            row[(1 + k,)] = -drive[t - 1, k]
            if unit_gain:
                row[(0, 1 + k)] = -drive[t - 1, k]
        rows.append(row)
    names = ("a", *(f"b{k + 1}" for k in range(width)), *(f"e{t}" for t in range(n)))
    problem = PolynomialProblem(
        names,
        np.r_[lower, np.full(n, -noise_bound)],
        np.r_[upper, np.full(n, noise_bound)],
        Polynomials.from_terms(rows),
        Polynomials.empty(),
    )
    return Model(problem, np.r_[pole, linear, noise], drive, y, noise_bound, unit_gain)


def make_output_error(n=20, seed=0, pole=-0.7, gain=1.2, noise_bound=0.1):
    """Return a first-order output-error model with a random binary input."""
    u = np.random.default_rng(seed + 1000).choice([-1.0, 1.0], n)
    return first_order(pole, [gain], u[:, None], noise_bound, seed, [-1, -5], [1, 5])


CLUTCH_POLE, CLUTCH_LINEAR = -0.65142, (-0.00272, 0.03903, -0.08172)


def make_hammerstein(n=20, seed=0, noise_bound=0.3, powers=3, top=900.0):
    """Return the clutch paper's Hammerstein model, driven by a ramp: v = 0.01 u."""
    u = np.linspace(0.0, top, n)
    v = 0.01 * u
    drive = np.stack([v ** (k + 1) for k in range(powers)], axis=1)
    reach = np.array([0.01, 0.1, 0.5])[:powers]
    return first_order(
        CLUTCH_POLE,
        CLUTCH_LINEAR[:powers],
        drive,
        noise_bound,
        seed,
        [-1, *-reach],
        [1, *reach],
        unit_gain=True,
    )


def make_exact_value(polynomials, row, point):
    """Return one member's value at a rational point, its coefficients' midpoints taken as exact."""
    total = Fraction(0)
    for r, mid, factor in zip(
        polynomials.rows.tolist(),
        polynomials.coefficients.mid.tolist(),
        polynomials.factors.tolist(),
        strict=True,
    ):
        if r == row:
            total += Fraction(mid) * prod((point[v] for v in factor if v >= 0), start=Fraction(1))
    return total


@pytest.fixture(scope="session")
def output_error():
    return make_output_error


@pytest.fixture(scope="session")
def hammerstein():
    return make_hammerstein


@pytest.fixture(scope="session")
def exact_value():
    return make_exact_value
