"""The position: dead zones, a hysteresis that knows no rates, temperature in the stated direction, noise in bounds."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from smid.data import DataError
from smid.data.bundled import load_clutch
from smid.theses.clutch import POSITION_NOISE_BOUND, ReturnSpring, actuator_record, simulate_clutch, simulate_position
from smid.theses.clutch.hysteresis import trailing
from smid.theses.clutch.plant import NOISE_BOUND

SPRING = ReturnSpring()
corners = st.lists(st.floats(0.0, 40.0), min_size=2, max_size=8)


def path(levels, counts):
    """What runs straight from level to level, in so many steps each."""
    ways = zip(pairwise(levels), counts, strict=True)
    return np.concatenate([[levels[0]], *(np.linspace(*ends, count + 1)[1:] for ends, count in ways)])


def settled(pressure, temperature=20.0, spring=SPRING):
    """The position after the last pressure was held for long."""
    return simulate_position(np.concatenate([pressure, np.full(200, pressure[-1])]), temperature, spring)[-1]


@pytest.mark.parametrize("temperature", [-20.0, 20.0, 60.0])
def test_the_static_curve_balances_the_springs(temperature):
    share = 1.0 - SPRING.softening * (temperature - 20.0)

    def surplus(x, pressure):
        pressed = max(0.0, x - SPRING.kiss_point)
        return share * (SPRING.preload + SPRING.stiffness * x + SPRING.cushion * pressed**2) - pressure

    for pressure in (3.5, 6.0, 9.0, 20.0, 37.0):
        expected = brentq(surplus, 0.0, 20.0, args=(pressure,), xtol=1e-12)
        assert SPRING.static_position([pressure], temperature)[0] == pytest.approx(expected, abs=1e-9)


def test_the_dead_zones_hold():
    pressure = path([0.0, SPRING.preload + 0.7 * SPRING.friction, 0.0], [300, 300])
    assert not simulate_position(pressure).any()
    assert settled(np.array([0.0, SPRING.preload + SPRING.friction + 0.3])) > 0.2
    # Current to pressure, and the wider one from current to position.
    for top, has_pressure, has_position in ((250, False, False), (420, True, False), (600, True, True)):
        pressure = simulate_clutch(path([0.0, top, top], [200, 1000]))
        assert (pressure[-1] > NOISE_BOUND) == has_pressure
        assert (simulate_position(pressure)[-1] > POSITION_NOISE_BOUND) == has_position


def test_the_clutch_comes_back_from_everywhere():
    for top in (3.0, 8.0, 37.0):
        for temperature in (-20.0, 60.0):
            assert settled(path([0.0, top, 0.0], [50, 50]), temperature) == pytest.approx(0.0, abs=1e-12)


@given(corners, st.integers(2, 6), st.integers(7, 60))
def test_the_hysteresis_does_not_know_rates(levels, slow, slower):
    limit, width = SPRING.friction, 2 * SPRING.friction
    ends = [trailing(path(levels, [count] * (len(levels) - 1)), limit, width)[-1] for count in (2, slow, slower)]
    np.testing.assert_allclose(ends, ends[0], rtol=0, atol=1e-9)


@given(corners)
def test_friction_is_bounded_and_never_pushes(levels):
    pressure = path(levels, [9] * (len(levels) - 1))
    acting = trailing(pressure, SPRING.friction, 2 * SPRING.friction)
    assert np.abs(pressure - acting).max() <= SPRING.friction + 1e-12
    assert (np.diff(pressure) * np.diff(acting) >= -1e-12).all()


def test_the_step_of_the_hysteresis_solves_its_equation():
    limit, width = 0.8, 1.6
    f = 0.0
    for low, high in ((0.0, 5.0), (5.0, 4.2), (4.2, 9.0)):
        direction = np.sign(high - low)
        solution = solve_ivp(lambda _, f, d=direction: (d * limit - f) / width, (0, abs(high - low)), [f], rtol=1e-10)
        f = solution.y[0, -1]
    assert trailing(np.array([0.0, 5.0, 4.2, 9.0]), limit, width)[-1] == pytest.approx(9.0 - f, abs=1e-6)


def test_the_way_back_lies_higher_by_twice_the_friction():
    up, down = settled(path([0.0, 6.0], [100])), settled(path([0.0, 30.0, 6.0], [100, 100]))
    assert down - up == pytest.approx(2 * SPRING.friction / SPRING.stiffness, rel=0.02)
    without = replace(SPRING, friction=0.0)
    assert settled(path([0.0, 30.0, 6.0], [100, 100]), 20.0, without) == pytest.approx(3.5, abs=1e-9)


def test_a_minor_loop_lies_inside_the_major_one():
    pressure = path([0.0, 30.0, 8.0, 12.0, 8.0, 30.0], [200] * 5)
    acting = trailing(pressure, SPRING.friction, 2 * SPRING.friction)
    for level in (9.0, 11.0):
        rising, falling = 400 + round(50 * (level - 8)), 600 + round(50 * (12 - level))
        assert pressure[rising] == pressure[falling] == pytest.approx(level)
        assert level - SPRING.friction < acting[rising] < acting[falling] < level + SPRING.friction


def test_warm_springs_yield_and_cold_oil_delays():
    for pressure in (4.0, 10.0, 30.0):
        cold, mild, warm = (settled(np.array([0.0, pressure]), degrees) for degrees in (-20.0, 20.0, 60.0))
        assert cold < mild < warm
    step = np.repeat([0.0, 20.0], [1, 100])
    shares = [simulate_position(step, degrees)[4] / settled(step, degrees) for degrees in (-20.0, 20.0, 60.0)]
    assert shares == sorted(shares)
    # One sample late, as in the thesis's model, then with the stated time constant.
    moved = simulate_position(step, 20.0)[1:4] / settled(step)
    np.testing.assert_allclose(moved, 1 - np.exp(-np.arange(3) * 2e-3 / SPRING.lag), atol=1e-9)


def test_the_step_of_time_does_not_matter():
    coarse = simulate_position(np.repeat([0.0, 20.0, 5.0], [5, 40, 40]))
    fine = simulate_position(np.repeat([0.0, 20.0, 5.0], [100, 800, 800]), sampling_time=1e-4)
    np.testing.assert_allclose(coarse, fine[::20], atol=1e-9)
    current = np.repeat([0.0, 800.0, 300.0], [5, 40, 40])
    np.testing.assert_allclose(simulate_clutch(current), simulate_clutch(current.repeat(20), sampling_time=1e-4)[::20])


def test_one_call_gives_every_channel_with_noise_inside_its_bounds():
    current = np.repeat([0.0, 700.0, 450.0, 900.0, 0.0], 200)
    data = actuator_record(current, -20.0, seed=3)
    assert data.channels == load_clutch("20C_ramp_a").channels
    assert (data.inputs, data.outputs) == (("current",), ("pressure", "position"))
    pressure = simulate_clutch(current, -20.0)
    for name, truth, bound in (
        ("pressure", pressure, NOISE_BOUND),
        ("position", simulate_position(pressure, -20.0), POSITION_NOISE_BOUND),
    ):
        assert 0.98 * bound < np.abs(data.values(name) - truth).max() <= bound
    assert actuator_record(current, -20.0, seed=3).checksum == data.checksum
    assert actuator_record(current, -20.0, seed=4).checksum != data.checksum
    stiff = actuator_record(current, -20.0, seed=3, spring=ReturnSpring(stiffness=3.0))
    assert stiff.values("position").max() < data.values("position").max() - 1.0


def test_mistakes_are_named():
    with pytest.raises(DataError, match="series of finite samples, in bar"):
        simulate_position([np.nan])
    with pytest.raises(DataError, match="leaves no spring: give degC"):
        simulate_position([1.0], 400.0)
    with pytest.raises(DataError, match="temperature = nan"):
        simulate_position([1.0], float("nan"))
    with pytest.raises(DataError, match="sampling_time = 0"):
        simulate_position([1.0], sampling_time=0.0)
    with pytest.raises(DataError, match="sampling_time = -1"):
        simulate_clutch([1.0], sampling_time=-1.0)
    with pytest.raises(DataError, match="friction = -1"):
        ReturnSpring(friction=-1)
    with pytest.raises(DataError, match="stiffness = 0 is refused: give a positive number"):
        ReturnSpring(stiffness=0)
    with pytest.raises(DataError, match=r"preload = 0\.5 bar does not exceed friction"):
        ReturnSpring(preload=0.5)
