"""Every operation on affine forms encloses the exact result, by its slopes with the radius and by its ends."""

import math
from fractions import Fraction

import mpmath
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from relaxations.algebra.affine_arithmetic import (
    CENTRE,
    HIGH,
    LOW,
    NO_PRODUCTS,
    RADIUS,
    SLOPES,
    add,
    between,
    copy,
    hull,
    interval,
    linear,
    multiply,
    nothing_known,
    spread,
)
from relaxations.algebra.affine_functions import Function, apply, larger

COUNT = 3
DIGITS = 80

mpmath.mp.dps = DIGITS
share = st.one_of(st.sampled_from([-1.0, 0.0, 1.0]), st.floats(-1, 1))
symbols = st.tuples(*[share] * COUNT)


def sized(largest):
    """Return numbers of all sizes up to a largest one."""
    powers = st.floats(-40, math.log10(largest)).map(lambda k: 10.0**k)
    return st.one_of(
        st.just(0.0),
        st.floats(-3, 3),
        st.builds(lambda size, sign: size * sign, powers, st.sampled_from([-1, 1])),
    )


def forms_of(largest):
    """Return what makes a form: centre, slopes, radius, share of the radius, how far the ends are, what is known."""
    size = sized(largest)
    return st.tuples(
        size,
        st.tuples(*[st.one_of(st.just(0.0), size)] * COUNT),
        st.one_of(st.just(0.0), size.map(abs)),
        share,
        st.tuples(st.one_of(st.just(0.0), size.map(abs)), st.one_of(st.just(0.0), size.map(abs))),
        st.sampled_from(["all", "all", "ends", "low", "high", "nothing"]),
    )


def below(x):
    """Return a float that is at most a fraction."""
    near = float(x)
    return near if Fraction(near) <= x else math.nextafter(near, -math.inf)


def above(x):
    return -below(-x)


def write(forms, to, parts, at):
    """Write a form, and return a number that it encloses at some symbols."""
    centre, slopes, radius, part, (under, over), known = parts
    x = Fraction(centre) + sum(Fraction(s) * Fraction(e) for s, e in zip(slopes, at, strict=True))
    x += Fraction(part) * Fraction(radius)
    reach = sum(map(Fraction, map(abs, slopes)), Fraction(radius))
    low, high = below(x - Fraction(under)), above(x + Fraction(over))
    if known == "all":
        forms[to] = [centre, radius, 0.0, 0.0, *slopes]
        forms[to, LOW] = max(low, below(Fraction(centre) - reach))
        forms[to, HIGH] = min(high, above(Fraction(centre) + reach))
    elif known == "ends":
        between(forms, to, low, high)
    else:
        nothing_known(forms, to)
        forms[to, LOW] = low if known == "low" else -math.inf
        forms[to, HIGH] = high if known == "high" else math.inf
    assert holds(forms[to], x, at)
    return x


def holds(form, exact, at):
    """Tell whether a form encloses a number; fractions and numbers of many digits."""
    if np.isnan(form).any() or not np.isfinite(form[[CENTRE, *range(SLOPES, len(form))]]).all():
        return False
    number = Fraction if isinstance(exact, Fraction) else mpmath.mpf
    left = exact - number(form[CENTRE]) - sum(number(s) * number(e) for s, e in zip(form[SLOPES:], at, strict=True))
    by_slopes = form[RADIUS] == math.inf or abs(left) <= number(form[RADIUS])
    by_low = form[LOW] == -math.inf or number(form[LOW]) <= exact
    return by_slopes and by_low and (form[HIGH] == math.inf or exact <= number(form[HIGH]))


def table():
    return np.zeros((3, SLOPES + COUNT))


def product(forms, to, a, b):
    multiply(forms, to, a, b, NO_PRODUCTS)


ordinary = forms_of(1e100)


@settings(max_examples=300, deadline=None, derandomize=True)
@given(ordinary, ordinary, symbols)
def test_sum_difference_product_larger_and_hull(left, right, at):
    forms = table()
    x, y = write(forms, 0, left, at), write(forms, 1, right, at)
    add(forms, 2, 0, 1, 1.0)
    assert holds(forms[2], x + y, at)
    add(forms, 2, 0, 1, -1.0)
    assert holds(forms[2], x - y, at)
    multiply(forms, 2, 0, 1, NO_PRODUCTS)
    assert holds(forms[2], x * y, at)
    larger(forms, 2, 0, 1)
    assert holds(forms[2], max(x, y), at)
    assert forms[2, LOW] >= max(forms[0, LOW], forms[1, LOW])
    assert forms[2, HIGH] <= max(forms[0, HIGH], forms[1, HIGH])
    hull(forms, 2, 0, 1)
    assert holds(forms[2], x, at)
    assert holds(forms[2], y, at)


@settings(max_examples=150, deadline=None, derandomize=True)
@given(ordinary, symbols)
def test_a_form_with_itself(parts, at):
    forms = table()
    x = write(forms, 0, parts, at)
    multiply(forms, 2, 0, 0, NO_PRODUCTS)
    assert holds(forms[2], x * x, at)
    add(forms, 2, 0, 0, -1.0)
    assert holds(forms[2], Fraction(0), at)
    if np.isfinite(forms[0, RADIUS]):
        assert Fraction(spread(forms, 0)) >= abs(x - Fraction(forms[0, CENTRE]))


@settings(max_examples=300, deadline=None, derandomize=True)
@given(st.lists(forms_of(1e60), min_size=3, max_size=3), st.tuples(share, share), share)
def test_products_of_symbols_are_kept(parts, factors, other):
    """Two unknowns with all their products, and a symbol of something else: (e0 e1 + ...) e2, say."""
    e, f = map(Fraction, factors)
    at = (e, f, Fraction(other), e * f, 2 * e * e - 1, 2 * f * f - 1)
    columns = np.array([[SLOPES + 4, SLOPES + 3], [-1, SLOPES + 5]])
    forms, values = np.zeros((5, SLOPES + len(at))), []
    for to, (centre, slopes, *rest) in enumerate(parts):
        values.append(write(forms, to, (centre, (*slopes, 0.0, 0.0, 0.0), *rest), at))
    multiply(forms, 3, 0, 1, columns)
    assert holds(forms[3], values[0] * values[1], at)
    multiply(forms, 4, 3, 2, columns)
    assert holds(forms[4], values[0] * values[1] * values[2], at)


def test_a_product_of_two_unknowns_leaves_rounding_alone():
    columns = np.array([[SLOPES + 3, SLOPES + 2], [-1, SLOPES + 4]])
    forms = np.zeros((3, SLOPES + 5))
    forms[0] = [3.0, 0.0, 2.5, 3.5, 0.5, 0.0, 0.0, 0.0, 0.0]
    forms[1] = [2.0, 0.0, 1.5, 2.5, 0.25, 0.25, 0.0, 0.0, 0.0]
    multiply(forms, 2, 0, 1, columns)
    # (3 + e/2) (2 + e/4 + f/4), where e e is half of the third symbol and 1.
    np.testing.assert_allclose(forms[2, [CENTRE, *range(SLOPES, 9)]], [6.0625, 1.75, 0.75, 0.125, 0.0625, 0.0])
    assert forms[2, RADIUS] < 1e-13


@settings(max_examples=200, deadline=None, derandomize=True)
@given(ordinary, sized(1e100), sized(1e100), sized(1e50).map(abs), share, symbols)
def test_a_multiple_and_a_constant_within_an_error(parts, factor, constant, error, part, at):
    forms = table()
    x = write(forms, 0, parts, at)
    linear(forms, 2, 0, factor, constant, error)
    assert holds(forms[2], Fraction(factor) * x + Fraction(constant) + Fraction(part) * Fraction(error), at)


def exact_value(function, x, exponent):
    """Return the exact or a very close value of a function; None where it has no real value."""
    if function in (Function.SIGN, Function.FLOOR, Function.SQUARE, Function.ABS):
        exact = {
            Function.ABS: lambda: abs(x),
            Function.SIGN: lambda: Fraction((x > 0) - (x < 0)),
            Function.FLOOR: lambda: Fraction(math.floor(x)),
            Function.SQUARE: lambda: x * x,
        }
        return exact[function]()
    if function is Function.RECIPROCAL:
        return 1 / x if x else None
    if (function is Function.LOG and x <= 0) or (function in (Function.ROOT, Function.POWER) and x < 0):
        return None
    if function is Function.POWER and x == 0 and exponent <= 0:
        return None
    number = mpmath.mpf(x.numerator) / x.denominator
    names = {Function.ROOT: "sqrt", Function.POWER: "power"}
    close = getattr(mpmath, names.get(function, function.name.lower()))
    return close(number, mpmath.mpf(exponent)) if function is Function.POWER else close(number)


exponents = st.one_of(st.sampled_from([0.5, 1.0, 1.5, 2.0, 3.0, -0.5, -2.0]), st.floats(0.05, 4))
EDGE = (1.0, (1.0, 0.0, 0.0), 0.0, 0.0, (5.0, 5.0), "all")
"""From zero to two."""


@pytest.mark.parametrize("function", list(Function), ids=lambda f: f.name)
@settings(max_examples=120, deadline=None, derandomize=True)
@example(EDGE, 0.5, (-1.0, 0.0, 0.0))
@example(EDGE, -1.5, (-1.0, 0.0, 0.0))
@example(EDGE, 1.5, (1.0, 0.0, 0.0))
@given(st.one_of(forms_of(3.0), forms_of(800.0), forms_of(1e20)), exponents, symbols)
def test_a_function(function, parts, exponent, at):
    forms = table()
    x = write(forms, 0, parts, at)
    apply(forms, 2, 0, int(function), exponent)
    exact = exact_value(function, x, exponent)
    assert not np.isnan(forms[2]).any()
    assert exact is None or holds(forms[2], exact, at)


@pytest.mark.parametrize("function", list(Function), ids=lambda f: f.name)
def test_a_function_at_the_edges_of_its_domain_and_of_the_floats(function):
    """Ends at zero, at the largest floats, at those that overflow, and infinite ends."""
    edges = [0.0, 5e-324, 1e-308, 1e-300, 1.0, 709.0, 709.5, 710.0, 1e154, 1e300, 1.7e308, math.inf]
    edges = sorted({sign * edge for edge in edges for sign in (-1.0, 1.0)})
    forms = table()
    for low in edges[:-1]:
        for high in edges[1:]:
            if low > high:
                continue
            between(forms, 0, low, high)
            apply(forms, 2, 0, int(function), 0.5)
            assert not np.isnan(forms[2]).any(), (low, high)
            # Large arguments of exp have values that no computer holds; those of sin need as many digits.
            for point in (low, high, 0.5 * low + 0.5 * high):
                if not (math.isfinite(point) and low <= point <= high) or (
                    abs(point) > 1e3 and function in (Function.EXP, Function.SIN, Function.COS)
                ):
                    continue
                exact = exact_value(function, Fraction(point), 0.5)
                if exact is not None and np.isfinite(forms[2, RADIUS]):
                    left = exact - (Fraction if isinstance(exact, Fraction) else mpmath.mpf)(forms[2, CENTRE])
                    assert abs(left) <= spread(forms, 2), (low, high, point)
                if exact is not None:
                    assert forms[2, LOW] <= exact <= forms[2, HIGH], (low, high, point)


@pytest.mark.parametrize("operation", [add, product, hull, larger])
def test_infinite_ends_give_no_number_that_is_none(operation):
    forms = table()
    ends = [(-math.inf, math.inf), (0.0, math.inf), (-math.inf, 0.0), (-math.inf, -1.0), (0.0, 0.0), (-1e308, 1e308)]
    for one in ends:
        for other in ends:
            between(forms, 0, *one)
            between(forms, 1, *other)
            for sign in (1.0, -1.0) if operation is add else (None,):
                operation(forms, 2, 0, 1, *([] if sign is None else [sign]))
                assert not np.isnan(forms[2]).any()
                assert forms[2, LOW] <= forms[2, HIGH]
    for factor in (0.0, 1.0, -1e308, 1e308):
        for one in ends:
            between(forms, 0, *one)
            linear(forms, 2, 0, factor, 1e308, 1e308)
            assert not np.isnan(forms[2]).any()


@pytest.mark.parametrize("function", list(Function), ids=lambda f: f.name)
def test_a_narrow_form_keeps_its_slope(function):
    """What is left over is of second order: a tenth of the width, a hundredth of the radius."""
    radii = []
    for half in (1e-3, 1e-4):
        forms = table()
        interval(forms, 0, 0.7, 0.0)
        forms[0, SLOPES], forms[0, LOW], forms[0, HIGH] = half, 0.7 - 2 * half, 0.7 + 2 * half
        apply(forms, 2, 0, int(function), 1.5)
        radii.append(forms[2, RADIUS])
    assert radii[0] <= 5e-5
    assert radii[1] <= 0.02 * radii[0] + 1e-13


def test_a_copy_is_cut_to_the_width_of_its_place():
    forms = table()
    write(forms, 0, EDGE, (0.0, 0.0, 0.0))
    narrow = np.ones((1, SLOPES + 1))
    copy(narrow, 0, forms, 0)
    np.testing.assert_array_equal(narrow[0], forms[0, : SLOPES + 1])


@given(x=sized(1e300))
@settings(deadline=None)
def test_a_number_less_itself_is_exactly_zero(x):
    forms = np.zeros((3, SLOPES + COUNT))
    interval(forms, 0, x, 0.0)
    linear(forms, 1, 0, -1.0, 0.0, 0.0)
    add(forms, 2, 0, 1, 1.0)
    assert not forms[2].any()
