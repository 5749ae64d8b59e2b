"""The foreign plants obey their laws, and know nothing of the sensors."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import smid.theses.clutch.plants as package
from smid.data.bundled import load_clutch
from smid.models import ModelError
from smid.theses.clutch.plant import NOISE_BOUND
from smid.theses.clutch.plants import PLANTS, plant_records
from smid.theses.clutch.plants.backlash import GAP, backlash
from smid.theses.clutch.plants.bouc_wen import LIMIT, SHARE, bouc_wen
from smid.theses.clutch.plants.lugre import lugre
from smid.theses.clutch.plants.piston import Piston
from smid.theses.clutch.plants.preisach import preisach
from smid.theses.clutch.plants.warm_friction import warm_friction
from smid.theses.clutch.position import POSITION_NOISE_BOUND

FOREIGN = sorted(set(PLANTS) - {"Dahl"})
INTERVAL = 1e-4
ZIGZAG = np.concatenate([np.linspace(a, b, 4000) for a, b in ((0, 30), (30, 12), (12, 24), (24, 0))])


def test_no_plant_uses_a_sensor():
    for file in Path(package.__file__).parent.glob("*.py"):
        assert "smid.sensors" not in file.read_text(encoding="utf-8")


@pytest.mark.parametrize("name", FOREIGN)
@pytest.mark.parametrize("temperature", [-20.0, 20.0, 60.0])
def test_a_position_is_held_rises_and_lags_when_falling(name, temperature):
    plant = PLANTS[name]
    assert np.ptp(plant(np.zeros(200), temperature, INTERVAL)) == 0
    x = plant(ZIGZAG, temperature, INTERVAL)
    assert x.min() >= 0
    assert 8 < x[:4000].max() < 10
    rising, falling = (
        np.interp(13.0, *branch) for branch in ((ZIGZAG[:4000], x[:4000]), (ZIGZAG[7999:4000:-1], x[7999:4000:-1]))
    )
    assert falling > rising + 0.02


@pytest.mark.parametrize("name", FOREIGN)
def test_a_finer_simulation_says_the_same(name):
    times = np.arange(ZIGZAG.size)
    finer = np.interp(np.arange(3 * (ZIGZAG.size - 1) + 1) / 3, times, ZIGZAG)
    coarse, fine = PLANTS[name](ZIGZAG, 20.0, INTERVAL), PLANTS[name](finer, 20.0, INTERVAL / 3)[::3]
    # Where LuGre friction lets go, the instant depends on the step; the RMS is below that of the sensor's noise.
    assert np.sqrt(np.mean((coarse - fine) ** 2)) < 0.02


@pytest.mark.parametrize("temperature", [-20.0, 20.0, 60.0])
def test_the_piston_comes_to_rest_where_its_spring_holds_the_pressure(temperature):
    piston = Piston(temperature)
    for pressure in (1.0, 6.0, 20.0, 36.0):
        x = piston.moved(np.append(0.0, np.full(20000, pressure)), INTERVAL)[-1]
        assert x == pytest.approx(piston.at_rest(pressure), abs=1e-6)
        assert piston.load(x) == pytest.approx(max(pressure, piston.load(0.0)), abs=1e-6)


def test_bouc_wen_solves_its_equation():
    beta, gamma = SHARE / LIMIT**2, (1 - SHARE) / LIMIT**2
    force, direction = [0.0], np.sign(np.diff([0, 3.0, 1.5, 2.5, 0.2]))
    for d, way in zip(direction, np.abs(np.diff([0, 3.0, 1.5, 2.5, 0.2])), strict=True):
        run = solve_ivp(lambda _, f, d=d: d - beta * abs(f) * f - gamma * d * f**2, (0, way), force[-1:], rtol=1e-10)
        force.append(run.y[0, -1])
    path = np.array([0, 3.0, 1.5, 2.5, 0.2])
    np.testing.assert_allclose(path - bouc_wen(path), force, atol=2e-3)


def test_friction_that_does_not_depend_on_speed():
    slower = np.interp(np.arange(0, ZIGZAG.size - 1, 0.5), np.arange(ZIGZAG.size), ZIGZAG)
    for operator in (preisach, lambda p: warm_friction(p, 0.0)):
        np.testing.assert_allclose(operator(slower)[::2], operator(ZIGZAG)[:-1], atol=1e-9)


def test_preisach_closes_inner_loops_and_widens_with_the_level():
    path = np.array([0.0, 30.0, 20.0, 25.0, 20.0, 30.0])
    q = preisach(path)
    assert q[2] == q[4]
    assert q[1] == q[5]
    full = np.concatenate([np.linspace(0, 41, 2001), np.linspace(41, 0, 2001)])
    q = preisach(full)
    widths = [np.interp(x, q[:2001], full[:2001]) - np.interp(x, q[:2000:-1], full[:2000:-1]) for x in (5.0, 30.0)]
    assert widths[1] > 2 * widths[0]


def test_warm_friction_falls_with_temperature():
    widths = [30.0 - warm_friction(np.array([0.0, 30.0]), t)[1] for t in (-20.0, 20.0, 60.0)]
    assert widths == sorted(widths, reverse=True)
    assert widths[0] > 3 * widths[2]


def test_lugre_meets_less_friction_at_speed():
    def loop(n):
        up = np.linspace(0.0, 30.0, n)
        x = lugre(Piston(20.0), np.concatenate([up, up[::-1]]), INTERVAL)
        return np.interp(5.0, x[:n], up) - np.interp(5.0, x[: n - 1 : -1], up)

    assert loop(30000) > 1.4 * loop(3000)


def test_backlash_is_a_gap():
    piston = np.concatenate([np.linspace(0, 4, 20000), np.linspace(4, 1, 20000)])
    x = backlash(piston, INTERVAL)
    assert x[19999] == pytest.approx(4 - GAP, abs=0.02)
    assert x[-1] == pytest.approx(1 + GAP, abs=0.02)
    assert np.ptp(x[20200:22000]) < 1e-3


def test_records_have_the_currents_of_the_bundled_ones():
    one = plant_records("rate", names=("60C_step_a",))
    same = plant_records("rate", names=("20C_step_a", "60C_step_a"))
    run, bundled = one.experiments[0], load_clutch("60C_step_a").experiments[0]
    np.testing.assert_array_equal(run.values["current"], bundled.values["current"])
    np.testing.assert_array_equal(run.values["position"], same.experiments[1].values["position"])
    # Both pressures are that of the same plant, but for noise and the resampling of the steps.
    difference = np.abs(run.values["pressure"] - bundled.values["pressure"])
    assert np.quantile(difference, 0.95) < 2 * NOISE_BOUND
    at_rest = run.values["position"][:40]
    assert np.abs(at_rest).max() <= POSITION_NOISE_BOUND
    with pytest.raises(ModelError, match="no plant 'Dall'"):
        plant_records("Dall")
