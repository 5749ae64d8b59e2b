"""Minima of polynomials: the bound below, the point above, and where they must meet."""

from itertools import pairwise

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from relaxations.algebra.polynomial import Polynomials
from relaxations.errors import ProblemError
from relaxations.library import load
from relaxations.points.extraction import minimisers
from relaxations.points.local_search import local_minimum
from relaxations.problem.problem import PolynomialProblem, from_sympy
from relaxations.proof.bounding import relax
from relaxations.reductions.products import with_products
from relaxations.reductions.vanishing import cases, products, settle
from relaxations.search import minimum
from relaxations.search.minimum import MinimumReason, minimise

X, Y, Z = sympy.symbols("x y z")
SQUARE = {X: (-4, 4), Y: (-4, 4)}

# Each needs something: a higher order, contraction, branching, or the cases of a product.
QUICK = ("gms_st_e01", "gms_st_e09", "gms_st_e10", "gms_Bex3_1_4", "gms_Bex2_1_2", "gms_Bex9_2_8", "gms_Bst_e07")


@pytest.mark.parametrize("name", QUICK)
def test_a_bound_meets_the_known_optimum(name):
    case = load(name)
    found = minimise(case.problem, case.objective)
    size = max(1.0, abs(case.optimum))
    assert found.reason is MinimumReason.TIGHT
    # The optima of the library are known to about seven digits.
    assert case.optimum - 1e-6 * size < found.lower < case.optimum + 1e-7 * size
    assert found.upper == pytest.approx(case.optimum, abs=3e-6 * size)


def test_a_box_that_shrinks_to_a_point_is_proof_enough():
    # Complementary products on a box of 15 by 1e-7: what is left of it scales equalities beyond what a solver can do.
    case = load("gms_Bex9_2_2")
    found = minimise(case.problem, case.objective, order=1)
    assert found.reason is MinimumReason.TIGHT
    assert case.optimum - 1e-6 * case.optimum < found.lower <= case.optimum


def test_products_of_complementary_variables_are_branched_on():
    # Without the cases x = 0 and y = 0 the set has no interior, and bounds stall.
    problem, objective = from_sympy(
        2 * X + Y - Z, [], [X * Y, X + Y - 3 + Z], [X, Y, Z], {X: (0, 50), Y: (0, 50), Z: (0, 2)}
    )
    found = minimise(problem, objective, order=1)
    assert found.lower == pytest.approx(-1.0, abs=1e-6)
    assert found.lower <= -1.0 <= found.upper <= -1.0 + 1e-6
    assert found.point == pytest.approx({"x": 0.0, "y": 1.0, "z": 2.0}, abs=1e-6)


@given(st.lists(st.integers(-5, 5), min_size=10, max_size=10), st.integers(0, 10**6))
@settings(max_examples=25, deadline=None)
def test_no_point_lies_below_the_bound(coefficients, seed):
    monomials = [X, Y, X * Y, X**2, Y**2, X**3, X**2 * Y, X * Y**2, Y**3, X**4 + Y**4]
    expression = sum(c * m for c, m in zip(coefficients, monomials, strict=True))
    problem, objective = from_sympy(expression + 0 * X, [4 - X**2 - Y], [], [X, Y], {X: (-2, 2), Y: (-1, 3)})
    found = minimise(problem, objective, nodes=20)
    points = np.random.default_rng(seed).uniform([-2, -1], [2, 3], (200, 2))
    values = [objective.evaluate(p)[0] for p in points if 4 - p[0] ** 2 - p[1] >= 0]
    assert found.lower <= min(values) + 1e-9
    assert found.lower <= found.upper


def test_the_four_minima_of_himmelblau_are_extracted():
    expression = (X**2 + Y - 11) ** 2 + (X + Y**2 - 7) ** 2
    problem, objective = from_sympy(expression, [], [], [X, Y], {X: (-5, 5), Y: (-5, 5)})
    known = np.array([[3, 2], [-2.805118, 3.131312], [-3.77931, -3.283186], [3.584428, -1.848127]])
    relaxed = relax(problem, "dense", 3, objective=objective)
    certified = relaxed.bound(objective)
    points = [relaxed.scaling.recover(p) for p in minimisers(relaxed.relaxation, certified.moments, 1)]
    assert -1e-5 < certified.bound <= 0.0
    assert len(points) == 4
    for point in known:
        assert min(np.abs(point - other).max() for other in points) < 1e-2


def test_minimisers_are_read_from_a_flat_moment_matrix_only():
    # Two minimisers, (-1, 1) and (1, 1): flat at order 2.
    problem, objective = from_sympy((X**2 - 1) ** 2 + (Y - 1) ** 2, [], [], [X, Y], SQUARE)
    relaxed = relax(problem, "dense", 2, objective=objective)
    certified = relaxed.bound(objective)
    scaled = minimisers(relaxed.relaxation, certified.moments)
    points = sorted(relaxed.scaling.recover(p).tolist() for p in scaled)
    np.testing.assert_allclose(points, [[-1, 1], [1, 1]], atol=1e-3)
    # All of a circle is minimal: no finite number of points.
    problem, objective = from_sympy((X**2 + Y**2 - 1) ** 2, [], [], [X, Y], SQUARE)
    relaxed = relax(problem, "dense", 2, objective=objective)
    assert minimisers(relaxed.relaxation, relaxed.bound(objective).moments) is None


def apart(*names):
    """Return named problems side by side, a fixed variable behind them, the sum of the objectives and its optimum."""
    cases = [load(name) for name in names]
    offsets = np.cumsum([0, *(c.problem.n_variables for c in cases)])

    def moved(families):
        return Polynomials.join(
            [
                Polynomials(p.n_rows, p.rows, np.where(p.factors >= 0, p.factors + at, -1), p.coefficients)
                for p, at in zip(families, offsets[:-1], strict=True)
            ]
        )

    goal = moved([c.objective for c in cases])
    problem = PolynomialProblem(
        tuple(f"x{k}" for k in range(offsets[-1] + 1)),
        np.r_[(*(c.problem.lower for c in cases), 1.0)],
        np.r_[(*(c.problem.upper for c in cases), 1.0)],
        moved([c.problem.equalities for c in cases]),
        moved([c.problem.inequalities for c in cases]),
    )
    together = Polynomials(1, np.zeros_like(goal.rows), goal.factors, goal.coefficients).collect()
    return problem, together, sum(c.optimum for c in cases)


def test_the_order_is_raised_first_where_the_moments_are_not_flat(monkeypatch):
    # The first needs order 3, the second order 2.
    problem, objective, optimum = apart("gms_Bex3_1_4", "gms_st_e24")
    orders = []

    def recorded(problem, method, order, *rest):
        orders.append(order)
        return relax(problem, method, order, *rest)

    monkeypatch.setattr(minimum, "relax", recorded)
    found = minimise(problem, objective, nodes=0, tolerance=1e-5)
    assert orders == [1, 1, 2, (3, 2, 2)]  # order 1 once more with products of constraints
    assert found.order == 3
    assert found.reason is MinimumReason.TIGHT
    assert optimum - 1e-5 < found.lower < optimum + 1e-6


@pytest.mark.parametrize("orders", [(2, 3), (3, 2)])
def test_cliques_of_different_orders_bound_between_those_of_one(orders):
    problem, objective = from_sympy(
        X * Y - Y**3 * Z + Z**4 - X**2, [1 - X**2 - Y**4], [], [X, Y, Z], {X: (-1, 1), Y: (-1, 1), Z: (-1, 1)}
    )
    low, own, high = (
        relax(problem, "sparse", order, objective=objective).bound(objective).bound for order in (2, orders, 3)
    )
    assert low - 1e-6 <= own <= high + 1e-5
    points = np.random.default_rng(0).uniform(-1, 1, (500, 3))
    values = [objective.evaluate(p)[0] for p in points if p[0] ** 2 + p[1] ** 4 <= 1]
    assert own <= min(values)


def test_an_empty_set_is_proven_empty():
    problem, objective = from_sympy(X, [1 - X**2 - Y**2, X + Y - 2], [], [X, Y], SQUARE)
    found = minimise(problem, objective)
    assert found.reason is MinimumReason.EMPTY
    assert found.lower == np.inf
    assert "proven" in str(found)


def test_a_problem_without_a_box_is_refused():
    problem, objective = from_sympy(X**2 + Y**2, [], [], [X, Y], {X: (-1, 1)})
    with pytest.raises(ProblemError, match="y has no finite box"):
        minimise(problem, objective)


def test_an_order_that_is_too_low_is_refused():
    problem, objective = from_sympy(X**4, [], [], [X], {X: (-1, 1)})
    with pytest.raises(ProblemError, match="the least order is 2"):
        minimise(problem, objective, order=1)


def test_a_problem_that_memory_does_not_hold_is_refused_before_it_is_built():
    names = sympy.symbols("x0:40")
    problem, objective = from_sympy(sum(names) ** 2, [], [], names, dict.fromkeys(names, (-1, 1)))
    with pytest.raises(ProblemError, match=r"width 135751 and about .* TB of memory; this machine has"):
        minimise(problem, objective, order=4)


def test_what_was_proven_before_an_interrupt_is_returned():
    case = load("floudas_3_2")

    def interrupt(line):
        if "order 1" in line:
            raise KeyboardInterrupt

    found = minimise(case.problem, case.objective, progress=interrupt)
    assert found.reason is MinimumReason.INTERRUPTED
    assert 2000 < found.lower < case.optimum


def test_time_that_is_used_up_is_said():
    case = load("floudas_3_2")
    found = minimise(case.problem, case.objective, seconds=1e-3)
    assert found.reason is MinimumReason.TIME
    assert -np.inf < found.lower <= case.optimum  # of the box alone


# ---------------------------------------------------------------- the steps


@given(st.integers(0, 10**6))
@settings(max_examples=30, deadline=None)
def test_products_of_constraints_cut_no_feasible_point_off(seed):
    rng = np.random.default_rng(seed)
    a, b = rng.normal(size=(3, 2)), rng.uniform(0, 1, 3)
    rows = [float(b[k]) - float(a[k, 0]) * X - float(a[k, 1]) * Y for k in range(3)]
    problem, _ = from_sympy(None, [*rows, 3 - X * Y], [], [X, Y], {X: (-1, 2), Y: (-2, 1)})
    more = with_products(problem)
    assert more.inequalities.n_rows > problem.inequalities.n_rows
    points = rng.uniform([-1, -2], [2, 1], (100, 2))
    for point in points:
        if problem.inequalities.evaluate(point).min() >= 0:
            assert more.inequalities.evaluate(point).min() >= -1e-12


def test_products_of_constraints_are_all_there():
    problem, _ = from_sympy(None, [3 - X - Y], [], [X, Y], {X: (0, 2), Y: (0, 2)})
    more = with_products(problem).inequalities
    x, y = point = np.array([0.5, 0.75])
    row, ends = 3 - x - y, ((x, 2 - x), (y, 2 - y))
    expected = [row, *(row * end for pair in ends for end in pair), *(a * b for a in ends[0] for b in ends[1])]
    np.testing.assert_allclose(np.sort(more.evaluate(point)), np.sort(expected))


def test_products_tighten_the_least_order():
    problem, objective = from_sympy(-X * Y, [3 - X - Y], [], [X, Y], {X: (0, 2), Y: (0, 2)})
    plain = relax(problem, "sparse", 1, objective=objective).bound(objective).bound
    tight = relax(with_products(problem), "sparse", 1, objective=objective).bound(objective).bound
    assert plain < tight <= -2.25


def test_a_vanishing_product_is_settled_or_split_into_cases():
    problem, _ = from_sympy(None, [], [X * Y, Y * Z], [X, Y, Z], {X: (1, 2), Y: (0, 2), Z: (-1, 1)})
    found = products(problem)
    assert found == ((0, 1), (1, 2))
    settled = settle(problem, found)
    assert settled.lower[1] == settled.upper[1] == 0.0  # x is not zero, so y is
    assert cases(settled, found[0]) == []
    assert [p.upper.tolist() for p in cases(problem, found[1])] == [[2, 0, 1], [2, 2, 0]]
    nowhere = problem.with_box(np.array([1.0, 1.0, -1.0]), problem.upper)
    assert settle(nowhere, found) is None


def test_members_are_multiplied_and_subtracted_exactly():
    rng = np.random.default_rng(3)
    left = Polynomials.from_terms([{(0,): 2.0, (1, 1): -1.0}, {(): 0.5}])
    right = Polynomials.from_terms([{(): 1.0, (0, 1): 3.0}, {(1,): 4.0, (0,): 1.0}])
    for point in rng.normal(size=(5, 2)):
        np.testing.assert_allclose(
            left.times(right).evaluate(point), left.evaluate(point) * right.evaluate(point), rtol=1e-12
        )
        np.testing.assert_allclose(left.below(7.0).evaluate(point), 7.0 - left.evaluate(point), rtol=1e-12)


def test_a_local_minimum_copes_with_equalities_that_depend_on_each_other():
    problem, objective = from_sympy(X**2 + Y**2, [], [X + Y - 1, 2 * X + 2 * Y - 2], [X, Y], {X: (-1, 1), Y: (-1, 1)})
    np.testing.assert_allclose(local_minimum(problem, objective, np.array([1.0, -1.0])), [0.5, 0.5], atol=1e-6)


def test_the_order_of_the_contraction_counts_the_objective_as_a_constraint(monkeypatch):
    # The terms of the sum have two variables each, so branching takes order 4. As a constraint the sum has all ten.
    names = sympy.symbols("x0:10")
    expression = sum((v**2 - sympy.Rational(1, 3)) ** 2 + v * w / 8 for v, w in pairwise(names))
    problem, objective = from_sympy(expression, [], [], names, dict.fromkeys(names, (-1, 1)))
    orders = []

    def recorded(*_, order, **__):
        orders.append(order)
        raise KeyboardInterrupt

    monkeypatch.setattr(minimum, "intervals", recorded)
    minimise(problem, objective, order=4, tolerance=1e-14, nodes=2)
    assert orders == [2]
