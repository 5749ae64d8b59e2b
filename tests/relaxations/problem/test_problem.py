"""Problems from sympy, their errors, and the scaling of their box."""

from fractions import Fraction

import numpy as np
import pytest
import sympy
from hypothesis import example, given, settings
from hypothesis import strategies as st

from relaxations.algebra.polynomial import Polynomials
from relaxations.errors import ProblemError
from relaxations.problem.problem import PolynomialProblem, from_sympy, polynomials_from_sympy
from relaxations.reductions.scaling import Scaling

x, y, z = sympy.symbols("x y z")


def boxed(lower, upper):
    n = len(lower)
    names = tuple(f"x{k}" for k in range(n))
    return PolynomialProblem(names, np.array(lower), np.array(upper), Polynomials.empty(), Polynomials.empty())


def test_a_fraction_that_no_float_holds_carries_a_radius():
    p = polynomials_from_sympy([x / 3 + x**2 / 2], [x])
    by_degree = dict(
        zip(p.term_degrees.tolist(), zip(p.coefficients.mid, p.coefficients.rad, strict=True), strict=True)
    )
    mid, rad = by_degree[1]
    assert rad > 0
    assert abs(Fraction(mid) - Fraction(1, 3)) <= Fraction(rad)
    assert by_degree[2] == (0.5, 0.0)


def test_a_decimal_stands_for_its_binary_fraction():
    p = polynomials_from_sympy([sympy.Float(0.1) * x], [x])
    assert p.coefficients.mid.tolist() == [0.1]
    assert p.coefficients.rad.tolist() == [0.0]


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.lists(st.tuples(st.integers(0, 3), st.integers(0, 2), st.fractions()), min_size=1, max_size=6))
def test_coefficients_from_sympy_are_enclosed(terms):
    expression = sum(sympy.Rational(c.numerator, c.denominator) * x**i * y**j for i, j, c in terms)
    p = polynomials_from_sympy([expression, sympy.S(0)], [x, y])
    wanted = {}
    for i, j, c in terms:
        key = (0,) * i + (1,) * j
        wanted[key] = wanted.get(key, Fraction(0)) + c
    got = {
        tuple(v for v in f if v >= 0): (Fraction(m), Fraction(r))
        for f, m, r in zip(p.factors.tolist(), p.coefficients.mid, p.coefficients.rad, strict=True)
    }
    assert p.n_rows == 2
    assert set(got) == {k for k, v in wanted.items() if v}
    assert all(abs(m - wanted[k]) <= r for k, (m, r) in got.items())


@pytest.mark.parametrize("expression", [sympy.exp(x), sympy.sqrt(x), 1 / x, sympy.Abs(x)])
def test_what_is_no_polynomial_is_refused_by_name(expression):
    with pytest.raises(ProblemError, match="is not a polynomial in"):
        from_sympy(None, [], [expression], [x], {x: (1, 2)})


def test_an_unlisted_symbol_is_refused_by_name():
    with pytest.raises(ProblemError, match=r"contains \{q\}: list them as variables"):
        from_sympy(None, [sympy.Symbol("q") * x], [], [x], {x: (0, 1)})


def test_an_irrational_coefficient_is_refused_with_its_cure():
    with pytest.raises(ProblemError, match=r"sqrt\(2\) is not a finite rational number: give a decimal or a fraction"):
        from_sympy(sympy.sqrt(2) * x, [], [], [x], {x: (0, 1)})


@pytest.mark.parametrize("value", [sympy.nan, sympy.oo, sympy.Integer(10) ** 400])
def test_a_coefficient_that_no_float_holds_is_refused(value):
    with pytest.raises(ProblemError):
        polynomials_from_sympy([value * x], [x])


def test_a_bound_of_a_symbol_that_is_no_variable_is_refused():
    with pytest.raises(ProblemError, match="z"):
        from_sympy(x, [], [], [x], {x: (0, 1), z: (0, 1)})


def test_a_bound_that_no_float_holds_is_rounded_outwards():
    problem, _ = from_sympy(x, [], [], [x, y], {x: (0, sympy.Rational(1, 3)), y: (sympy.Rational(1, 10), 1)})
    assert Fraction(problem.upper[0]) >= Fraction(1, 3)
    assert Fraction(problem.lower[1]) <= Fraction(1, 10)


@pytest.mark.parametrize("box", [(1, 0), (float("nan"), 1), (0, float("nan"))])
def test_a_wrong_box_is_refused_by_name(box):
    with pytest.raises(ProblemError, match="the box of y is"):
        from_sympy(x, [], [], [x, y], {x: (0, 1), y: box})


def test_lengths_that_disagree_are_refused():
    with pytest.raises(ProblemError, match="1 names, 2 lower and 1 upper bounds"):
        PolynomialProblem(("x",), np.zeros(2), np.ones(1), Polynomials.empty(), Polynomials.empty())


def test_missing_bounds_are_infinite_and_named():
    problem, objective = from_sympy(None, [x * y], [z - 1], [x, y, z], {x: (0, 1), y: (None, 3)})
    assert problem.unbounded == ("y", "z")
    assert problem.degree == 2
    assert objective.n_rows == 1
    assert objective.evaluate(np.ones(3)).tolist() == [0.0]


def test_an_infinite_box_cannot_be_scaled_and_says_why():
    problem, _ = from_sympy(None, [], [], [x, y], {x: (0, 1)})
    with pytest.raises(ProblemError, match=r"y has no finite box.*derive_box"):
        Scaling.of_box(problem)


end = st.floats(-1e150, 1e150, allow_nan=False)


@settings(max_examples=300, deadline=None, derandomize=True)
@given(end, end)
@example(0.0, 5e-324)
@example(1.0, 1.0 + 2.0**-52)
@example(-1e-310, 1e-300)
@example(0.1, 0.1)
@example(-1e150, 1e-5)
def test_the_image_of_the_unit_interval_covers_the_box(one, other):
    low, high = min(one, other), max(one, other)
    scaling = Scaling.of_box(boxed([low], [high]))
    centre, scale = Fraction(scaling.centre[0]), Fraction(scaling.scale[0])
    assert centre - scale <= Fraction(low)
    assert centre + scale >= Fraction(high)
    if low == high:
        assert scale == 0
    assert scale <= (Fraction(high) - Fraction(low)) / 2 + Fraction(1e-14) * max(
        abs(Fraction(low)), abs(Fraction(high))
    ) + Fraction(1e-322)


def test_the_scaled_problem_is_the_same_problem():
    problem, objective = from_sympy(
        x * y + 7 * x,
        [3 - x**2 * y],
        [1000 * x * y - sympy.Rational(1, 7)],
        [x, y],
        {x: (-2, 5), y: (0.1, 0.3)},
    )
    scaling = Scaling.of_box(problem)
    scaled = scaling.apply(problem)
    rng = np.random.default_rng(3)
    for t in rng.uniform(-1, 1, (20, 2)):
        point = scaling.recover(t)
        assert scaling.polynomials(objective).evaluate(t) == pytest.approx(objective.evaluate(point), rel=1e-12)
        for one, two in (
            (scaled.equalities, problem.equalities),
            (scaled.inequalities, problem.inequalities),
        ):
            ratio = np.max(np.abs(one.coefficients.mid))
            assert 0.5 <= ratio <= 1.0
            power = np.log2(two.evaluate(point) / one.evaluate(t))
            assert power == pytest.approx(np.round(power), abs=1e-9)
    assert scaled.lower.tolist() == [-1, -1]
    assert scaled.upper.tolist() == [1, 1]


def test_a_row_of_tiny_coefficients_can_be_scaled():
    problem, _ = from_sympy(None, [sympy.Float(1e-320) * x], [], [x], {x: (-1, 1)})
    scaled = Scaling.of_box(problem).apply(problem)
    assert np.isfinite(scaled.inequalities.coefficients.mid).all()
