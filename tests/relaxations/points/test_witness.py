"""Witnesses: a feasible point is proven, an infeasible one never, however rounding errors grow."""

from fractions import Fraction

import numpy as np
import pytest
import sympy

from relaxations.algebra.polynomial import Polynomials
from relaxations.moments.parametric_lift import complicating_variables
from relaxations.points.linear_step import linear_step
from relaxations.points.witness import definition_order, find_witness, search, verify
from relaxations.problem.problem import PolynomialProblem, from_sympy


def feasible_in_fractions(problem, point, defined, exact_value):
    """Return the exact feasible point: the free variables are floats, the others follow."""
    exact = [Fraction(v) for v in point.tolist()]
    for row, v in defined:
        without = list(exact)
        without[v] = Fraction(0)
        constant = exact_value(problem.equalities, row, without)
        without[v] = Fraction(1)
        slope = exact_value(problem.equalities, row, without) - constant
        exact[v] = -constant / slope
    return exact


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("kind", ["output_error", "hammerstein"])
def test_a_witness_is_feasible_in_fractions(request, exact_value, kind, seed):
    model = request.getfixturevalue(kind)(12, seed=seed)
    problem = model.problem
    objective = problem.variable(0)
    witness = verify(problem, objective, model.truth)
    assert witness is not None
    exact = feasible_in_fractions(problem, model.truth, definition_order(problem.equalities), exact_value)
    assert all(exact_value(problem.equalities, row, exact) == 0 for row in range(problem.equalities.n_rows))
    assert all(
        Fraction(a) <= v <= Fraction(b)
        for v, a, b in zip(exact, problem.lower.tolist(), problem.upper.tolist(), strict=True)
    )
    assert Fraction(witness.value) >= exact[0]
    assert witness.value == pytest.approx(float(exact[0]), rel=1e-12)
    assert witness.point == pytest.approx(np.array([float(v) for v in exact]), rel=1e-12, abs=1e-14)


@pytest.mark.parametrize("kind", ["output_error", "hammerstein"])
def test_an_infeasible_point_is_no_witness(request, kind):
    model = request.getfixturevalue(kind)(20, seed=1)
    objective = model.problem.variable(0)
    for k in range(1 + model.n_linear):
        wrong = model.truth.copy()
        wrong[k] += 0.5
        assert verify(model.problem, objective, wrong) is None


def test_a_point_is_no_witness_where_an_inequality_fails_by_a_hair():
    x, y = sympy.symbols("x y")
    problem, objective = from_sympy(x, [1 - x * y], [], [x, y], {x: (0, 4), y: (0, 4)})
    assert verify(problem, objective, np.array([2.0, 0.5])) is not None
    assert verify(problem, objective, np.array([2.0, np.nextafter(0.5, 1)])) is None
    assert verify(problem, objective, np.array([np.nextafter(4, 5), 0.0])) is None


def test_a_divisor_that_may_vanish_proves_nothing():
    x, y = sympy.symbols("x y")
    problem, objective = from_sympy(y, [], [x * y - 1], [x, y], {x: (-1, 1), y: (-5, 5)})
    assert verify(problem, objective, np.array([0.5, 2.0])) is not None
    assert verify(problem, objective, np.array([0.0, 0.0])) is None


def test_equalities_without_an_order_of_definition_have_no_witness():
    x, y = sympy.symbols("x y")
    problem, objective = from_sympy(x, [], [x + y**2 - 1, x**2 + y - 1], [x, y], {x: (-2, 2), y: (-2, 2)})
    order = definition_order(problem.equalities)
    assert order is None or len({v for _, v in order}) == 2
    if order is None:
        assert verify(problem, objective, np.array([0.0, 1.0])) is None


def test_each_equality_defines_a_variable_of_its_own_in_an_order_that_can_be_computed(output_error):
    equalities = output_error(30).problem.equalities
    order = definition_order(equalities)
    assert sorted(row for row, _ in order) == list(range(equalities.n_rows))
    defined = [v for _, v in order]
    assert len(set(defined)) == len(defined)
    for place, (row, v) in enumerate(order):
        holds = set(equalities.factors[equalities.rows == row].ravel().tolist())
        assert v in holds
        assert not holds & set(defined[place + 1 :])


@pytest.mark.parametrize("n", [300, 4000])
def test_an_oscillating_recursion_of_second_order_is_verified(n):
    """Over 4000 samples intervals lose some 4400 bits, more than the exponent of a float counts."""
    bound = 0.1
    pole = 0.98 * np.exp(0.5j)
    a1, a2, b = -2 * pole.real, abs(pole) ** 2, 0.5
    rng = np.random.default_rng(12)
    u = rng.choice([-1.0, 1.0], n)
    x = np.zeros(n)
    for t in range(2, n):
        x[t] = -a1 * x[t - 1] - a2 * x[t - 2] + b * u[t - 1]
    noise = rng.uniform(-bound, bound, n)
    y = x + noise
    first = 3
    rows = [
        {
            (): y[t],
            (first + t,): -1.0,
            (0,): y[t - 1],
            (0, first + t - 1): -1.0,
            (1,): y[t - 2],
            (1, first + t - 2): -1.0,
            (2,): -u[t - 1],
        }
        for t in range(2, n)
    ]
    problem = PolynomialProblem(
        ("a1", "a2", "b", *(f"e{t}" for t in range(n))),
        np.r_[-2, -1, -5, np.full(n, -bound)],
        np.r_[2, 1, 5, np.full(n, bound)],
        Polynomials.from_terms(rows),
        Polynomials.empty(),
    )
    truth = np.r_[a1, a2, b, noise]
    witness = verify(problem, problem.variable(0), truth)
    assert witness is not None
    assert witness.value == pytest.approx(a1, abs=1e-12)
    assert witness.point == pytest.approx(truth, abs=1e-9)
    wrong = truth.copy()
    wrong[0] += 0.05
    assert verify(problem, problem.variable(0), wrong) is None


@pytest.mark.parametrize("radius", [0.0, 0.02])
@pytest.mark.parametrize("kind", ["output_error", "hammerstein"])
def test_a_step_in_few_unknowns_is_the_step_in_all(request, kind, radius):
    model = request.getfixturevalue(kind)(30, seed=2)
    problem, objective = model.problem, model.problem.variable(0)
    complicating = complicating_variables(problem)
    whole, few = (
        linear_step(problem, objective, complicating, model.truth, radius, 1e-9, order)
        for order in (None, definition_order(problem.equalities))
    )
    assert few[1] == whole[1] == 0.0
    assert few[2] == pytest.approx(whole[2], abs=1e-8)
    rows, columns, values = problem.equalities.jacobian(model.truth)
    left = problem.equalities.evaluate(model.truth)
    np.add.at(left, rows, values * (few[0] - model.truth)[columns])
    assert left == pytest.approx(0.0, abs=1e-9)
    assert (problem.lower - 1e-9 <= few[0]).all()
    assert (few[0] <= problem.upper + 1e-9).all()


def test_the_search_improves_the_objective_and_ends_in_a_witness(output_error):
    model = output_error(20, seed=3)
    problem = model.problem
    complicating = complicating_variables(problem)
    for sign, oracle_end in zip((1.0, -1.0), model.pole_interval(), strict=True):
        found = find_witness(problem, problem, problem.variable(0, sign), complicating, model.truth)
        assert found is not None
        assert sign * found.point[0] <= sign * model.truth[0] + 1e-9
        assert sign * found.point[0] >= sign * oracle_end - 1e-8


def test_the_search_finds_nothing_in_an_empty_set():
    x, y = sympy.symbols("x y")
    problem, objective = from_sympy(x, [], [x * y - 2], [x, y], {x: (-1, 1), y: (-1, 1)})
    assert search(problem, objective, np.array([0]), np.array([0.5, 0.5]), 1e-9) is None
