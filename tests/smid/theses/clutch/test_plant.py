"""The actuator reduces to the thesis's model, has what it claims, and is beyond every Hammerstein model."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.signal import lfilter

from smid.data import DataError
from smid.models import Hammerstein, simulate
from smid.theses.clutch import ClutchPlant, clutch_record, ramp_current, simulate_clutch, step_current
from smid.theses.clutch.plant import FAST, LAG, NOISE_BOUND

BARE = ClutchPlant(level=False, direction=False, hysteresis=False, temperature=False)
CENTRE = {"alpha": -0.65142, "gamma1": -0.00272, "gamma2": 0.03903, "gamma3": -0.08172}


def least_error(u, y):
    """The least RMS error of any model of one pole behind any polynomial of degree five, over a grid of poles."""
    best = np.inf
    for pole in np.linspace(0.3, 0.99, 140):
        columns = [lfilter([0, 1 - pole], [1, -pole], (0.01 * u) ** power) for power in (1, 2, 3, 4, 5)]
        regressors = np.stack([np.ones(len(u)), *columns], axis=1)
        coefficients = np.linalg.lstsq(regressors, y, rcond=None)[0]
        best = min(best, float(np.sqrt(np.mean((regressors @ coefficients - y) ** 2))))
    return best


def test_without_ingredients_it_is_the_model_of_the_thesis():
    u = np.maximum(ramp_current(), 260)
    w = simulate(Hammerstein(input_scale=0.01), {"u": u}, CENTRE)["y"]
    np.testing.assert_allclose(simulate_clutch(u, -20.0, BARE), w, rtol=1e-9, atol=1e-9)


def test_its_step_response_is_beyond_a_hammerstein_model():
    noise = NOISE_BOUND / np.sqrt(3)
    u = step_current()
    assert least_error(u, simulate_clutch(u, plant=BARE)) < 0.2 * noise
    full = simulate_clutch(u)
    assert least_error(u, full) > 2 * noise
    own = simulate(Hammerstein(input_scale=0.01), {"u": u}, CENTRE)["y"]
    assert np.abs(own - full).max() > 10 * NOISE_BOUND


@pytest.mark.parametrize("name", ["level", "direction", "hysteresis"])
def test_each_ingredient_alone_is_seen(name):
    for u in (ramp_current(), step_current()):
        alone = simulate_clutch(u, plant=replace(BARE, **{name: True}))
        assert np.abs(alone - simulate_clutch(u, plant=BARE)).max() > NOISE_BOUND


def settling(start, end, plant):
    """Samples until 63 % of a change of the pressure, after settling at the first level."""
    pressure = simulate_clutch(np.repeat([float(start), float(end)], 600), plant=plant)
    moved = (pressure[600:] - pressure[599]) / (pressure[-1] - pressure[599])
    return int(np.argmax(moved >= 1 - np.exp(-1)))


def test_the_pole_depends_on_level_and_direction():
    assert settling(400, 450, replace(BARE, level=True)) > 1.5 * settling(700, 750, replace(BARE, level=True))
    assert settling(600, 700, replace(BARE, direction=True)) > settling(700, 600, replace(BARE, direction=True))
    assert settling(600, 700, BARE) == settling(700, 600, BARE) == pytest.approx(FAST / 2e-3, abs=1.5)


def test_the_hysteresis_does_not_know_rates():
    plant = replace(BARE, hysteresis=True)
    corners = [0, 700, 300, 800, 500]
    ends = []
    for count in (40, 400):
        u = np.concatenate([np.linspace(a, b, count) for a, b in pairwise(corners)])
        ends.append(simulate_clutch(np.concatenate([u, np.full(300, u[-1])]), plant=plant)[-1])
    assert ends[0] == pytest.approx(ends[1], rel=1e-9)
    up, down = (simulate_clutch(np.r_[np.linspace(first, 600, 200), np.full(300, 600.0)], plant=plant)[-1]
                for first in (0, 900))  # fmt: skip
    curve = simulate_clutch(np.array([600 - LAG, 600 + LAG]).repeat(400), plant=BARE)
    assert up == pytest.approx(curve[399], rel=1e-6)
    assert down > up + NOISE_BOUND


def test_cold_is_slower_and_warm_leaks():
    plant = replace(BARE, temperature=True)
    u = np.repeat([0.0, 800.0], [1, 300])
    cold, mild, warm = (simulate_clutch(u, degrees, plant) for degrees in (-20, 20, 60))
    assert cold[4] < mild[4] < warm[4]
    np.testing.assert_allclose([cold[-1] / mild[-1], warm[-1] / mild[-1]], [1.02, 0.98], rtol=1e-6)


def test_records():
    data = clutch_record("step", seed=5, n=300)
    assert data.inputs == ("current",)
    assert data.outputs == ("pressure",)
    assert data.sampling_time == 2e-3
    assert [run.values["temperature"][0] for run in data.experiments] == [20, 60, -20]
    for run, degrees in zip(data.experiments, (20, 60, -20), strict=True):
        noise = run.values["pressure"] - simulate_clutch(run.values["current"], degrees)
        assert 0.28 < np.abs(noise).max() <= NOISE_BOUND
    assert clutch_record("step", seed=5, n=300).checksum == data.checksum
    assert clutch_record("step", seed=6, n=300).checksum != data.checksum
    assert clutch_record("ramp", (20.0,), seed=5, scale=0.5).values("current").max() == pytest.approx(450)


def test_mistakes_are_named():
    with pytest.raises(DataError, match="choose 'ramp' or 'step'"):
        clutch_record("sine", seed=1)
    with pytest.raises(DataError, match="noise_bound = -1"):
        clutch_record(seed=1, noise_bound=-1)
    with pytest.raises(DataError, match="series of finite samples, in mA"):
        simulate_clutch([np.nan])
