"""The plants against closed solutions and against the models of the package, and each against its base."""

from dataclasses import replace

import numpy as np
import pytest

from smid.data import DataError
from smid.models import ModelError, Reactor, RotatingArm, simulate
from smid.signals import qprts, sine
from smid.theses.hybrid import MISMATCHES, Mismatch, arm_base, reactor_base, simulate_arm, simulate_reactor

U = qprts(60, seed=4)


def test_linear_reactors_are_exponentials():
    y, z = np.empty(len(U)), np.empty(len(U))
    y[0] = z[0] = U[0]
    for k in range(1, len(U)):
        end = 0.76 * U[k - 1]
        y[k] = end + (y[k - 1] - end) * np.exp(-1 / 2)
        # The second tank sees end + (y - end) exp(-s/2) over the second.
        fed = 0.52 * (y[k - 1] - end) / 4 * (np.exp(-1 / 2) - np.exp(-1 / 4)) / (1 / 4 - 1 / 2)
        z[k] = 0.52 * end + (z[k - 1] - 0.52 * end) * np.exp(-1 / 4) + fed
    np.testing.assert_allclose(simulate_reactor("time_constant", U, 1.0), y, rtol=1e-8)
    np.testing.assert_allclose(simulate_reactor("two_in_succession", U, 1.0), z, rtol=1e-8)
    np.testing.assert_allclose(simulate_reactor("square_root", U, 1.0), np.sqrt(y), rtol=1e-8)
    np.testing.assert_allclose(simulate_reactor("sine", U, 1.0), 0.4 * np.sin(10 * y) + 0.5, atol=1e-8)


@pytest.mark.parametrize(("name", "a", "x"), [("factor", 2.0, 1.0), ("power", 1.0, 3.0)])
def test_the_model_of_the_right_structure_is_the_plant(name, a, x):
    model = Reactor(2.0, a, x, sampling_time=1.0, substeps=20)
    run = simulate(model, {"u": U}, initial={"w": [U[0]]})["y"]
    np.testing.assert_allclose(simulate_reactor(name, U, 1.0), run, rtol=1e-6)


@pytest.mark.parametrize("name", MISMATCHES)
def test_no_base_model_is_the_plant(name):
    base = reactor_base(name)
    assert all(item.lower == item.upper for item in base.parameters)
    assert base.parameter("tau").lower == (4.0 if name.startswith("time_constant") else 2.0)
    run = simulate(replace(base, sampling_time=1.0), {"u": U}, initial={"w": [U[0]]})
    assert np.abs(run["y"] - simulate_reactor(name, U, 1.0))[5:].max() > 0.02


def test_first_principles_alone_are_the_base():
    got = simulate_reactor(Mismatch(), U, 1.0, start=0.1)
    run = simulate(Reactor(2.0, sampling_time=1.0, substeps=10), {"u": U}, initial={"w": [0.1]})["y"]
    np.testing.assert_allclose(got, run, rtol=1e-6)


def test_the_arm_without_resistance_is_its_base():
    u = sine(40, sampling_time=0.05, frequency=1.0, amplitude=0.8)
    for measured in ("angle", "speed"):
        got = simulate_arm(u, 0.05, measured, friction=False, drag=False)
        base = arm_base(measured)
        model = RotatingArm(measured=measured, sampling_time=0.05)
        assert base.parameters == model.parameters
        np.testing.assert_allclose(got, simulate(model, {"u": u})["y"], rtol=1e-9, atol=1e-9)


def test_the_arm_with_friction_agrees_with_its_model():
    u = sine(4000, sampling_time=5e-4, frequency=0.7, amplitude=0.3)
    run = simulate(RotatingArm(friction=True, drag=True, sampling_time=5e-4), {"u": u})
    # Sticking ends with a jump of the torque, which a step may meet anywhere in its 0.5 ms.
    np.testing.assert_allclose(simulate_arm(u, 5e-4), run["angle"], atol=0.05)
    np.testing.assert_allclose(simulate_arm(u, 5e-4, "speed"), run["speed"], atol=0.05)
    assert np.abs(simulate_arm(u, 5e-4) - simulate_arm(u, 5e-4, friction=False)).max() > 1


def test_sticking_holds_and_gliding_ends():
    still = simulate_arm(np.full(30, 0.06), 0.01, "speed")
    assert still.max() < 0.03
    # 0.3 V against gliding friction and drag: the speed at which they balance.
    free = simulate_arm(np.full(400, 0.3), 0.05, "speed")[-1]
    assert free == pytest.approx(np.sqrt((15.96 * 0.3 - 0.43) / 0.0027), rel=1e-3)


def test_mistakes_are_named():
    with pytest.raises(ModelError, match="unknown mismatch 'powr', did you mean 'power'"):
        simulate_reactor("powr", U, 1.0)
    with pytest.raises(ModelError, match="unknown mismatch"):
        reactor_base("tau")
    with pytest.raises(ModelError, match="unknown signal 'angel'"):
        simulate_arm(U, 1.0, "angel")
    with pytest.raises(DataError, match="series of finite samples"):
        simulate_reactor("power", [[1.0]], 1.0)
    with pytest.raises(DataError, match="positive number of seconds"):
        simulate_arm(U, -1.0)
