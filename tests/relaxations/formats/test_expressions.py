"""Problems written with operators: exact algebra, boxes that follow, minima between a certificate and a witness."""

import operator
from fractions import Fraction

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from relaxations.errors import ProblemError
from relaxations.formats.expressions import Constraint, constant, minimise, problem_of, variables
from relaxations.formats.implied_box import implied_box

x, y, z = variables("x y z")
SYMBOLS = dict(zip("xyz", sympy.symbols("x y z"), strict=True))


def as_sympy(expression):
    """Return an expression term by term in sympy."""
    return sum(
        (
            sympy.Rational(c.numerator, c.denominator) * sympy.prod([SYMBOLS[v] for v in m])
            for m, c in expression.terms.items()
        ),
        sympy.S(0),
    )


def trees():
    """Return a strategy of pairs (expression, the same in sympy)."""
    numbers = st.fractions(-5, 5, max_denominator=12)
    leaves = st.one_of(
        st.sampled_from([(e, SYMBOLS[n]) for n, e in zip("xyz", (x, y, z), strict=True)]),
        numbers.map(lambda f: (constant(f), sympy.Rational(f.numerator, f.denominator))),
    )

    def combined(children):
        def applied(op, left, right):
            return op(left[0], right[0]), op(left[1], right[1])

        def powered(base, exponent):
            return base[0] ** exponent, base[1] ** exponent

        return st.one_of(
            st.builds(applied, st.sampled_from([operator.add, operator.sub, operator.mul]), children, children),
            st.builds(powered, children, st.integers(0, 3)),
        )

    return st.recursive(leaves, combined, max_leaves=6)


@settings(max_examples=80, deadline=None, derandomize=True)
@given(trees())
def test_the_algebra_is_that_of_sympy(pair):
    ours, theirs = pair
    assert sympy.expand(as_sympy(ours) - theirs) == 0
    assert all(ours.terms.values())
    assert list(ours.terms) == [tuple(sorted(m)) for m in ours.terms]


def test_numbers_are_taken_exactly():
    assert (0.1 * x).terms == {("x",): Fraction(0.1)}
    assert (x / 3).terms == {("x",): Fraction(1, 3)}
    assert (np.float64(0.5) * x - np.int64(2)).terms == {("x",): Fraction(1, 2), (): Fraction(-2)}
    assert (x - x).terms == {}
    assert str(2 - (x - y / 2) ** 2) == "-x**2 + x*y - 1/4*y**2 + 2"
    assert str(x - x) == "0"


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: 1 / x, "division by x, which is not a constant"),
        (lambda: x / 0, "division of x by zero"),
        (lambda: x**-1, "the exponent -1 is not a whole number"),
        (lambda: x**0.5, "the exponent 0.5 is not a whole number"),
        (lambda: x**y, "the exponent y is not a whole number"),
        (lambda: x**10**9, "is above 500"),
        (lambda: x + float("nan"), "nan is not a finite real number"),
        (lambda: x * "a", "'a' is not a finite real number"),
        (lambda: 1 <= x <= 2, "write 1 <= x <= 2 as two constraints"),
        (lambda: variables("x x"), "does not list distinct names"),
        (lambda: variables("2x"), "does not list distinct names"),
        (lambda: problem_of(x, [True]), "constraint 0 is True: compare expressions"),
        (lambda: problem_of(1), "hold a variable"),
        (lambda: problem_of(x, [x >= 2, x <= 1]), r"leave x the empty box \[2.0, 1.0\]"),
        (lambda: minimise(x + y, [x**2 <= 1]), "y has no finite box"),
    ],
)
def test_what_is_no_polynomial_problem_is_refused_by_cause(make, message):
    with pytest.raises(ProblemError, match=message):
        make()


def test_bounds_of_one_variable_become_its_box():
    problem, _ = problem_of(x, [x >= 1, 3 * y <= 1, z == 2, y + 1 >= 0, x <= 5, x + y + z <= 8])
    assert problem.names == ("x", "y", "z")
    assert problem.lower.tolist() == [1.0, -1.0, 2.0]
    # No float is a third: the box is rounded outwards.
    assert problem.upper[[0, 2]].tolist() == [5.0, 2.0]
    assert Fraction(problem.upper[1]) > Fraction(1, 3) > Fraction(np.nextafter(problem.upper[1], 0))
    assert (problem.equalities.n_rows, problem.inequalities.n_rows) == (0, 1)


# ---------------------------------------------------------------- implied boxes

IMPLIED = {
    "disc": ([x**2 + y**2 <= 4], {"x": (-2, 2), "y": (-2, 2)}),
    "chain": ([x**2 <= 9, y == x**3 + x, z**3 <= y, z**3 >= y], {"x": (-3, 3), "y": (-30, 30)}),
    "simplex": ([x >= 0, y >= 0, 2 * x + y <= 6], {"x": (0, 3), "y": (0, 6)}),
    "fourth power": ([x**4 - 16 <= 0, y**2 == x], {"x": (-2, 2)}),
    "product": ([x**2 <= 1, x >= -1, y**2 <= 1 + x * z, z >= 0, z <= 3], {"y": (-2, 2)}),
    "nothing": ([x * y <= 1, z >= 0], {"x": (None, None), "y": (None, None), "z": (0, None)}),
    "crossed": ([x**2 + x * y + y**2 <= 1], {"x": (None, None), "y": (None, None)}),
}


@pytest.mark.parametrize("name", IMPLIED)
def test_implied_boxes(name):
    constraints, wanted = IMPLIED[name]
    problem, _ = problem_of(x + y + z, constraints)
    for v, (low, high) in wanted.items():
        k = problem.names.index(v)
        assert problem.lower[k] == pytest.approx(-np.inf if low is None else low)
        assert problem.upper[k] == pytest.approx(np.inf if high is None else high)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.data())
def test_an_implied_box_holds_every_feasible_point(data):
    point = {v: data.draw(st.fractions(-3, 3, max_denominator=7)) for v in "xyz"}
    monomials = st.lists(st.sampled_from("xyz"), max_size=4).map(lambda m: tuple(sorted(m)))
    coefficients = st.fractions(-3, 3, max_denominator=5).filter(bool)
    constraints = []
    for _ in range(data.draw(st.integers(1, 3))):
        terms = data.draw(st.dictionaries(monomials, coefficients, min_size=1, max_size=4))
        value = sum((c * np.prod([point[v] for v in m], initial=Fraction(1)) for m, c in terms.items()), Fraction(0))
        # The point satisfies it with equality, or with a slack.
        equality = data.draw(st.booleans())
        slack = Fraction(0) if equality else data.draw(st.fractions(0, 2, max_denominator=3))
        terms[()] = terms.get((), Fraction(0)) - value + slack
        constraints.append((terms, equality))
    start = {v: data.draw(st.sampled_from([(None, None), (Fraction(-3), None), (None, Fraction(3))])) for v in "xyz"}
    box = implied_box(constraints, start)
    for v, (low, high) in box.items():
        assert low is None or low <= point[v]
        assert high is None or point[v] <= high
        assert start[v][0] is None or low == start[v][0]


@pytest.mark.parametrize("size", [Fraction(1, 10**700), Fraction(1, 10**20), Fraction(10**20), Fraction(10**700)])
@pytest.mark.parametrize("power", [2, 3])
def test_roots_beyond_the_range_of_floats_are_bounds_still(size, power):
    terms = {(): size, ("x",) * power: Fraction(-1)}
    low, high = implied_box([(terms, True)], {"x": (None, None)})["x"]
    assert high**power >= size
    assert low**power <= (size if power == 3 else high**power)


# ---------------------------------------------------------------- minima


MINIMA = {
    "half disc": (x * y + y**2, [x**2 + y**2 <= 1, x >= 0], 0.5 - np.sqrt(0.5)),
    "graph": (x + y, [y == x**2 - x, x >= -3, x <= 3], 0.0),
    "concave": (-(x**2) - 2 * y**2, [x >= 0, y >= 0, 2 * x + y <= 4, x + 2 * y <= 4], -8.0),
    "quartic": (x**4 - 3 * x**2 + x, [x >= -2, x <= 2], None),
}


@pytest.mark.parametrize("name", MINIMA)
def test_a_minimum_lies_between_its_certificate_and_its_witness(name):
    objective, constraints, value = MINIMA[name]
    if value is None:
        grid = np.linspace(-2, 2, 400001)
        value = float(np.min(grid**4 - 3 * grid**2 + grid))
    found = minimise(objective, constraints)
    assert found.lower <= value + 1e-9
    assert found.lower == pytest.approx(value, abs=1e-6)
    assert found.upper == pytest.approx(value, abs=1e-6)
    assert found.lower <= found.upper
    assert "reached at" in str(found)


def test_a_minimum_without_a_witness_says_so():
    # A third is no float, and the disc around it has no room for one.
    found = minimise(x + y, [(x - Fraction(1, 3)) ** 2 + y**2 <= 0, x >= -1, x <= 1, y >= -1, y <= 1])
    assert found.lower == pytest.approx(1 / 3, abs=1e-4)
    assert np.isnan(found.upper)
    assert found.point == {}
    assert "no feasible point was verified" in str(found)


def test_an_empty_set_is_proven():
    found = minimise(x, [x**2 + y**2 <= 1, x + y >= 2])
    assert found.lower == np.inf
    assert str(found) == "no point satisfies all constraints (proven)"


def test_a_constraint_prints_what_it_says():
    assert str(x**2 <= 1) == "-x**2 + 1 >= 0"
    assert str(Constraint(x - y, equality=True)) == "x - y == 0"


SQUARE = [x >= -1, x <= 1, y >= -1, y <= 1]
HOSTILE = {
    "duplicated constraints": (x * y, [*SQUARE, *[x + y >= 0.5] * 5], -0.5),
    "equalities that depend on each other": (
        x * y,
        [*SQUARE, x + y == 1, 2 * x + 2 * y == 2, (x + y - 1) ** 2 == 0],
        0.0,
    ),
    "coefficients from 1e-12 to 1e12": (
        1e12 * x + 1e-12 * y,
        [x >= -1e-12, x <= 1e-12, y >= -1e12, y <= 1e12, 1e12 * x + 1e-12 * y >= -1],
        -1.0,
    ),
    "a box of a few floats": (x * x - x, [x >= 0.3, x <= 0.3 + 1e-13], -0.21),
    "a constant": (constant(3), [x >= 0, x <= 1], 3.0),
    "a fixed variable": (x**2 * y, [x == 2, y >= -1, y <= 1], -4.0),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_what_breaks_solvers_is_bounded_all_the_same(name):
    objective, constraints, value = HOSTILE[name]
    found = minimise(objective, constraints)
    assert found.lower == pytest.approx(value, abs=1e-6)
    assert found.lower <= value + 1e-12


def test_equalities_without_a_solution_are_proven_to_have_none():
    assert minimise(x, [x**2 == -1, x >= -2, x <= 2]).lower == np.inf
