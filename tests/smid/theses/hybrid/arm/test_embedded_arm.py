"""The embedded arm and its estimators: derivatives, starts, alternation, surfaces, studies."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from smid.data import DataError
from smid.hybrid import cost_surface
from smid.models import ModelError
from smid.networks import TanhNetwork, nguyen_widrow
from smid.signals import TABLE_F1
from smid.theses.hybrid.arm import (
    ARM,
    TABLE_F2_START,
    InputError,
    Motion,
    alternate,
    embedded_arm,
    embedded_error,
    embedded_study,
    estimate_white,
    friction_curve,
    global_start,
    held_record,
    input_error_runs,
    modulate_motion,
    multistart_start,
    other_kind,
    quiet_filter,
    random_start,
    run_embedded,
    shape_of,
    slower,
    thesis_record,
    true_friction,
    white_free_run,
)
from smid.theses.hybrid.arm.figures import trace_figure
from smid.theses.hybrid.arm.traces import examples

SINE = TABLE_F1["one_sine"]


def _numbers(seed, hidden=2):
    weights = nguyen_widrow((1, hidden), seed).weights
    return np.append(1.2, weights)


def test_the_derivatives_of_the_free_run_are_those_of_differences():
    problem = embedded_error(embedded_arm((2,)), held_record(SINE))
    theta = _numbers(3)
    system = problem.normal_equations(theta)
    for k in range(theta.size):
        step = np.zeros(theta.size)
        step[k] = 1e-6
        slope = (problem.error(theta + step) - problem.error(theta - step)) / 2e-6
        assert 2.0 * system.gradient[k] == pytest.approx(slope, rel=2e-3, abs=1e-4 * system.error)


def test_many_points_at_once_have_the_errors_of_each():
    problem = embedded_error(embedded_arm((2,)), held_record(SINE))
    points = np.array([_numbers(seed) for seed in range(3)])
    np.testing.assert_allclose(problem.errors(points), [problem.error(point) for point in points], rtol=1e-9)


def test_training_in_lockstep_finds_what_training_alone_does():
    """25 starts at once, in one loop through time, beside SciPy's trust region and one start alone."""
    record = held_record(SINE)
    problem = embedded_error(embedded_arm((2,)), record)
    motion = modulate_motion(record)
    starts = np.array([multistart_start(motion, 2, starts=1, seed=seed) for seed in range(25)])
    found = problem.errors(problem.lower(starts, evaluations=60))
    for k in (0, 19):
        alone = problem.error(problem.lower(starts[k], evaluations=60))
        oracle = least_squares(
            lambda theta: problem.runs(theta[None]).residuals[0],
            starts[k],
            jac=lambda theta: problem.runs(theta[None]).jacobian(np.arange(1))[0],
            x_scale="jac",
            max_nfev=60,
        )
        error = 2.0 * oracle.cost / record.experiments[0].n_samples
        assert found[k] == pytest.approx(alone, rel=1e-3)
        assert found[k] <= 1.02 * error


def test_the_plants_own_friction_runs_like_the_plant():
    """A network that is the plant's friction, but for sticking, runs as near as the white model does."""
    record = held_record(SINE)
    truth = {name: ARM[name] for name in TABLE_F2_START}
    exact = white_free_run(truth, record)
    np.testing.assert_allclose(exact, record.experiments[0].values["y"], atol=1e-12)
    sampled = white_free_run(truth, record, "rk4")
    assert 1e-4 < np.sqrt(np.mean((sampled - exact) ** 2)) < 0.2


def test_the_derivatives_of_the_input_error_are_those_of_differences():
    problem = InputError(modulate_motion(held_record(SINE)), (2,))
    theta = _numbers(5)
    system = problem.normal_equations(theta)
    for k in range(theta.size):
        step = np.zeros(theta.size)
        step[k] = 1e-5
        slope = (problem.error(theta + step) - problem.error(theta - step)) / 2e-5
        assert 2.0 * system.gradient[k] == pytest.approx(slope, rel=1e-5, abs=1e-7)


def test_table_f2():
    """Euler's method errs as the thesis printed it; the exact motion finds all four, Ws too."""
    euler = estimate_white(thesis_record(SINE), "euler").values
    assert euler == pytest.approx({"theta": 22.85, "b": 0.0028, "Ws": 1.6, "Wd": 0.28}, rel=0.02)
    exact = estimate_white(held_record(SINE), "exact")
    assert exact.values == pytest.approx({name: ARM[name] for name in TABLE_F2_START}, rel=1e-6)
    assert exact.rmse < 1e-9


@pytest.mark.parametrize("start", [multistart_start, lambda *a, **k: global_start(*a, budget=3000, **k)])
def test_a_start_from_the_input_error_is_near_the_plant(start):
    record = held_record(TABLE_F1["six_unequal"])
    hybrid = embedded_arm((4,))
    theta = start(modulate_motion(record), 4, seed=2)
    problem = embedded_error(hybrid, record)
    assert 16.0 * theta[0] == pytest.approx(ARM["theta"], rel=0.005)
    assert problem.error(theta) < 1e-4 * np.var(record.experiments[0].values["y"])
    speed = record.experiments[0].values["speed"]
    curve = friction_curve(hybrid, problem.values(theta), speed) - true_friction(speed)
    assert np.sqrt(np.mean(curve**2)) < 0.02 * np.abs(true_friction(speed)).max()


def test_alternation_lowers_the_torques_error_and_finds_the_inertia():
    speed = np.linspace(-1.0, 1.0, 201) * 70
    acceleration = 300 * np.cos(np.arange(201.0))
    motion = Motion(speed, acceleration, acceleration / 21.0 + 8.0 * np.tanh(speed / 40.0))
    start = TanhNetwork((1, 2), nguyen_widrow((1, 2), 1).weights)
    few, many = (alternate(motion, start, rounds=rounds) for rounds in (2, 60))
    assert many.rmse < few.rmse
    assert many.reciprocal_inertia == pytest.approx(21.0, rel=1e-3)


def test_alternating_from_random_weights_as_the_thesis():
    from smid.theses.hybrid.arm import alternating_runs

    runs = alternating_runs([0, 3], rounds=200)
    assert ((runs.theta > 21.70) & (runs.theta < 21.78)).all()


def test_input_error_gives_the_three_shapes():
    runs = input_error_runs(range(12))
    assert {"right", "wrong", "too smooth"} <= set(runs.shapes)
    assert np.median(np.abs(runs.theta - ARM["theta"])) < 0.2


@pytest.mark.parametrize(("share", "shape"), [(1.0, "right"), (0.1, "too smooth"), (-1.0, "wrong"), (3.0, "too high")])
def test_shapes_are_told_by_their_jump(share, shape):
    assert shape_of(TanhNetwork((1, 1), np.array([1000.0, 0.0, share * 0.43 / 16.0, 0.0]))) == shape


def test_a_surface_is_the_error_at_each_of_its_points():
    hybrid = embedded_arm((1,))
    problem = embedded_error(hybrid, held_record(SINE))
    one, two = hybrid.term.parameters[0].name, hybrid.term.parameters[2].name
    values = {p.name: 0.0 for p in hybrid.term.parameters} | {"theta": ARM["theta"]}
    surface = cost_surface(problem, values, {one: [-2.0, 1.0, 3.0], two: [-1.0, 0.5]})
    point = values | {one: 1.0, two: 0.5}
    assert surface.rmse[1, 1] ** 2 == pytest.approx(problem.errors(problem.theta(point)[None])[0])
    # A neuron and its output weight may change their signs together.
    mirrored = cost_surface(problem, values, {one: [-3.0, -1.0, 2.0], two: [-0.5, 1.0]})
    np.testing.assert_allclose(mirrored.rmse, surface.rmse[::-1, ::-1], rtol=1e-9)


def test_good_moderate_and_bad_are_all_runs():
    study = embedded_study(["one_sine"], ["small"], starts=3)
    runs = study.runs[0]
    assert sum(runs.counts) == 3
    assert (runs.good == (runs.validation.max(axis=1) <= 0.01)).all()
    assert runs.white.max() < 1e-9
    assert "one_sine" in str(study)
    assert study.to_dict()["runs"][0]["counts"]["good"] == runs.counts[0]


@pytest.mark.parametrize("way", ["white", "certified"])
def test_what_is_known_of_the_arm_is_a_good_start(way):
    runs = run_embedded("six_two_negative", way, range(2), noise_bound=0.002, noise_seed=5)
    assert runs.counts == (2, 0, 0)
    assert runs.theta == pytest.approx(ARM["theta"], rel=0.005)


def test_no_law_is_needed_where_the_thesis_had_5_of_29():
    runs = run_embedded("one_sine", "global", [0])
    assert runs.counts == (1, 0, 0)
    assert runs.theta[0] == pytest.approx(ARM["theta"], rel=0.002)
    assert runs.curve[0] < 0.06


def test_candidates_are_judged_by_what_the_caller_says():
    """The least input error of this record diverges in free run."""
    record = held_record(TABLE_F1["eleven_equal"])
    problem, motion = embedded_error(embedded_arm((5,), scheme="rosenbrock"), record), modulate_motion(record)
    assert problem.error(multistart_start(motion, 5, seed=0)) == np.inf
    assert problem.error(multistart_start(motion, 5, judge=problem.errors, seed=0)) < 0.1**2


def test_short_steps_learn_from_an_arm_that_sticks():
    """With one implicit step a sample, 13 of 20 starts are not good."""
    runs = run_embedded("six_equal", "stepped", [0])
    assert runs.counts == (1, 0, 0)
    assert runs.validation.max() < 0.001


def test_examples_are_the_runs_that_were_counted():
    study = embedded_study(["one_sine"], ["global", "small"], starts=1)
    found = examples(study, "one_sine")
    assert [label.split(":")[0] for label in found] == ["good", "bad"]
    for trace, runs in zip(found.values(), study.runs, strict=True):
        _, plant, model = trace.motions["another kind"]
        error = np.sqrt(np.mean((model - plant) ** 2)) / np.ptp(plant)
        assert error == pytest.approx(runs.validation[0, 1], rel=1e-6)
    good = found["good: ours, no law: global search"]
    np.testing.assert_allclose(good.network, true_friction(good.speed), atol=1.0)
    assert trace_figure(found).axes[-1].lines


@pytest.mark.parametrize("sines", TABLE_F1.values(), ids=TABLE_F1)
def test_a_linearly_implicit_scheme_follows_sticking(sines):
    """RK4 at the same step errs by 3.6 rad under six equal sines, where the arm sticks."""
    record = held_record(sines)
    truth = {name: ARM[name] for name in TABLE_F2_START}
    error = white_free_run(truth, record, "rosenbrock") - record.experiments[0].values["y"]
    assert np.sqrt(np.mean(error**2)) < 0.0015 * np.ptp(record.experiments[0].values["y"])


def test_records_are_what_they_say():
    held = held_record(SINE, noise_bound=0.01, seed=1)
    error = held.experiments[0].values["y"] - held_record(SINE).experiments[0].values["y"]
    assert 0.005 < np.abs(error).max() <= 0.01
    coarse, fine = thesis_record(SINE).experiments[0].values, held.experiments[0].values
    assert np.abs(coarse["u"] - fine["u"]).max() < 1e-12
    assert 0.05 < np.abs(coarse["y"] - fine["y"]).max() < 2.0  # what Euler and the held input make
    assert thesis_record(SINE, noise_bound=0.01, seed=1).experiments[0].values["y"] != pytest.approx(coarse["y"])


@pytest.mark.parametrize("sines", TABLE_F1.values(), ids=TABLE_F1)
def test_validation_stays_within_the_speeds_of_the_record(sines):
    seen = held_record(sines).experiments[0].values["speed"]
    for u in (slower(sines), other_kind(sines)):
        checked = held_record(u).experiments[0].values["speed"]
        assert seen.min() <= checked.min() + ARM["eps"]
        assert checked.max() <= seen.max()
        assert np.ptp(checked) > 0.3 * np.ptp(seen)


def test_the_filter_is_as_wide_as_the_noise_asks_for():
    bound, still = 0.5, np.zeros(4000)
    noise = np.random.default_rng(1).uniform(-bound, bound, still.size)
    chosen = quiet_filter(bound, 0.02)
    assert 2.0 < np.std(chosen.derivative(still + noise, 0.02, 2)) < 5.0


def test_says_what_is_wrong():
    record = held_record(SINE)
    hybrid = embedded_arm((1,))
    problem = embedded_error(hybrid, record)
    motion = modulate_motion(record)
    with pytest.raises(DataError, match="a seed"):
        held_record(SINE, noise_bound=0.1)
    with pytest.raises(ModelError, match="unknown integration"):
        estimate_white(record, "ode23")
    with pytest.raises(ModelError, match="positive start"):
        estimate_white(record, start={"theta": 16.0})
    with pytest.raises(ModelError, match="give two of"):
        cost_surface(problem, {}, {"theta": [1.0, 2.0]})
    with pytest.raises(ModelError, match="no value for"):
        cost_surface(problem, {}, {"theta": [1.0, 2.0], "N_b1_1": [0.0]})
    with pytest.raises(ModelError, match="at least"):
        global_start(motion, 3, budget=10, seed=1)
    with pytest.raises(ModelError, match="a start or more"):
        multistart_start(motion, 3, starts=0, seed=1)
    with pytest.raises(DataError, match="at rest"):
        global_start(Motion(np.zeros(50), np.zeros(50), np.zeros(50)), 3, seed=1)
    with pytest.raises(ModelError, match="unknown way"):
        run_embedded("one_sine", "random_", [1])
    assert random_start(hybrid, 1.0, 1).shape == (5,)
