"""The reactor and the arm against SciPy's integrator, and from a file."""

import numpy as np
import pytest
import sympy

from smid.models import ModelError, Reactor, RotatingArm, load_model, model_from_mapping, simulate
from tests.smid.models.rates_by_scipy import integrate

U = np.repeat(np.random.default_rng(7).uniform(0.2, 0.9, 8), 5)
ORDERS = {"euler": 1, "trapezoidal": 2, "rk4": 4}


def _orders(build, rate, start, names, u, sampling_time, scheme):
    exact = integrate(rate, start, u, sampling_time)
    errors = []
    for substeps in (4, 8):
        run = simulate(
            build(scheme=scheme, substeps=substeps, sampling_time=sampling_time),
            {"u": u},
            initial={name: [first] for name, first in zip(names, start, strict=True)},
        )
        errors.append(max(np.abs(run[name] - row).max() for name, row in zip(names, exact, strict=True)))
    return np.log2(errors[0] / errors[1]), errors[1]


@pytest.mark.parametrize("scheme", ORDERS)
@pytest.mark.parametrize(("a", "x"), [(1.0, 1.0), (2.0, 1.0), (1.0, 3.0)])
def test_the_reactor_converges_to_its_equation(scheme, a, x):
    order, error = _orders(
        lambda **options: Reactor(2.0, a, x, **options),
        lambda s, u: [(1 / 2 - 0.12) * u - a * s[0] ** x / 2],
        [0.4],
        ["w"],
        U,
        1.0,
        scheme,
    )
    assert order == pytest.approx(ORDERS[scheme], abs=0.3)
    assert error < 0.02


@pytest.mark.parametrize("scheme", ORDERS)
def test_the_arm_with_drag_converges_to_its_equation(scheme):
    order, error = _orders(
        lambda **options: RotatingArm(drag=True, **options),
        lambda s, u: [s[1], 21.7391 * (15.96 * u - 0.0027 * s[1] * abs(s[1]))],
        [0.1, 5.0],
        ["angle", "speed"],
        U,
        0.05,
        scheme,
    )
    assert order == pytest.approx(ORDERS[scheme], abs=0.3)
    assert error < 3


def test_the_arm_without_resistance_is_newtons_law():
    run = simulate(RotatingArm(measured="speed", sampling_time=0.1), {"u": np.ones(11)})
    np.testing.assert_allclose(run["y"], 21.7391 * 15.96 * 0.1 * np.arange(11))
    np.testing.assert_allclose(run["angle"], 21.7391 * 15.96 * (0.1 * np.arange(11)) ** 2 / 2)


def test_friction_sticks_and_glides():
    rate = RotatingArm(friction=True, drag=True).lines[1].expression
    arm = RotatingArm(friction=True, drag=True)
    values = {p.symbol: p.lower for p in arm.parameters}
    atoms = {str(item.base.label): item for item in rate.atoms(sympy.Indexed)}
    for speed in (-8.0, -0.05, -0.02, 0.0, 0.01, 0.029, 0.031, 3.0):
        sticking = 1.2 * speed / 0.03 if abs(speed) < 0.03 else 0.43 * np.sign(speed)
        expected = 21.7391 * (15.96 * 0.1 - sticking - 0.0027 * speed * abs(speed))
        got = float(rate.xreplace({**values, atoms["speed"]: sympy.Float(speed), atoms["u"]: sympy.Float(0.1)}))
        assert got == pytest.approx(expected, rel=1e-12)
    # 0.05 V make less torque than sticking holds.
    still = simulate(RotatingArm(friction=True, measured="speed", sampling_time=1e-3), {"u": np.full(100, 0.05)})["y"]
    assert still[-1] == pytest.approx(15.96 * 0.05 * 0.03 / 1.2, rel=1e-6)


def test_plants_from_a_file(tmp_path):
    assert model_from_mapping({"class": "Reactor", "tau": 4.0}) == Reactor(4.0)
    path = tmp_path / "arm.toml"
    path.write_text('class = "RotatingArm"\nfriction = true\nsampling_time = 0.01\n', encoding="utf-8")
    assert load_model(path) == RotatingArm(friction=True, sampling_time=0.01)
    with pytest.raises(ModelError, match="unknown field of Reactor 'stable'"):
        model_from_mapping({"class": "Reactor", "stable": True})


def test_plants_say_what_is_free():
    free = Reactor(None, None, None)
    assert [item.lower < item.upper for item in free.parameters] == [True] * 3
    assert [item.lower for item in Reactor(2.0).parameters] == [2.0, 1.0, 1.0]
    with pytest.raises(ModelError, match="no positive value"):
        Reactor(9.0)
    with pytest.raises(ModelError, match="reaction_rate = 0"):
        Reactor(reaction_rate=0)
    with pytest.raises(ModelError, match="choose 'angle' or 'speed'"):
        RotatingArm(measured="torque")
