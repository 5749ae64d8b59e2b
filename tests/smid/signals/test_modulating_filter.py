"""The modulating filter: exact on polynomials, its response as stated, its definition by splines."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import trapezoid
from scipy.interpolate import BSpline

from smid.data import DataError
from smid.models import ModelError
from smid.signals import ModulatingFilter

STEP = 0.05


@pytest.mark.parametrize("order", [1, 2, 3, 4])
@pytest.mark.parametrize("width", [2, 6])
def test_lines_pass_unchanged_and_have_their_slope(order, width):
    chosen, time = ModulatingFilter(order, width), STEP * np.arange(60)
    line = 3.0 - 2.0 * time
    inner = time[chosen.margin : time.size - chosen.margin]
    np.testing.assert_allclose(chosen.derivative(line, STEP, 0), 3.0 - 2.0 * inner, atol=1e-12)
    if order > 1:
        np.testing.assert_allclose(chosen.derivative(line, STEP, 1), -2.0, atol=1e-12)
    if order > 2:
        np.testing.assert_allclose(chosen.derivative(line, STEP, 2), 0.0, atol=1e-11)


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 4), st.integers(1, 5), st.floats(0.5, 55.0), st.data())
def test_a_sine_is_multiplied_by_the_response(order, half, omega, data):
    chosen = ModulatingFilter(order, 2 * half)
    derivative = data.draw(st.integers(0, order - 1))
    time = STEP * np.arange(120)
    inner = time[chosen.margin : time.size - chosen.margin]
    expected = np.imag(chosen.response([omega], STEP, derivative)[0] * np.exp(1j * omega * inner))
    found = chosen.derivative(np.sin(omega * time), STEP, derivative)
    np.testing.assert_allclose(found, expected, atol=1e-9 * max(1.0, np.abs(expected).max()))


@pytest.mark.parametrize("derivative", [0, 1, 2])
def test_it_is_the_integral_with_the_derived_spline(derivative):
    """The definition (i.7): samples dense enough that the trapezoidal rule does not matter."""
    order, width, fine = 4, 400, 1e-3
    chosen, time = ModulatingFilter(order, width), fine * np.arange(order * width + 1)
    y = np.exp(time) + np.sin(5 * time)
    knots = width * fine * np.arange(order + 1)
    phi = BSpline.basis_element(knots, extrapolate=False).derivative(derivative)(time) / (width * fine)
    wanted = (-1) ** derivative * trapezoid(np.nan_to_num(phi) * y, dx=fine)
    assert chosen.derivative(y, fine, derivative)[0] == pytest.approx(wanted, rel=1e-4)


def test_noise_is_damped_where_a_difference_quotient_amplifies_it():
    noise = np.random.default_rng(1).normal(size=2000)
    wide = ModulatingFilter(3, 10)
    plain = np.gradient(np.gradient(noise, STEP), STEP)
    assert np.std(wide.derivative(noise, STEP, 2)) < np.std(plain) / 20


def test_says_what_is_wrong():
    with pytest.raises(ModelError, match="even width"):
        ModulatingFilter(3, 3)
    with pytest.raises(ModelError, match="give 0 to 2"):
        ModulatingFilter(3, 2).derivative(np.zeros(20), STEP, 3)
    with pytest.raises(DataError, match="more than 6 finite"):
        ModulatingFilter(3, 2).derivative(np.zeros(6), STEP, 1)
