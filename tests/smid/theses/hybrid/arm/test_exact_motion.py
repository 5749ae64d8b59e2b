"""The arm's exact motion against the fine-step plant and SciPy's integrator with its own events."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from smid.data import DataError
from smid.models import ModelError
from smid.theses.hybrid import simulate_arm
from smid.theses.hybrid.arm import ARM, exact_motion

STEP = 0.02


def _integrated(u, start=(0.0, 0.0), arm=ARM):
    """Solve the motion regime by regime, with SciPy finding the edges."""

    def regime(speed, torque):
        if speed == 0:
            return ("stick", np.sign(torque))
        side = np.sign(speed)
        size = abs(speed)
        outside = size > arm["eps"] or (size == arm["eps"] and side * torque > arm["Wd"] + arm["b"] * arm["eps"] ** 2)
        return ("glide" if outside else "stick", side)

    angle, speed = start
    states = [(angle, speed)]
    for torque in arm["c"] * np.asarray(u[:-1]):
        now = 0.0
        while now < STEP:
            kind, side = regime(speed, torque)
            if side == 0:
                break

            def rate(_, x, kind=kind, side=side, torque=torque):
                held = arm["Wd"] * side if kind == "glide" else arm["Ws"] * x[1] / arm["eps"]
                return [x[1], arm["theta"] * (torque - held - arm["b"] * x[1] * abs(x[1]))]

            edges = [arm["eps"]] if kind == "glide" else [0.0, arm["eps"]]
            events = []
            for edge in edges:
                if side * speed != edge:
                    event = lambda _, x, edge=edge, side=side: side * x[1] - edge  # noqa: E731
                    event.terminal = True
                    event.edge = side * edge
                    events.append(event)
            run = solve_ivp(rate, (now, STEP), [angle, speed], rtol=1e-11, atol=1e-13, events=events)
            angle, speed = run.y[:, -1]
            now = run.t[-1]
            for event, times in zip(events, run.t_events, strict=True):
                if len(times):
                    speed = event.edge
        states.append((angle, speed))
    return np.array(states)


@pytest.mark.parametrize("amplitude", [0.05, 0.1, 1.0])
def test_agrees_with_scipy_and_its_events(amplitude):
    u = amplitude * np.sin(6.0 * STEP * np.arange(80) + 0.3)
    exact, integrated = exact_motion(u, STEP), _integrated(u)
    assert np.abs(exact - integrated).max() < 1e-7 * max(1.0, np.abs(exact).max())


def test_the_plant_of_small_steps_tends_to_it():
    u = np.sin(1.5 * STEP * np.arange(200))
    error = np.abs(exact_motion(u, STEP)[:, 0] - simulate_arm(u, STEP)).max()
    assert 0 < error < 2e-3


def test_a_held_arm_rests_and_gliding_ends_at_the_balance_of_torques():
    assert exact_motion(np.full(5, 0.0), STEP).tolist() == [[0.0, 0.0]] * 5
    creeping = exact_motion(np.full(100, 0.05), STEP)[-1, 1]
    assert creeping == pytest.approx(0.05 * ARM["c"] * ARM["eps"] / ARM["Ws"], rel=1e-4)  # drag is 1e-6 of it
    fast = exact_motion(np.full(500, 0.8), STEP)[-1, 1]
    assert fast == pytest.approx(np.sqrt((0.8 * ARM["c"] - ARM["Wd"]) / ARM["b"]), rel=1e-9)


@settings(max_examples=40, deadline=None)
@given(st.floats(-0.9, 0.9), st.floats(-60, 60), st.integers(2, 7))
def test_one_interval_is_many_shorter_ones(u, speed, parts):
    whole = exact_motion([u, u], STEP, start=(0.3, speed))[-1]
    pieces = exact_motion(np.full(parts + 1, u), STEP / parts, start=(0.3, speed))[-1]
    np.testing.assert_allclose(pieces, whole, rtol=1e-8, atol=1e-9)


@settings(max_examples=40, deadline=None)
@given(st.lists(st.floats(-1, 1), min_size=2, max_size=12), st.floats(-60, 60))
def test_it_is_odd(u, speed):
    right = exact_motion(u, STEP, start=(0.0, speed))
    left = exact_motion(-np.array(u), STEP, start=(0.0, -speed))
    np.testing.assert_allclose(left, -right, rtol=1e-9, atol=1e-11)


def test_a_long_interval_does_not_overflow():
    assert np.isfinite(exact_motion([0.5, 0.5, 0.05, 0.05], 1000.0)).all()


def test_says_what_is_wrong():
    with pytest.raises(DataError, match="series of finite"):
        exact_motion([0.0, np.nan], STEP)
    with pytest.raises(DataError, match="positive number of seconds"):
        exact_motion([0.0], 0.0)
    with pytest.raises(ModelError, match="did you mean 'Ws'"):
        exact_motion([0.0], STEP, values={"W_s": 1.0})
    with pytest.raises(ModelError, match="b = 0"):
        exact_motion([0.0], STEP, values={"b": 0.0})
    with pytest.raises(ModelError, match="chatters"):
        exact_motion([0.0], STEP, values={"Ws": 0.1})
