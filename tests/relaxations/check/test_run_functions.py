"""The run checker's fixed-point functions and affine forms, against mpmath."""

import math
from fractions import Fraction

import mpmath
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from relaxations.check.runs import affine, fixed, functions
from relaxations.check.runs.fixed import BITS, ONE

DIGITS = mpmath.MPContext()
DIGITS.prec = 1500
UNIT = DIGITS.mpf(2) ** BITS


def anywhere(_: int) -> bool:
    return True


# Numbers of every size, and those near zero, one and the limits of a reduction.
UNITS = st.one_of(
    st.integers(-(1 << 300), 1 << 300),
    st.integers(-(1 << 140), 1 << 140),
    st.integers(-9, 9),
    st.builds(lambda side, off: side * ONE + off, st.sampled_from([-1, 1]), st.integers(-9, 9)),
    st.builds(lambda k, off: int(k * DIGITS.pi * UNIT / 2) + off, st.integers(-50, 50), st.integers(-9, 9)),
)
EXACT = {
    "exp": (DIGITS.exp, lambda x: -(ONE << 20) < x <= 512 * ONE),
    "log": (DIGITS.log, lambda x: x > 0),
    "sin": (DIGITS.sin, anywhere),
    "cos": (DIGITS.cos, anywhere),
    "tanh": (DIGITS.tanh, lambda x: abs(x) < 2000 * ONE),
    "atan": (DIGITS.atan, anywhere),
    "phi": (lambda x: DIGITS.expm1(x) / x if x else DIGITS.mpf(1), lambda x: -(ONE << 20) < x <= 512 * ONE),
    "phi_slope": (
        lambda x: (DIGITS.exp(x) * (x - 1) + 1) / x**2 if x else DIGITS.mpf(1) / 2,
        lambda x: -(ONE << 20) < x <= 512 * ONE,
    ),
    "root": (DIGITS.sqrt, lambda x: x >= 0),
    "square": (lambda x: x * x, anywhere),
    "reciprocal": (lambda x: 1 / x, lambda x: x != 0),
}


@pytest.mark.parametrize("name", EXACT)
@given(x=UNITS)
@settings(max_examples=150, deadline=None)
def test_a_function_lies_between_its_ends(name: str, x: int) -> None:
    exact, defined = EXACT[name]
    if defined(x):
        low, high = getattr(fixed, name)(x)
        value = exact(DIGITS.mpf(x) / UNIT) * UNIT
        assert low <= value <= high
        grows = name in ("exp", "phi", "phi_slope") and abs(x) >= ONE
        if not grows and abs(x) < fixed._LARGEST_ANGLE:
            assert high - low <= 3


@given(x=st.integers(1, 1 << 140), exponent=st.fractions(Fraction(1, 9), 9, max_denominator=50))
@settings(max_examples=150, deadline=None)
def test_a_power_lies_between_its_ends(x: int, exponent: Fraction) -> None:
    low, high = fixed.power(x, exponent)
    assert low <= (DIGITS.mpf(x) / UNIT) ** (DIGITS.mpf(exponent.numerator) / exponent.denominator) * UNIT <= high


def test_extreme_arguments_have_true_ends() -> None:
    assert fixed.exp(513 * ONE)[1] == math.inf
    assert fixed.exp(-(1 << 4000)) == (0, 1)
    assert fixed.sin(1 << 4000) == (-ONE, ONE)
    assert fixed.power(0, Fraction(1, 3)) == (0, 0)


# ---------------------------------------------------------------- forms

PRODUCTS = {(0, 0): 3, (0, 1): 4, (1, 1): 5}
SHARES = st.fractions(-1, 1, max_denominator=64)
UNARY = {
    "positive": lambda x: max(x, DIGITS.mpf(0)),
    "sign": DIGITS.sign,
    "floor": DIGITS.floor,
    "square": lambda x: x * x,
    "reciprocal": lambda x: 1 / x if x else None,
    "sqrt": lambda x: DIGITS.sqrt(x) if x >= 0 else None,
    "exp": DIGITS.exp,
    "log": lambda x: DIGITS.log(x) if x > 0 else None,
    "sin": DIGITS.sin,
    "cos": DIGITS.cos,
    "tanh": DIGITS.tanh,
    "atan": DIGITS.atan,
}


@st.composite
def forms_and_points(draw):
    """Return two forms, values of their symbols, and a number of each form."""
    shares = draw(st.tuples(SHARES, SHARES, SHARES))
    size = st.floats(-8, 8).map(lambda v: int(Fraction(v) * ONE))
    pair = []
    for _ in range(2):
        slopes = {k: s for k in range(3) if (s := draw(size) >> draw(st.sampled_from([2, 20])))}
        radius = abs(draw(size)) >> draw(st.sampled_from([3, 30, BITS + 4]))
        mid = draw(size)
        reach = sum(map(abs, slopes.values())) + radius
        form = affine.narrowed(affine.Form(mid, slopes, radius, mid - reach, mid + reach), -math.inf, math.inf)
        point = mid + sum(s * shares[k] for k, s in slopes.items()) + radius * draw(SHARES)
        pair.append((form, point))
    return shares, pair


def holds(form: affine.Form, shares, value) -> None:
    """Assert that a form holds for a number in units."""
    assert form.low <= value <= form.high
    if isinstance(form.radius, int):
        line = DIGITS.mpf(form.mid) + sum(
            DIGITS.mpf(s) * shares[k].numerator / shares[k].denominator for k, s in form.slopes.items()
        )
        assert abs(value - line) <= form.radius + DIGITS.mpf(2) ** -1000


def exactly(value):
    return DIGITS.mpf(value.numerator) / value.denominator


@given(found=forms_and_points())
@settings(max_examples=300, deadline=None)
def test_forms_hold_at_points(found) -> None:
    shares, ((a, x), (b, y)) = found
    x, y = exactly(x), exactly(y)
    holds(affine.add(a, b), shares, x + y)
    holds(affine.negative(a), shares, -x)
    holds(affine.multiply(a, b), shares, x * y / UNIT)
    holds(affine.multiply(a, a), shares, x * x / UNIT)
    e, f, _ = shares
    further = (*shares, 2 * e * e - 1, e * f, 2 * f * f - 1)
    product = affine.multiply(a, b, PRODUCTS)
    holds(product, further, x * y / UNIT)
    holds(affine.multiply(product, a, PRODUCTS), further, x * y * x / UNIT**2)
    for value in (x, y):
        holds(affine.hull(a, b), shares, value)
    for name, function in UNARY.items():
        value = function(x / UNIT)
        if value is not None:
            holds(functions.FUNCTIONS[name](a), shares, value * UNIT)
    for base in (x, x * x / (100 * UNIT)):
        if base > 0 and base != UNIT:
            form = a if base is x else affine.multiply(affine.scaled(a, Fraction(1, 100)), a)
            share = (1 - (base / UNIT) ** (y / UNIT)) / (1 - base / UNIT)
            holds(functions.geometric(form, b), shares, share * UNIT)
    for exponent in (Fraction(1, 3), Fraction(7, 4)):
        if x > 0:
            holds(functions.power(a, exponent), shares, (x / UNIT) ** exactly(exponent) * UNIT)
