"""Prior knowledge against what it means: roots, gains, boxes."""

import math

import numpy as np
import pytest
import sympy
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from smid.models import ErrorsInVariables, Hammerstein, ModelError, OutputError, schur_cohn, simulate

COEFFICIENTS = st.floats(-3, 3, allow_nan=False).map(lambda x: round(x, 3))
ROOTS = st.floats(-1.3, 1.3).map(lambda x: round(x, 3))
_COMPILED = {}


def conditions_at(order, monic, radius, coefficients):
    key = order, monic, radius
    if key not in _COMPILED:
        symbols = sympy.symbols(f"c0:{order + 1}", real=True)
        row = [sympy.Integer(1), *symbols[1:]] if monic else list(symbols)
        _COMPILED[key] = sympy.lambdify(symbols, schur_cohn(row, radius))
    return np.array(_COMPILED[key](*coefficients))


def check(order, monic, radius, coefficients):
    largest = np.abs(np.roots(coefficients)).max()
    values = conditions_at(order, monic, radius, coefficients)
    # On the boundary neither side is decided in floating point.
    assume(abs(largest - radius) > 1e-4 and np.abs(values).min() > 1e-12)
    assert (values > 0).all() == (largest < radius)


@settings(max_examples=150, deadline=None)
@given(st.integers(1, 5).flatmap(lambda n: st.lists(COEFFICIENTS, min_size=n, max_size=n)))
def test_schur_cohn_on_random_coefficients(tail):
    check(len(tail), True, 1.0, [1.0, *tail])


@settings(max_examples=200, deadline=None)
@given(
    st.lists(ROOTS, max_size=3),
    st.lists(st.tuples(ROOTS, ROOTS), max_size=1),
    st.sampled_from([1.0, 0.9]),
)
def test_schur_cohn_on_random_roots(real, pairs, radius):
    roots = [*real, *(z for x, y in pairs for z in (complex(x, y), complex(x, -y)))]
    assume(roots)
    check(len(roots), True, radius, np.poly(roots).real)


@settings(max_examples=100, deadline=None)
@given(st.lists(ROOTS, min_size=1, max_size=3), st.floats(-2, 2).map(lambda x: round(x, 2)), st.booleans())
def test_schur_cohn_with_any_leading_coefficient(roots, leading, complex_pair):
    assume(abs(leading) > 0.1)
    roots = [complex(roots[0], 0.4), complex(roots[0], -0.4), *roots[1:]] if complex_pair else roots
    check(len(roots), False, 1.0, leading * np.poly(roots).real)


def test_low_orders_are_linear():
    for order in (1, 2):
        symbols = sympy.symbols(f"a1:{order + 1}", real=True)
        for condition in schur_cohn([1, *symbols]):
            assert sympy.Poly(condition, *symbols).total_degree() == 1


def test_stability_tightens_boxes_by_binomials():
    model = OutputError(3, 0, stable=True)
    assert [model.parameter(f"a{i}").upper for i in (1, 2, 3)] == [3, 3, 1]
    radius = OutputError(2, 0, pole_radius=0.5)
    assert [radius.parameter(f"a{i}").upper for i in (1, 2)] == [1.0, 0.25]
    assert OutputError(1, 0, stable=True).constraints == ()


@settings(max_examples=25, deadline=None)
@given(st.floats(-0.95, 0.95), st.floats(-0.9, 0.9), st.floats(-2, 2))
def test_unit_dc_gain_settles_at_the_static_curve(p1, p2, beta0):
    alpha = np.poly([p1, p2])
    model = Hammerstein(poles=2, zeros=1, powers=(1,))
    values = {"alpha1": alpha[1], "alpha2": alpha[2], "gamma1": 3.0, "beta0": beta0}
    settled = simulate(model, {"u": np.full(1500, 2.0)}, values)["y"][-1]
    assert settled == pytest.approx(6.0, rel=1e-6, abs=1e-6)


def satisfied(model, **values):
    symbols = {item.symbol: values[item.name] for item in model.parameters}
    inside = all(item.lower - 1e-12 <= values[item.name] <= item.upper + 1e-12 for item in model.parameters)
    return inside and all(float(item.xreplace(symbols)) >= -1e-12 for item in model.constraints)


def test_dc_gain_number_and_range():
    model = OutputError(1, 1, dc_gain=4.0)
    settled = simulate(model, {"u": np.ones(300)}, {"a1": -0.8, "b0": 0.3})["y"][-1]
    assert settled == pytest.approx(4.0)
    ranged = ErrorsInVariables(1, 0, stable=True, dc_gain=(3, 7))
    assert satisfied(ranged, a1=-0.9, b0=0.5)
    assert not satisfied(ranged, a1=-0.9, b0=0.2)
    with pytest.raises(ModelError, match="add stable=True"):
        OutputError(1, 0, dc_gain=(3, 7))
    with pytest.raises(ModelError, match="no finite DC gain"):
        OutputError(1, 0, dc_gain=1.0, integrator=True)


@settings(max_examples=100, deadline=None)
@given(ROOTS, ROOTS, st.booleans(), st.sampled_from([-1.5, 0.7]))
def test_ranges_of_real_roots(first, second, pair, gain):
    poly = np.poly([complex(first, second), complex(first, -second)] if pair else [first, second]).real
    span = (-0.2, 0.8)
    roots = np.roots(poly)
    assume(np.abs(roots.real[:, None] - np.array(span)).min() > 1e-6)
    real = not pair or second == 0
    assume(real or abs(second) > 1e-3)
    inside = real and bool(((roots.real > span[0]) & (roots.real < span[1])).all())
    poles = OutputError(2, 0, pole_range=span)
    assert satisfied(poles, a1=poly[1], a2=poly[2], b0=1.0) == inside
    zeros = OutputError(1, 2, zero_range=span)
    b0, b1, b2 = gain * poly
    assert satisfied(zeros, a1=0.0, b0=b0, b1=b1, b2=b2) == inside


def test_ranges_beyond_two_roots_are_refused():
    with pytest.raises(ModelError, match="one or two roots, not 3"):
        OutputError(3, 0, pole_range=(0, 1))
    with pytest.raises(ModelError, match="is not a range"):
        OutputError(1, 0, pole_range=(1, 0))


def test_integrator_puts_one_pole_at_one():
    model = OutputError(3, 0, integrator=True, stable=True)
    assert [item.name for item in model.parameters] == ["a1", "a2", "b0"]
    inside, outside = np.poly([1, 0.5, -0.4]), np.poly([1, 1.2, 0.1])
    assert inside.sum() == pytest.approx(0)
    assert satisfied(model, a1=inside[1], a2=inside[2], b0=1.0)
    assert not satisfied(model, a1=outside[1], a2=outside[2], b0=1.0)
    ramp = simulate(OutputError(1, 0, integrator=True), {"u": np.ones(4)}, {"b0": 2.0})["y"]
    np.testing.assert_allclose(ramp, [0, 2, 4, 6])


def test_signs_make_minimum_phase_linear():
    model = OutputError(1, 2, minimum_phase=True, bounds={"b0": (0, math.inf)})
    symbols = [item.symbol for item in model.parameters]
    assert all(sympy.Poly(item, *symbols).total_degree() == 1 for item in model.constraints)
    assert satisfied(model, a1=0.0, b0=2.0, b1=-0.4, b2=-0.1)
    assert not satisfied(model, a1=0.0, b0=1.0, b1=-3.0, b2=0.5)
    unsigned = OutputError(1, 1, minimum_phase=True)
    assert satisfied(unsigned, a1=0.0, b0=-2.0, b1=1.0)
    assert not satisfied(unsigned, a1=0.0, b0=-1.0, b1=2.0)


def test_fixed_and_bounds():
    model = OutputError(1, 1, fixed={"b0": 1.0}, bounds={"a1": (-0.9, 0.5)}, stable=True)
    assert [item.name for item in model.parameters] == ["a1", "b1"]
    assert (model.parameter("a1").lower, model.parameter("a1").upper) == (-0.9, 0.5)
    with pytest.raises(ModelError, match="no parameter 'c'"):
        OutputError(1, 1, fixed={"c": 1.0})
    with pytest.raises(ModelError, match="leave no value for 'a1'"):
        OutputError(1, 1, stable=True, bounds={"a1": (2, 3)})
    with pytest.raises(ModelError, match=r"unknown option 'stabel', did you mean 'stable'\?"):
        OutputError(1, 1, stabel=True)


def test_the_gain_of_a_hammerstein_model_must_be_unique():
    with pytest.raises(ModelError, match="gain is not unique"):
        Hammerstein(unit_dc_gain=False)
    model = Hammerstein(unit_dc_gain=False, fixed={"beta": 1.0})
    assert [item.name for item in model.parameters] == ["alpha", "gamma1", "gamma2", "gamma3"]
    with pytest.raises(ModelError, match="excludes integrator"):
        Hammerstein(integrator=True)
    with pytest.raises(ModelError, match="list each power once"):
        Hammerstein(powers=(3, 3))
    with pytest.raises(ModelError, match="poles = -1 is not a valid order"):
        Hammerstein(poles=-1)


def test_poles_on_the_circle_that_fixed_coefficients_imply_are_admitted():
    # a1 = 0 is the only value with both poles within 0.5, and they lie on the circle.
    model = OutputError(na=2, nb=1, stable=True, pole_radius=0.5, fixed={"a2": -0.25})
    (a1,) = (p for p in model.parameters if p.name == "a1")
    assert a1.lower == a1.upper == 0


def test_a_model_without_poles_is_stable() -> None:
    assert OutputError(0, 1, stable=True) == OutputError(0, 1)
