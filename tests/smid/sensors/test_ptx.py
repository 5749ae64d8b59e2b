"""The sensor with temperature and hysteresis: its parts obey their laws, its sensitivities are right, and it learns."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

from smid.data import DataError, Dataset
from smid.data.bundled import load_clutch
from smid.models import ModelError
from smid.networks import Scaling, TanhNetwork, weight_count
from smid.sensors import CPX, PTX, MedianFiltered, TrainedOn
from smid.sensors.lag import lag, lag_derivatives
from smid.sensors.play import play
from smid.sensors.ptx_dynamics import EFFECTS, Dynamics
from smid.sensors.ptx_error import STARTS, PTXError, Record
from smid.sensors.ptx_selection import choose_effects
from smid.theses.clutch import simulate_clutch, simulate_position
from smid.theses.clutch.sensor_study import HELD_OUT, interval_study

WALKS = st.lists(st.floats(-2, 2), min_size=1, max_size=80).map(np.cumsum)


@given(WALKS, st.floats(0.05, 3), st.floats(-2, 2))
def test_play_is_its_recursion(signal, threshold, before):
    h, expected = before, []
    for s in signal:
        h = max(s - threshold, min(s + threshold, h))
        expected.append(h)
    moved = play(signal, threshold, before)
    assert moved.position.tolist() == expected
    assert np.abs(signal - moved.position).max() <= threshold * (1 + 1e-12)
    touched = moved.side != 0
    # Where it was last pushed from, and from which side.
    np.testing.assert_array_equal(moved.position[touched], (signal[moved.contact] + threshold * moved.side)[touched])


@given(WALKS, st.floats(0.05, 3), st.integers(2, 7))
def test_play_does_not_depend_on_speed(signal, threshold, slower):
    times = np.arange(signal.size)
    finer = np.interp(np.arange((signal.size - 1) * slower + 1) / slower, times, signal)
    slow = play(finer, threshold, signal[0]).position[::slower]
    np.testing.assert_allclose(slow, play(signal, threshold, signal[0]).position, atol=1e-12)


def test_lag_is_a_filter():
    x = np.random.default_rng(1).normal(size=200)
    expected, _ = lfilter([0.3], [1, -0.7], x, zi=[0.7 * 2.0])
    np.testing.assert_allclose(lag(x, np.full(200, 0.7), 2.0), expected, atol=1e-12)


@given(st.integers(0, 10**6), st.integers(1, 60))
def test_lag_derivatives_solve_their_recursion(seed, n):
    generator = np.random.default_rng(seed)
    sources, decay = generator.normal(size=(3, n)), generator.uniform(0, 1, n)
    d, expected = np.zeros(3), []
    for t in range(n):
        d = decay[t] * d + sources[:, t]
        expected.append(d)
    np.testing.assert_allclose(lag_derivatives(sources, decay), np.array(expected).T, atol=1e-10)


@settings(max_examples=40, deadline=None)
@given(
    st.integers(0, 3),
    st.lists(st.integers(1, 4), min_size=1, max_size=2).map(tuple),
    st.sets(st.sampled_from(EFFECTS)),
    st.integers(0, 10**6),
)
def test_sensitivities_agree_with_finite_differences(plays, hidden, effects, seed):
    generator = np.random.default_rng(seed)
    sizes, n = (1, *hidden), 120
    pressure = np.cumsum(generator.normal(0, 2.0, n))
    temperature = 20 + 30 * np.sin(np.arange(n) / 20)
    record = Record(pressure, temperature, generator.normal(size=n), np.arange(n))
    named = tuple(effect for effect in EFFECTS if effect in effects)
    problem = PTXError(sizes, plays, (record,), Scaling(np.array([10.0]), np.array([15.0])), 20.0, 40.0, 0.002, named)
    thresholds, forces = generator.uniform(0.3, 3, plays), generator.uniform(0.1, 2, plays)
    further = np.concatenate([np.zeros(0), *(STARTS[effect] for effect in named)])
    further += generator.uniform(-0.5, 0.5, further.size)
    weights = generator.normal(size=weight_count(sizes))
    known = [np.log([0.003, 0.006]), [0.3, 0.2, -0.1]]
    theta = np.concatenate([*known, further, np.log(thresholds), np.log(forces), weights])
    position, jacobian = problem.sensitivities(theta, record)
    np.testing.assert_allclose(position, problem.positions(theta, record), atol=1e-10)
    np.testing.assert_allclose(problem.theta(problem.dynamics(theta), weights), theta, atol=1e-12)
    step = 1e-7
    for k, e in enumerate(step * np.eye(theta.size)):
        slope = (problem.positions(theta + e, record) - problem.positions(theta - e, record)) / (2 * step)
        # A play that begins to push between the two differences makes a kink there.
        assert np.mean(np.abs(jacobian[:, k] - slope) > 1e-5 * (1 + np.abs(slope))) < 0.02


def hysteretic(seed, temperatures=(-10.0, 40.0), n=1500, **effects):
    """Records of a PTX whose numbers are known."""
    generator = np.random.default_rng(seed)
    truth = PTX(
        hidden=(2,),
        plays=1,
        dynamics=Dynamics(0.002, 0.005, 0.01, 0.003, 0.01, (1.5,), (1.2,), 15.0, **effects),
        network=TanhNetwork((1, 2), np.array([0.2, -0.3, -1.5, 1.0, 2.0, -1.0, 2.0])),
    )
    runs = []
    for k, temperature in enumerate(temperatures):
        pressure = np.interp(np.arange(n), np.arange(0, n + 50, 50), generator.uniform(0, 20, n // 50 + 1))
        data = Dataset.from_arrays(
            input={"pressure": pressure},
            output={"position": np.zeros(n)},
            sampling_time=0.002,
            name=f"run{k}",
            temperature=np.full(n, temperature),
        )
        truth = replace(truth, trained_on=TrainedOn.of(data, ("pressure", "temperature"), "position"))
        position = truth.predict(data).position[0]
        run = data.experiments[0]
        runs.append(replace(run, values={**run.values, "position": position}))
    return truth, data.with_experiments(runs)


def test_what_made_the_records_is_found_again():
    _, data = hysteretic(1)
    found = PTX(hidden=(2,), plays=1).fit(data, seed=3, starts=3)
    _, fresh = hysteretic(2)
    assert max(found.predict(fresh).rmse(fresh).values()) < 2e-3
    assert found.dynamics.thresholds[0] == pytest.approx(1.5, rel=0.02)
    assert found.dynamics.forces[0] == pytest.approx(1.2, rel=0.02)
    assert found.dynamics.lag == pytest.approx(0.005, rel=0.05)
    assert found.dynamics.lag_slope == pytest.approx(0.01, rel=0.1)
    assert found.dynamics.gain_slope == pytest.approx(0.003, rel=0.1)
    assert found.dynamics.shift_slope == pytest.approx(0.01, rel=0.2)
    # Without a play the loop cannot be had.
    flat = PTX(hidden=(2,), plays=0).fit(data, seed=3, starts=1)
    assert min(flat.predict(fresh).rmse(fresh).values()) > 0.05


@pytest.mark.parametrize("effect", [{}, {"friction_slope": 0.02}, {"backlash": 0.3}])
def test_an_effect_is_kept_where_it_acts_and_only_there(effect):
    (_, training), (_, selection) = (hysteretic(seed, **effect) for seed in (1, 2))
    plain = PTX(hidden=(2,), plays=1).fit(training, seed=3, starts=1)
    found = choose_effects(plain, training, selection, effects=["temperature", "backlash"])
    wanted = {"friction_slope": ("temperature",), "backlash": ("backlash",)}
    assert found.sensor.effects == wanted.get(next(iter(effect), ""), ())
    kept = [error for name, error in found.tried if name in found.sensor.effects]
    assert found.chosen == min([found.plain, *kept])
    if "friction_slope" in effect:
        assert found.sensor.dynamics.friction_slope == pytest.approx(0.02, rel=0.1)
        assert found.chosen < 0.2 * found.plain
    if "backlash" in effect:
        assert found.sensor.dynamics.backlash == pytest.approx(0.3, rel=0.05)


def test_effects_that_do_not_exist_or_lack_their_channel():
    with pytest.raises(ModelError, match="no effect 'flov'"):
        PTX(effects=("flov",))
    with pytest.raises(ModelError, match="friction cannot depend on a temperature"):
        PTX(effects=("temperature",), temperature=None)
    with pytest.raises(ModelError, match="not trained"):
        PTX().extended(load_clutch("20C_step_a"), "flow", seed=1)


@pytest.fixture(scope="module")
def small():
    names = [f"{t}C_{kind}_a" for t in ("20", "60", "m20") for kind in ("ramp", "step")]
    return PTX(hidden=(3,), plays=1).fit(load_clutch(names).crop(800, 2800), seed=1, starts=2)


@pytest.mark.parametrize("held_out", ["20C_step_b", "60C_step_c", "m20C_step_c"])
def test_few_parameters_beat_a_cpx_of_the_temperature_on_sets_with_hysteresis(small, held_out):
    assert small.n_parameters == 17
    data = load_clutch(held_out)
    own = held_out.split("C_")[0]
    rival = CPX().fit(load_clutch([f"{own}C_ramp_a", f"{own}C_step_a"]), seed=1, starts=1)
    filtered = MedianFiltered(rival, 50)
    error = small.predict(data).rmse(data)[held_out]
    assert error < 0.9 * filtered.predict(data).rmse(data)[held_out]


def test_a_temperature_outside_the_range_is_answered_with_a_warning(small):
    data = load_clutch("60C_ramp_b").crop(0, 300)
    run = data.experiments[0]
    hot = data.with_experiments([replace(run, values={**run.values, "temperature": np.full(300, 75.0)})])
    said = small.predict(hot)
    assert np.isfinite(said.position[0]).all()
    assert said.warnings == (
        "60C_ramp_b: temperature 75 degC, but the sensor was trained from -20 to 60 degC: extrapolated",
    )
    assert small.predict(data).warnings == ()
    one = small.stream().update(0.0, pressure=1.0, temperature=-30.0)
    assert np.isfinite(one.position)
    assert "temperature -30 degC" in one.warnings[0]


@pytest.mark.parametrize("temperature", [0.0, 40.0])
def test_it_holds_between_the_temperatures_that_trained_it(small, temperature):
    # Advanced in steps of 0.1 ms, as the plant of the bundled records; that of 20 degC is the measure.
    generator = np.random.default_rng(5)
    levels = np.where(generator.random(12) < 0.2, 0.0, generator.uniform(300, 950, 12))
    current, errors = np.repeat(levels, 1500), []
    for degrees in (20.0, temperature):
        pressure = simulate_clutch(current, degrees, sampling_time=1e-4)
        position = simulate_position(pressure, degrees, sampling_time=1e-4)[::20]
        samples = {
            "pressure": pressure[::20] + generator.uniform(-0.3, 0.3, position.size),
            "temperature": np.full(position.size, degrees),
        }
        errors.append(np.sqrt(np.mean((small.evaluate(samples) - position) ** 2)))
    assert errors[1] < 1.3 * errors[0] < 0.15


def test_one_temperature_cannot_train_it():
    with pytest.raises(DataError, match=r"temperature \[degC\] is 20 in every sample"):
        PTX().fit(load_clutch("20C_step_a"), seed=1)


def test_no_start_cannot_train_it():
    with pytest.raises(ModelError, match="starts = 0: give a positive number"):
        PTX().fit(load_clutch(("20C_step_a", "60C_step_a")), seed=1, starts=0)


def test_the_temperature_may_vary_within_a_record(small):
    data = load_clutch("20C_step_b").crop(0, 400)
    run = data.experiments[0]
    warming = np.linspace(-20, 60, 400)
    varied = data.with_experiments([replace(run, values={**run.values, "temperature": warming})])
    said = small.predict(varied).position[0]
    cold, hot = (
        small.predict(data.with_experiments([replace(run, values={**run.values, "temperature": np.full(400, t)})]))
        for t in (-20.0, 60.0)
    )
    assert said[0] == cold.position[0][0]
    assert said[-1] == pytest.approx(hot.position[0][-1], abs=1e-2)


def test_wrong_plays():
    with pytest.raises(ModelError, match="plays = -1"):
        PTX(plays=-1)


def test_a_left_out_record_lies_inside_the_bound(small):
    study = interval_study(small)
    stated = [row for row in study.rows if row.margin == study.sensor.margin]
    assert [row.record for row in stated] == list(HELD_OUT)
    assert min(row.coverage for row in stated) >= 0.999
    assert max(row.mean_width for row in stated) < 1.5
