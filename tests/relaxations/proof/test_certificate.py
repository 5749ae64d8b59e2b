"""A published bound is a theorem: exact arithmetic agrees, any multipliers give one, a weak one is caught."""

from fractions import Fraction

import flint
import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from relaxations.algebra.ball_arithmetic import Balls
from relaxations.algebra.polynomial import Polynomials
from relaxations.moments.conic import Multipliers, conic_program, multipliers
from relaxations.moments.lasserre_hierarchy import lasserre
from relaxations.moments.parametric_lift import lift
from relaxations.points.witness import verify
from relaxations.problem.problem import PolynomialProblem, from_sympy
from relaxations.proof.bounding import relax
from relaxations.proof.certificate import certify, residual_polynomial
from relaxations.search.enclosure import Reason
from relaxations.search.hierarchy import intervals
from relaxations.solvers import solve

METHODS = ["lift", "sparse", "dense", "terms", "chordal", "textbook"]


def rational(value):
    """Return a float as an exact rational of FLINT."""
    numerator, denominator = float(value).as_integer_ratio()
    return flint.fmpq(numerator, denominator)


def dyadic_problem():
    """Return z = x y, w = z - x/2 + 1/4, 3/4 - x - y >= 0 on [-1, 1]^4: floats hold every coefficient."""
    names = ("x", "y", "z", "w")
    return PolynomialProblem(
        names,
        -np.ones(4),
        np.ones(4),
        Polynomials.from_terms([{(0, 1): 1.0, (2,): -1.0}, {(2,): 1.0, (0,): -0.5, (): 0.25, (3,): -1.0}]),
        Polynomials.from_terms([{(): 0.75, (0,): -1.0, (1,): -1.0}]),
    )


def dyadic_points(count, seed):
    """Return feasible points of the problem above as fractions, without any rounding."""
    rng = np.random.default_rng(seed)
    points = []
    while len(points) < count:
        x, y = (Fraction(int(v), 64) for v in rng.integers(-64, 65, 2))
        z = x * y
        w = z - x / 2 + Fraction(1, 4)
        if Fraction(3, 4) - x - y >= 0 and abs(w) <= 1:
            points.append((x, y, z, w))
    return points


def build(problem, method):
    return lift(problem, 2) if method == "lift" else lasserre(problem, 2, method)


def solved(relaxation, objective):
    program = conic_program(relaxation)
    cost = np.zeros(relaxation.n_moments)
    np.add.at(cost, relaxation.moments_of(objective.factors), objective.coefficients.mid)
    solution = solve(program, cost)
    return float(cost @ solution.moments), multipliers(relaxation, program, solution.dual)


def exact_residual(relaxation, objective, dual):
    """Return the coefficients of r as exact rationals, from the floats lambda and F alone."""
    r = [flint.fmpq(0)] * relaxation.n_moments
    for k, c in zip(relaxation.moments_of(objective.factors), objective.coefficients.mid, strict=True):
        r[k] += rational(c)
    for row, k, c in zip(
        relaxation.equality_row, relaxation.equality_moment, relaxation.equality_coefficient.mid, strict=True
    ):
        r[k] -= rational(dual.equalities[row]) * rational(c)
    for blocks, factors in zip(relaxation.blocks, dual.factors, strict=True):
        f = [[[rational(v) for v in row] for row in matrix] for matrix in factors]
        for b, i, j, k, c in zip(blocks.block, blocks.i, blocks.j, blocks.moment, blocks.coefficient.mid, strict=True):
            weight = sum((u * v for u, v in zip(f[b][i], f[b][j], strict=True)), flint.fmpq(0))
            r[k] -= rational(c) * weight * (1 if i == j else 2)
    return r


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("target", [{(0,): 1.0}, {(3,): -1.0}, {(2,): 1.0, (1,): -3.0, (): 0.5}])
def test_the_published_bound_lies_just_below_the_exact_one(method, target):
    problem, objective = dyadic_problem(), Polynomials.from_terms([target])
    relaxation = build(problem, method)
    _, dual = solved(relaxation, objective)
    certificate = certify(relaxation, objective, dual)
    r = exact_residual(relaxation, objective, dual)
    exact = r[0] - sum((abs(v) for v in r[1:]), flint.fmpq(0))
    assert rational(certificate.bound) <= exact
    assert exact - rational(certificate.bound) < flint.fmpq(1, 10**11)
    balls = residual_polynomial(relaxation, objective, dual)
    for mid, rad, value in zip(balls.mid, balls.rad, r, strict=True):
        assert abs(rational(mid) - value) <= rational(rad)
    # And the exact one is a bound: at feasible points, in fractions.
    for point in dyadic_points(30, 1):
        value = sum(
            (Fraction(c) * np.prod([point[v] for v in key], initial=Fraction(1)) for key, c in target.items()),
            Fraction(0),
        )
        assert Fraction(certificate.bound) <= value


@pytest.mark.parametrize("method", ["lift", "sparse"])
def test_coefficients_with_a_radius_agree_with_ball_arithmetic_of_flint(output_error, method):
    model = output_error(5, seed=2)
    relaxed = relax(model.problem, method, 1 if method == "lift" else 2)
    relaxation = relaxed.relaxation
    objective = relaxed.scaling.polynomials(model.problem.variable(0))
    certified = relaxed.bound(model.problem.variable(0))
    dual = certified.certificate.multipliers
    old, flint.ctx.prec = flint.ctx.prec, 300
    try:
        r = [flint.arb(0)] * relaxation.n_moments
        c = objective.coefficients
        for k, mid, rad in zip(relaxation.moments_of(objective.factors), c.mid, c.rad, strict=True):
            r[k] += flint.arb(float(mid), float(rad))
        c = relaxation.equality_coefficient
        for row, k, mid, rad in zip(relaxation.equality_row, relaxation.equality_moment, c.mid, c.rad, strict=True):
            r[k] -= flint.arb(float(dual.equalities[row])) * flint.arb(float(mid), float(rad))
        for blocks, factors in zip(relaxation.blocks, dual.factors, strict=True):
            c = blocks.coefficient
            f = [flint.arb_mat(m.shape[0], m.shape[1], [float(v) for v in m.ravel()]) for m in factors]
            products = [m * m.transpose() for m in f]
            for b, i, j, k, mid, rad in zip(blocks.block, blocks.i, blocks.j, blocks.moment, c.mid, c.rad, strict=True):
                weight = products[b][int(i), int(j)] * (1 if i == j else 2)
                r[k] -= flint.arb(float(mid), float(rad)) * weight
        exact = r[0] - sum((abs(v) for v in r[1:]), flint.arb(0))
        # Every point inside the balls gives a bound; the published one must lie below the least of them.
        assert flint.arb(certified.bound) <= exact.lower()
        assert exact.lower() - flint.arb(certified.bound) < 1e-9
    finally:
        flint.ctx.prec = old


def random_multipliers(relaxation, rng, size):
    factors = tuple(
        size * rng.normal(size=(b.count, b.size, int(rng.integers(1, b.size + 1)))) for b in relaxation.blocks
    )
    return Multipliers(size * rng.normal(size=relaxation.n_equalities), factors)


@pytest.mark.parametrize("method", METHODS)
@settings(max_examples=40, deadline=None, derandomize=True)
@given(st.integers(0, 2**32), st.floats(-12, 6), st.sampled_from([(0, 1.0), (1, -1.0), (2, 1.0), (3, -1.0)]))
def test_any_multipliers_give_a_true_bound(method, seed, exponent, target):
    relaxation = RELAXATIONS[method]
    variable, sign = target
    objective = Polynomials.variables(np.array([variable]), sign)
    dual = random_multipliers(relaxation, np.random.default_rng(seed), 10.0**exponent)
    bound = certify(relaxation, objective, dual).bound
    assert Fraction(bound) <= min(Fraction(sign) * p[variable] for p in POINTS)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("noise", [1e-12, 1e-6, 1e-2, 1.0])
def test_disturbed_multipliers_of_a_solver_give_a_true_bound(method, noise):
    relaxation = RELAXATIONS[method]
    objective = Polynomials.variables(np.array([3]), 1.0)
    _, dual = solved(relaxation, objective)
    rng = np.random.default_rng(11)
    least = min(p[3] for p in POINTS)
    for _ in range(10):
        disturbed = Multipliers(
            dual.equalities + noise * rng.normal(size=dual.equalities.shape),
            tuple(f + noise * rng.normal(size=f.shape) for f in dual.factors),
        )
        assert Fraction(certify(relaxation, objective, disturbed).bound) <= least


RELAXATIONS = {method: build(dyadic_problem(), method) for method in METHODS}
POINTS = dyadic_points(200, 2)


@pytest.mark.parametrize("method", ["lift", "dense"])
def test_what_a_coefficient_may_be_wrong_by_is_paid_for(method):
    # c x = y with c in [0.99, 1.01]: y - x may be -0.01, though it is zero at the midpoint.
    equality = Polynomials(
        1,
        np.zeros(2, dtype=np.int64),
        np.array([[0], [1]]),
        Balls(np.array([1.0, -1.0]), np.array([0.01, 0.0])),
    )
    problem = PolynomialProblem(("x", "y"), -np.ones(2), np.ones(2), equality, Polynomials.empty())
    relaxation = lift(problem, 1) if method == "lift" else lasserre(problem, 1, method)
    objective = Polynomials.from_terms([{(0,): -1.0, (1,): 1.0}])
    value, dual = solved(relaxation, objective)
    assert value == pytest.approx(0, abs=1e-7)
    assert certify(relaxation, objective, dual).bound <= -0.01


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_multipliers_that_are_not_finite_prove_nothing(bad):
    relaxation = RELAXATIONS["lift"]
    objective = Polynomials.variables(np.array([0]), 1.0)
    dual = random_multipliers(relaxation, np.random.default_rng(3), 1.0)
    dual.factors[0].flat[0] = bad
    assert certify(relaxation, objective, dual).bound == -np.inf


def test_multipliers_that_overflow_prove_nothing_false():
    relaxation = RELAXATIONS["lift"]
    objective = Polynomials.variables(np.array([0]), 1.0)
    dual = random_multipliers(relaxation, np.random.default_rng(3), 1e200)
    with np.errstate(over="ignore", invalid="ignore"):
        assert certify(relaxation, objective, dual).bound <= -1.0


# ---------------------------------------------------------------- emptiness


def small(constraint_sets):
    x, y = sympy.symbols("x y")
    equalities, inequalities = constraint_sets(x, y)
    problem, _ = from_sympy(None, inequalities, equalities, [x, y], {x: (-2, 2), y: (-1, 3)})
    return problem


EMPTY = {
    "disc and line": lambda x, y: ([x + y - 2], [sympy.Rational(3, 2) - x**2 - y**2]),
    "product": lambda x, y: ([x * y - 1, x + y / 3 - 1], [sympy.Rational(-1, 10) - x]),
    "two values": lambda x, _: ([x - sympy.Rational(1, 2), x - sympy.Rational(1, 4)], []),
    "a constant": lambda *_: ([sympy.S(1)], []),
    "a box too small": lambda x, y: ([x + y - 6], []),
}
NOT_EMPTY = {
    "disc and line": lambda x, y: ([x + y - 2], [3 - x**2 - y**2]),
    "disc touches line": lambda x, y: ([x + y - 2], [2 - x**2 - y**2]),
    "product": lambda x, y: ([x * y - 1], [x]),
    "corner of the box": lambda x, y: ([x + y - 5], []),
}


@pytest.mark.parametrize("name", EMPTY)
@pytest.mark.parametrize("method", METHODS)
def test_an_empty_set_is_proven_empty(name, method):
    found = intervals(small(EMPTY[name]), [0, 1], method=method, order=2)
    assert found.reason is Reason.EMPTY
    assert found.empty is not None


@pytest.mark.parametrize("name", NOT_EMPTY)
@pytest.mark.parametrize("method", METHODS)
def test_a_set_with_a_point_never_has_a_positive_bound_of_zero(name, method):
    problem = small(NOT_EMPTY[name])
    relaxed = relax(problem, method, 2)
    zero = Polynomials.from_terms([{}])
    assert relaxed.bound(zero).bound <= 0
    rng = np.random.default_rng(4)
    for size in (1e-3, 1.0, 1e3):
        for _ in range(5):
            assert certify(relaxed.relaxation, zero, random_multipliers(relaxed.relaxation, rng, size)).bound <= 0
    assert intervals(problem, [0], method=method, order=2, witnesses=False, rounds=2).empty is None


# ---------------------------------------------------------------- where a solver breaks down


def test_the_certificate_is_true_where_the_solver_may_break_down(hammerstein):
    """The textbook's order 2 is badly conditioned here: on many machines the solver's own value is no bound."""
    model = hammerstein(20, seed=0)
    objective = model.problem.variable(0)
    nearest = min(intervals(model.problem, [0], method="lift", order=2).witnesses, key=lambda p: p[0])
    witness = verify(model.problem, objective, nearest)
    assert witness is not None
    assert relax(model.problem, "textbook", 2).bound(objective).bound <= witness.value


# ---------------------------------------------------------------- a weak certificate is caught


def weakened(relaxation, objective, dual):
    """Return what a certificate would state that drops the sum of |r_i|."""
    return float(residual_polynomial(relaxation, objective, dual).mid[0])


@pytest.mark.parametrize("method", METHODS)
def test_a_certificate_weakened_on_purpose_is_caught(method):
    """The points and multipliers of the tests above tell a false bound: they are no check that cannot fail."""
    objective = Polynomials.variables(np.array([2]), 1.0)
    least = min(float(p[2]) for p in POINTS)
    rng = np.random.default_rng(5)
    # Without blocks, which only lower the constant term.
    blocks = random_multipliers(RELAXATIONS[method], rng, 0.0).factors
    duals = [Multipliers(10 * rng.normal(size=RELAXATIONS[method].n_equalities), blocks) for _ in range(40)]
    assert max(certify(RELAXATIONS[method], objective, dual).bound for dual in duals) <= least
    assert max(weakened(RELAXATIONS[method], objective, dual) for dual in duals) > least + 0.1
