"""Fifteen small problems of mixed kind, as a user states them: nobody gives a box where the constraints imply one."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from benchmarks.records import hammerstein, output_error
from relaxations.algebra.polynomial import Polynomials
from relaxations.formats.expressions import Constraint, Expression, problem_of, variables
from relaxations.problem.problem import PolynomialProblem
from smid import FeasibleSet
from smid.identification.finite_box import with_finite_box

Stated = tuple[PolynomialProblem, Polynomials]


def _boxed(own: Sequence[Expression], low: float, high: float) -> list[Constraint]:
    return [end for v in own for end in (v >= low, v <= high)]


def six_hump() -> Stated:
    """Return a polynomial of degree 4 in two variables with two minimisers, on a box."""
    x, y = variables("x y")
    return problem_of(4 * x**2 - 2 * x**4 + x * y - 4 * y**2 + 4 * y**4, _boxed((x, y), -1.5, 1.5))


def styblinski() -> Stated:
    """Return a separable quartic in four variables with 16 local minima, one of them global."""
    own = variables("a b c d")
    return problem_of(sum((v**4 - 16 * v**2 + 5 * v) / 2 for v in own), _boxed(own, -5, 5))


def random_quartic() -> Stated:
    """Return a dense quartic in three variables on a box."""
    own, rng = variables("a b c"), np.random.default_rng(4)
    squares = [v * w for k, v in enumerate(own) for w in own[k:]]
    cost = sum(float(rng.integers(-9, 10)) * v * w for k, v in enumerate(squares) for w in squares[k:])
    return problem_of(cost + sum(float(rng.integers(-9, 10)) * v for v in own), _boxed(own, -1, 1))


def disc() -> Stated:
    """Return an indefinite quadratic over a disc off centre, without a box."""
    x, y = variables("x y")
    return problem_of(x * y - x + y**2, [(x - 1) ** 2 + (y + 0.5) ** 2 <= 1.5])


def crescent() -> Stated:
    """Return a cubic over the part of a disc that lies outside of another one."""
    x, y = variables("x y")
    return problem_of(x**3 - 3 * x * y, [x**2 - 4 * x + y**2 <= 0, (x - 1) ** 2 + y**2 >= 1, y >= 0])


def zeros_and_ones() -> Stated:
    """Return a quadratic in six variables with x^2 = x."""
    own, rng = variables("a b c d e f"), np.random.default_rng(1)
    cost = sum(float(rng.integers(-9, 10)) * v * w for k, v in enumerate(own) for w in own[k:])
    return problem_of(cost, [*(v**2 == v for v in own), sum(own, 0 * own[0]) <= 4])


def knapsack() -> Stated:
    """Return the concave quadratic program of Floudas and Pardalos with five variables and one row (problem 2.1.1)."""
    own = variables("a b c d e")
    cost = sum(c * v - 50 * v**2 for c, v in zip((42, 44, 45, 47, 47.5), own, strict=True))
    weight = sum(c * v for c, v in zip((20, 12, 11, 7, 4), own, strict=True))
    return problem_of(cost, [weight <= 40, *_boxed(own, 0, 1)])


def _quadratic(n: int, seed: int, concave: bool) -> Stated:
    rng = np.random.default_rng(seed)
    own = variables(" ".join(f"x{k}" for k in range(n)))
    root = rng.integers(-3, 4, (n, n))
    matrix = -(root @ root.T) if concave else root + root.T
    cost = sum(float(matrix[i, j]) * own[i] * own[j] for i in range(n) for j in range(n))
    cost = cost + sum(float(c) * v for c, v in zip(rng.integers(-9, 10, n), own, strict=True))
    rows = rng.integers(0, 6, (3, n))
    constraints = [sum(float(c) * v for c, v in zip(row, own, strict=True)) <= float(row.sum()) / 2 for row in rows]
    return problem_of(cost, [*constraints, *_boxed(own, 0, 1)])


def motzkin() -> Stated:
    """Return Motzkin's form on the unit ball: its minimum is 0, and no sum of squares equals it."""
    x, y, z = variables("x y z")
    form = x**4 * y**2 + x**2 * y**4 + z**6 - 3 * x**2 * y**2 * z**2
    return problem_of(form, [x**2 + y**2 + z**2 <= 1])


def _output_error(sign: float) -> Stated:
    known = output_error(20)
    problem = with_finite_box(FeasibleSet(known.model, known.data, known.noise_bound)).feasible.problem
    return problem, problem.variable(0, sign)


def _hammerstein(variable: int) -> Stated:
    known = hammerstein(20)
    problem = with_finite_box(FeasibleSet(known.model, known.data, known.noise_bound)).feasible.problem
    return problem, problem.variable(variable)


SMALL: dict[str, Callable[[], Stated]] = {
    "quartic, six humps, 2 variables": six_hump,
    "quartic, separable, 4 variables": styblinski,
    "quartic, dense, 3 variables": random_quartic,
    "disc off centre": disc,
    "crescent": crescent,
    "zeros and ones, 6 variables": zeros_and_ones,
    "concave QP, 5 variables": knapsack,
    "concave QP, 6 variables": lambda: _quadratic(6, 2, concave=True),
    "concave QP, 8 variables": lambda: _quadratic(8, 3, concave=True),
    "indefinite QP, 6 variables": lambda: _quadratic(6, 5, concave=False),
    "indefinite QP, 8 variables": lambda: _quadratic(8, 6, concave=False),
    "ball, no sum of squares": motzkin,
    "output error, N = 20, pole from below": lambda: _output_error(1.0),
    "output error, N = 20, pole from above": lambda: _output_error(-1.0),
    "Hammerstein, N = 20, pole": lambda: _hammerstein(0),
}
