"""Every operation on intervals contains the exact results, computed with fractions."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from relaxations.algebra.intervals import Intervals

numbers = st.floats(-1e6, 1e6, allow_subnormal=False)
pairs = st.tuples(numbers, numbers).map(sorted)


def contains(found, exact):
    return all(Fraction(float(found.lower)) <= x <= Fraction(float(found.upper)) for x in exact)


@given(pairs, pairs)
def test_results_of_ends_and_middles_lie_inside(one, two):
    a, b = Intervals.of(*one), Intervals.of(*two)
    xs, ys = ([Fraction(low), (Fraction(low) + Fraction(high)) / 2, Fraction(high)] for low, high in (one, two))
    assert contains(a + b, [x + y for x in xs for y in ys])
    assert contains(a - b, [x - y for x in xs for y in ys])
    assert contains(a * b, [x * y for x in xs for y in ys])
    assert contains(a / 3.0, [x / 3 for x in xs])
    assert contains(a.square(), [x * x for x in xs])
    assert contains(a.hull(b), [*xs, *ys])
    assert float(a.width) >= float(xs[2] - xs[0])


@given(pairs, pairs)
def test_the_intersection_is_empty_where_the_ends_cross(one, two):
    met = Intervals.of(*one).meet(Intervals.of(*two))
    assert met.empty == (max(one[0], two[0]) > min(one[1], two[1]))


def test_zero_times_an_infinite_end_is_zero():
    product = Intervals.of(0.0) * Intervals.within(np.inf)
    assert (float(product.lower), float(product.upper)) == (pytest.approx(0.0), pytest.approx(0.0))
