"""Every operation on balls encloses the exact rational result."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from relaxations.algebra.ball_arithmetic import Balls, concatenate, gram

ordinary = st.floats(-1e100, 1e100, allow_nan=False, allow_infinity=False)
tiny = st.floats(-1e-150, 1e-150, allow_nan=False)
radius = st.one_of(st.just(0.0), st.floats(0, 1e100), st.floats(0, 1e-150))
share = st.sampled_from([Fraction(-1), Fraction(0), Fraction(1), Fraction(1, 3)])
ball = st.tuples(st.one_of(ordinary, tiny), radius, share)


def balls(parts):
    """Return the balls of (midpoint, radius, share) triples and an exact member of each."""
    mid, rad, _ = zip(*parts, strict=True)
    return Balls(np.array(mid), np.array(rad)), [Fraction(m) + s * Fraction(r) for m, r, s in parts]


def holds(result, exact):
    """Tell whether every exact value lies in its ball, compared as fractions."""
    mid, rad = np.ravel(result.mid), np.ravel(result.rad)
    return all(abs(Fraction(m) - x) <= Fraction(r) for m, r, x in zip(mid, rad, exact, strict=True))


@settings(max_examples=300, deadline=None, derandomize=True)
@given(ball, ball)
def test_sum_difference_and_product_hold_the_exact_result(left, right):
    a, (x,) = balls([left])
    b, (y,) = balls([right])
    assert holds(a + b, [x + y])
    assert holds(a - b, [x - y])
    assert holds(-a, [-x])
    assert holds(a * b, [x * y])


@example((0.0, 1e-200, Fraction(1)), (1e-200, 0.0, Fraction(0)))
@example((0.0, 1e-200, Fraction(1)), (0.0, 1e-200, Fraction(1)))
@settings(max_examples=200, deadline=None, derandomize=True)
@given(
    st.tuples(st.one_of(st.just(0.0), tiny), st.floats(0, 1e-150), share),
    st.tuples(st.one_of(st.just(0.0), tiny, st.just(0.5)), st.floats(0, 1e-150), share),
)
def test_a_product_whose_radius_underflows_still_holds_the_exact_result(left, right):
    a, (x,) = balls([left])
    b, (y,) = balls([right])
    assert holds(a * b, [x * y])


@settings(max_examples=300, deadline=None, derandomize=True)
@given(ball, st.floats(1e-3, 1e3), st.floats(0, 0.9), share, st.booleans())
def test_quotient_holds_the_exact_result(left, divisor, spread, part, negative):
    a, (x,) = balls([left])
    b, (y,) = balls([(-divisor if negative else divisor, divisor * spread, part)])
    assert holds(a / b, [x / y])


@example(1e-310, 1e-300, 1e-14)
@settings(max_examples=200, deadline=None, derandomize=True)
@given(st.floats(1e-320, 1e-290), st.floats(1e-305, 1e-290), st.floats(0, 0.5))
def test_a_quotient_of_tiny_numbers_holds_the_exact_result(dividend, divisor, spread):
    b, (y,) = balls([(divisor, divisor * spread, Fraction(-1))])
    assert holds(Balls.exact([dividend]) / b, [Fraction(dividend) / y])


def test_a_divisor_that_may_be_zero_is_refused():
    with pytest.raises(ZeroDivisionError, match="contains zero"):
        Balls.exact([1.0]) / Balls(np.array([1.0]), np.array([1.0]))


@settings(max_examples=100, deadline=None, derandomize=True)
@given(st.floats(-1e20, 1e20), st.floats(0, 1e10), share, st.integers(0, 9))
def test_powers_hold_the_exact_result(mid, rad, part, exponent):
    a, (x,) = balls([(mid, rad, part)])
    assert holds(a**exponent, [x**exponent])


@settings(max_examples=150, deadline=None, derandomize=True)
@given(ball, st.integers(-100, 100))
def test_scaling_by_a_power_of_two_holds_the_exact_result(value, exponent):
    a, (x,) = balls([value])
    result = a.scaled(np.array([2.0**exponent]))
    if a.mid[0] == 0 or abs(a.mid[0]) * 2.0**exponent >= 2.0**-1022:  # the docstring excludes underflow
        assert holds(result, [x * Fraction(2) ** exponent])
        if a.rad[0] == 0:
            assert result.rad[0] == 0


def test_scaling_into_the_underflow_range_holds_the_exact_result():
    value, power = 1e-300, 2.0**-60
    assert holds(Balls.exact([value]).scaled(np.array([power])), [Fraction(value) * Fraction(power)])


@settings(max_examples=150, deadline=None, derandomize=True)
@given(st.lists(st.tuples(ball, st.integers(0, 3)), min_size=1, max_size=40))
def test_segment_sums_hold_the_exact_result(terms):
    values, exact = balls([t for t, _ in terms])
    segment = np.array([s for _, s in terms])
    sums = [sum((x for x, s in zip(exact, segment, strict=True) if s == k), Fraction(0)) for k in range(4)]
    assert holds(values.segment_sum(segment, 4), sums)


def test_a_segment_of_one_exact_term_stays_exact():
    result = Balls.exact([0.1, 0.2]).segment_sum(np.array([2, 0]), 3)
    assert result.mid.tolist() == [0.2, 0.0, 0.1]
    assert result.rad.tolist() == [0.0, 0.0, 0.0]


def test_a_long_sum_that_cancels_holds_the_exact_result():
    rng = np.random.default_rng(1)
    terms = rng.normal(size=4001) * 10.0 ** rng.integers(-12, 12, 4001)
    terms = np.r_[terms, -terms[::-1], 1e-9]
    result = Balls.exact(terms).segment_sum(np.zeros(len(terms), dtype=np.int64), 1)
    assert holds(result, [Fraction(1e-9)])


@pytest.mark.parametrize("scale", [1.0, 1e-160, 1e120])
@pytest.mark.parametrize("shape", [(3, 1, 1), (2, 4, 3), (1, 7, 7), (2, 3, 0)])
def test_gram_holds_the_exact_product(shape, scale):
    factors = np.random.default_rng(sum(shape)).normal(size=shape) * scale
    result = gram(factors)
    for k, matrix in enumerate(factors.tolist()):
        rows = [[Fraction(x) for x in row] for row in matrix]
        exact = [sum((x * y for x, y in zip(a, b, strict=True)), Fraction(0)) for a in rows for b in rows]
        assert holds(result[k], exact)


@settings(max_examples=200, deadline=None, derandomize=True)
@given(st.fractions())
@example(Fraction(1, 10**320))
@example(Fraction(1, 10**400))
@example(Fraction(10**300, 7))
def test_enclose_holds_the_rational_number(value):
    result = Balls.enclose(value)
    assert holds(result, [value])
    if value.denominator == 1 and abs(value) < 2**53:
        assert result.rad == 0


@settings(max_examples=200, deadline=None, derandomize=True)
@given(ball)
def test_ends_and_magnitude_are_rounded_outwards(value):
    a, (x,) = balls([value])
    assert Fraction(a.lower[0]) <= Fraction(a.mid[0]) - Fraction(a.rad[0]) <= x
    assert x <= Fraction(a.mid[0]) + Fraction(a.rad[0]) <= Fraction(a.upper[0])
    assert Fraction(a.magnitude()[0]) >= abs(x)


def test_joining_and_indexing_keep_midpoints_and_radii():
    joined = concatenate([Balls.exact([1.0, 2.0]), Balls(np.array([3.0]), np.array([0.5]))])
    assert len(joined) == 3
    assert joined[1:].mid.tolist() == [2.0, 3.0]
    assert joined[1:].rad.tolist() == [0.0, 0.5]


@pytest.mark.parametrize("factor", [0.0, 1.0, 3.0])
def test_a_radius_that_overflowed_is_not_lost_in_a_product(factor):
    with np.errstate(invalid="ignore"):
        unknown = Balls(np.array([1.0]), np.array([np.inf])) * Balls(np.array([factor]), np.array([0.0]))
    assert factor == 0 or not np.isfinite(unknown.rad[0])


def test_copies_negations_and_powers_of_two_stay_exact():
    data = Balls.exact(np.random.default_rng(2).normal(size=50))
    for factor in (1.0, -1.0, 0.25, 0.0, -8.0):
        product = data * Balls.exact(np.full(50, factor))
        assert (product.rad == 0).all()
        assert (product.mid == data.mid * factor).all()


@given(ball)
def test_kinks_of_a_ball_hold_those_of_its_members(part):
    own, (x,) = balls([part])
    for found, value in ((own.positive_part(), max(x, Fraction(0))), (own.sign(), (x > 0) - (x < 0))):
        assert abs(value - Fraction(float(found.mid[0]))) <= Fraction(float(found.rad[0]))
