"""Families of sparse polynomials against sums over dictionaries of fractions, and against sympy."""

from collections import defaultdict
from fractions import Fraction
from math import prod

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from relaxations.algebra.ball_arithmetic import Balls
from relaxations.algebra.polynomial import Polynomials, multiply, pad, trim, unique

N = 4
monomial = st.lists(st.integers(0, N - 1), max_size=4).map(lambda v: tuple(sorted(v)))
number = st.floats(-1e6, 1e6, allow_nan=False).map(lambda v: float(np.float32(v)))
member = st.dictionaries(monomial, number, max_size=5)
family = st.lists(member, min_size=1, max_size=4)
checked = settings(max_examples=100, deadline=None, derandomize=True)


def exact(polynomials, use=lambda mid, _: Fraction(mid)):
    """Return [{monomial: coefficient}] of a family, equal monomials added up exactly."""
    rows = [defaultdict(Fraction) for _ in range(polynomials.n_rows)]
    c = polynomials.coefficients
    for row, mid, rad, factor in zip(
        polynomials.rows.tolist(), c.mid.tolist(), c.rad.tolist(), polynomials.factors.tolist(), strict=True
    ):
        rows[row][tuple(v for v in factor if v >= 0)] += use(mid, rad)
    return rows


def encloses(polynomials, wanted):
    """Tell whether every wanted coefficient lies in its ball (a missing monomial is an exact zero)."""
    mids, rads = exact(polynomials), exact(polynomials, lambda _, rad: Fraction(rad))
    return all(
        abs(mids[k][key] - want[key]) <= rads[k][key]
        for k, want in enumerate(wanted)
        for key in set(mids[k]) | set(want)
    )


def fractions(members):
    return [defaultdict(Fraction, {k: Fraction(v) for k, v in m.items()}) for m in members]


def uncollected(members, repeats=2):
    """Return a family in which every term stands ``repeats`` times."""
    p = Polynomials.from_terms(members)
    order = np.tile(np.arange(len(p.rows)), repeats)
    return Polynomials(p.n_rows, p.rows[order], p.factors[order], p.coefficients[order])


@checked
@given(family)
def test_from_terms_keeps_every_coefficient(members):
    p = Polynomials.from_terms(members)
    assert encloses(p, fractions(members))
    assert (p.coefficients.rad == 0).all()
    degrees = [max((len(k) for k, v in m.items() if v), default=0) for m in members]
    assert p.row_degrees().tolist() == degrees
    assert p.degree == max(degrees)


@checked
@given(family, st.integers(1, 3))
def test_collect_adds_equal_monomials(members, repeats):
    p = uncollected(members, repeats).collect()
    keys = [(r, tuple(f)) for r, f in zip(p.rows.tolist(), p.factors.tolist(), strict=True)]
    assert len(keys) == len(set(keys))
    assert encloses(p, [{k: repeats * v for k, v in m.items()} for m in fractions(members)])


def test_collect_drops_what_cancels_exactly_and_keeps_what_may_not():
    p = Polynomials(
        1,
        np.zeros(4, dtype=np.int64),
        np.array([[0], [0], [1], [1]]),
        Balls(np.array([1.0, -1.0, 0.5, 0.5]), np.array([0.0, 0.25, 0.0, 0.0])),
    ).collect()
    assert p.factors.tolist() == [[0], [1]]
    assert p.coefficients.rad[0] >= 0.25


@checked
@given(family, st.lists(monomial, min_size=1, max_size=4))
def test_times_monomials_multiplies_each_by_each(members, monomials):
    width = max(1, *(len(m) for m in monomials))
    factors = np.array([[-1] * (width - len(m)) + list(m) for m in monomials], dtype=np.int64)
    p = Polynomials.from_terms(members).times_monomials(factors)
    wanted = []
    for m in fractions(members):
        for extra in monomials:
            wanted.append(defaultdict(Fraction, {tuple(sorted(k + extra)): v for k, v in m.items()}))
    assert p.n_rows == len(wanted)
    assert encloses(p, wanted)
    assert (p.coefficients.rad == 0).all()


@checked
@given(family, st.lists(number, min_size=N, max_size=N), st.lists(number, min_size=N, max_size=N))
def test_substitution_encloses_the_exact_coefficients(members, centre, scale):
    p = Polynomials.from_terms(members).substitute_affine(np.array(centre), np.array(scale))
    wanted = []
    for m in fractions(members):
        total = defaultdict(Fraction)
        for key, value in m.items():
            partial = {(): value}
            for v in key:
                step = defaultdict(Fraction)
                for k, c in partial.items():
                    step[k] += c * Fraction(centre[v])
                    step[tuple(sorted((*k, v)))] += c * Fraction(scale[v])
                partial = step
            for k, c in partial.items():
                total[k] += c
        wanted.append(total)
    assert encloses(p, wanted)


def test_substitution_agrees_with_sympy_and_is_narrow():
    x = sympy.symbols("x0:3")
    expression = 3 * x[0] ** 2 * x[1] - sympy.Rational(5, 4) * x[2] * x[1] + x[0] - 7
    p = Polynomials.from_terms([{(0, 0, 1): 3.0, (1, 2): -1.25, (0,): 1.0, (): -7.0}])
    centre, scale = np.array([0.1, -2.3, 0.7]), np.array([1.7, 0.3, 2.9])
    moved = sympy.Poly(
        expression.subs(
            {v: sympy.Rational(c) + sympy.Rational(s) * v for v, c, s in zip(x, centre, scale, strict=True)},
            simultaneous=True,
        ),
        *x,
    )
    wanted = defaultdict(Fraction)
    for exponents, value in moved.terms():
        wanted[tuple(k for k, e in enumerate(exponents) for _ in range(e))] = Fraction(int(value.p), int(value.q))
    result = p.substitute_affine(centre, scale)
    assert encloses(result, [wanted])
    assert result.coefficients.rad.max() < 1e-12


@checked
@given(family, st.lists(st.floats(-3, 3), min_size=N, max_size=N))
def test_values_and_derivatives_are_those_of_the_polynomial(members, point):
    p, x = Polynomials.from_terms(members), np.array(point)
    exact_point = [Fraction(v) for v in point]
    rows, columns, values = p.jacobian(x)
    dense = np.zeros((p.n_rows, N))
    np.add.at(dense, (rows, columns), values)
    np.testing.assert_allclose(p.slopes(x).toarray(), dense, rtol=1e-12, atol=1e-12)
    got = p.evaluate(x)
    for k, m in enumerate(fractions(members)):
        size = sum(abs(float(c)) * 3.0 ** len(key) for key, c in m.items()) + 1e-300
        value = sum((c * prod((exact_point[v] for v in key), start=Fraction(1)) for key, c in m.items()), Fraction(0))
        assert abs(float(value) - got[k]) <= 1e-13 * size
        for v in range(N):
            slope = Fraction(0)
            for key, c in m.items():
                count = key.count(v)
                others = prod((exact_point[w] for w in key if w != v), start=Fraction(1))
                slope += c * count * exact_point[v] ** max(count - 1, 0) * others
            assert abs(float(slope) - dense[k, v]) <= 1e-12 * size


@pytest.mark.parametrize("columns", [1, 3, 9, 40])
@pytest.mark.parametrize("variables", [1, 2, 500, 10**6])
def test_unique_tells_monomials_apart_over_many_words(columns, variables):
    rng = np.random.default_rng(columns)
    pool = np.sort(rng.integers(-1, variables, (30, columns)), axis=1)
    pool[:, -1] = np.maximum(pool[:, -1], -1)
    rows = np.concatenate([np.full((1, columns), -1), pool[rng.integers(0, 30, 200)]])
    found, place = unique(rows)
    assert (found[place] == rows).all()
    assert len({tuple(r) for r in rows.tolist()}) == len(found)
    assert (found[0] == -1).all()


def test_unique_without_columns_knows_one_monomial():
    found, place = unique(np.empty((3, 0), dtype=np.int64))
    assert found.shape == (1, 0)
    assert place.tolist() == [0, 0, 0]


@checked
@given(family, family, st.randoms(use_true_random=False))
def test_take_and_join_move_members_whole(left, right, random):
    joined = Polynomials.join([Polynomials.from_terms(left), Polynomials.from_terms(right)])
    assert encloses(joined, fractions(left + right))
    chosen = random.sample(range(joined.n_rows), random.randint(0, joined.n_rows))
    taken = joined.take(np.array(chosen, dtype=np.int64))
    assert taken.n_rows == len(chosen)
    assert encloses(taken, [fractions(left + right)[k] for k in chosen])


def test_joining_nothing_gives_an_empty_family():
    assert Polynomials.join([]).n_rows == 0
    assert Polynomials.empty().degree == 0
    assert Polynomials.empty().evaluate(np.zeros(2)).tolist() == []


def test_variables_builds_the_affine_family():
    p = Polynomials.variables(np.array([2, 0]), np.array([-1.0, 3.0]), 0.5)
    assert p.evaluate(np.array([10.0, 20.0, 30.0])).tolist() == [-29.5, 30.5]
    assert p.occurring().tolist() == [0, 2]


def test_scale_rows_scales_each_member_by_its_own_power():
    p = Polynomials.from_terms([{(0,): 3.0}, {(): 5.0}]).scale_rows(np.array([2.0, 0.25]))
    assert p.evaluate(np.array([1.0])).tolist() == [6.0, 1.25]
    assert (p.coefficients.rad == 0).all()


def test_pad_trim_and_multiply_keep_the_monomial():
    x = np.array([[-1, 3], [2, 3]])
    assert pad(x, 4).tolist() == [[-1, -1, -1, 3], [-1, -1, 2, 3]]
    assert trim(pad(x, 4)).tolist() == x.tolist()
    assert multiply(x, np.array([[1]])).tolist() == [[-1, 1, 3], [1, 2, 3]]
