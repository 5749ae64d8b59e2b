"""A minimum is tight only where a point is proven to be feasible, and its value is near the bound."""

from fractions import Fraction

import numpy as np
import pytest
import sympy
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.frontier.analytic import judged
from benchmarks.frontier.analytic_problems import AnalyticProblem, problems
from relaxations.formats.expressions import minimise, variables
from relaxations.library import load
from relaxations.points.exact_point import simplest
from relaxations.points.newton_point import newton_point
from relaxations.problem.problem import from_sympy
from relaxations.search.enclosure import Reason as EndsReason
from relaxations.search.hierarchy import intervals
from relaxations.search.minimum import MinimumReason

x, y = variables("x y")
UNIT = [x >= 0, x <= 1, y >= 0, y <= 1]


def test_an_empty_set_that_no_relaxation_shows_is_not_called_tight():
    found = minimise(x, [x + y == 1, x + y == 1 + 1e-12, *UNIT])
    assert found.reason is not MinimumReason.TIGHT
    assert not found.points
    assert np.isnan(found.upper)


def test_an_empty_set_that_contraction_shows_is_proven_empty():
    assert minimise(x + y, [x * y >= 1 + 1e-12, *UNIT]).reason is MinimumReason.EMPTY


def test_the_search_goes_on_until_a_verified_value_meets_the_bound():
    # On this box a local search is good for three digits, and its value is below the minimum.
    found = minimise(x + y, [x * y == 1, x >= 1e-6, x <= 1e6, y >= 1e-6, y <= 1e6])
    assert found.lower <= 2 <= found.upper
    assert found.reason is MinimumReason.TIGHT
    assert found.gap <= 2e-6


def test_a_gap_beyond_the_tolerance_is_not_called_tight():
    # Doubles that are near 1e10 do not tell 1e-6.
    found = minimise(y - 10**10 * x, [y >= 10**10 * x, x >= 0, x <= 1, y >= 0, y <= 10**10])
    assert found.lower <= 0 <= found.upper
    assert (found.reason is MinimumReason.TIGHT) == (found.gap <= 1e-6)


def test_a_reason_says_that_no_point_was_verified():
    # Three tenths is no float: for no coefficients as near as that does the disc hold its centre.
    found = minimise(x, [(x - Fraction(3, 10)) ** 2 + y**2 <= 0, x >= -1, x <= 1, y >= -1, y <= 1])
    assert found.reason is MinimumReason.UNVERIFIED
    assert "no feasible point was verified" in str(found)
    assert found.lower <= 0.3


@pytest.mark.parametrize("case", problems()[::4], ids=lambda case: f"{case.kind}, {case.name}")
def test_no_statement_about_a_problem_known_in_fractions_is_false(case: AnalyticProblem):
    assert judged(minimise(case.objective, case.constraints), case.minimum) == ()


@pytest.mark.parametrize("name", ["gms_Bst_robot", "gms_meanvar", "gms_st_e01"])
def test_the_minimum_of_a_named_problem_with_curved_equalities_is_verified(name):
    case = load(name)
    found = minimise_named(case)
    assert found.reason is MinimumReason.TIGHT
    assert found.points
    assert found.gap <= 1e-6 * max(1.0, abs(found.upper))


def minimise_named(case):
    from relaxations.search.minimum import minimise

    return minimise(case.problem, case.objective)


def test_ends_are_tight_only_beside_witnesses():
    a, b = sympy.symbols("a b")
    box = {a: (-1, 1), b: (-1, 1)}
    for problem in (
        from_sympy(None, [1 - a**2 - b**2, 3 * a + 4 * b - 5], [], [a, b], box)[0],  # a single point
        from_sympy(None, [], [a**2 + b**2 - 1, a - b], [a, b], box)[0],  # two points on a curve
    ):
        found = intervals(problem, [0], tolerance=1e-3)
        if found.reason is EndsReason.TIGHT:
            assert found.witnesses
            assert max(i.gap - 1e-3 * i.width for i in found.intervals) <= 1e-6


# ---------------------------------------------------------------- points on curves


X, Y = sympy.symbols("x y")
SQUARE = {X: (-4, 4), Y: (-4, 4)}


@given(st.integers(0, 10**6))
def test_a_point_on_two_circles_is_proven_near_the_exact_one(seed):
    rng = np.random.default_rng(seed)
    p, q = (sympy.Rational(int(rng.integers(-20, 21)), 16) for _ in range(2))
    circles = []
    for _ in range(2):
        a, b = (sympy.Rational(int(rng.integers(-20, 21)), 16) for _ in range(2))
        circles.append((X - a) ** 2 + (Y - b) ** 2 - (p - a) ** 2 - (q - b) ** 2)
    problem, objective = from_sympy(X + Y, [], circles, [X, Y], SQUARE)
    exact = np.array([float(p), float(q)])
    found = newton_point(problem, objective, exact + rng.uniform(-1e-7, 1e-7, 2))
    if found is None:  # circles that touch, or are one
        slopes = np.array([[float(c.diff(v).subs({X: p, Y: q})) for v in (X, Y)] for c in circles])
        assert abs(np.linalg.det(slopes)) < 1e-2
        return
    assert found.point == pytest.approx(exact, abs=1e-12)
    assert Fraction(found.value) >= Fraction(int((p + q).p), int((p + q).q))


@pytest.mark.parametrize("miss", [1e-3, 1e-9, 1e-14])
def test_circles_that_miss_each_other_hold_no_point(miss):
    circles = [X**2 + Y**2 - 1, (X - 2 - sympy.Rational(miss)) ** 2 + Y**2 - 1]
    problem, objective = from_sympy(X, [], circles, [X, Y], SQUARE)
    for start in ((1.0, 0.0), (1.0 + miss / 2, 1e-8), (1.0, 1e-3)):
        assert newton_point(problem, objective, np.array(start)) is None


def test_a_constraint_that_fails_beside_the_curve_is_seen():
    problem, objective = from_sympy(X, [Y - sympy.Rational(3, 4)], [X**2 + Y**2 - 2, X - Y**2], [X, Y], SQUARE)
    assert newton_point(problem, objective, np.array([1.0, 1.0])) is not None
    problem, objective = from_sympy(X, [Y - sympy.Rational(5, 4)], [X**2 + Y**2 - 2, X - Y**2], [X, Y], SQUARE)
    assert newton_point(problem, objective, np.array([1.0, 1.0])) is None


@given(st.fractions(-3, 3, max_denominator=60), st.fractions(0, 1, max_denominator=40))
def test_the_simplest_fraction_has_the_least_denominator(value, reach):
    value = Fraction(float(value))
    found = simplest(float(value), reach)
    assert abs(found - value) <= reach
    for denominator in range(1, min(found.denominator, 200)):
        low, high = (value - reach) * denominator, (value + reach) * denominator
        assert -(-low // 1) > high  # no whole number between
