"""Bad input of a diagnosis: the message names cause and cure, before long work, and no name is given."""

import sys

import numpy as np
import pytest
from click.testing import CliRunner

from smid import DataError, Dataset, ModelError, OutputError, Parameter
from smid.cli import main
from smid.diagnosis import EFFECTS, diagnose
from smid.diagnosis.parts import STARTING
from smid.models import Line, Measurement, Model
from smid.models.symbols import signal, t
from tests.smid.diagnosis.lag_records import BOUND, LAG, autoregressive, dead_zone, lag, record, steps

U = steps(0, 200)
GOOD = record(U, lag(U))
TWO_INPUTS = Dataset.from_arrays(input={"u": U, "v": U}, output={"y": U}, sampling_time=0.1)
HELD = np.full(200, 20.0)
HEATED = LAG.add_term("w", 0.1 * signal("heat")[t])
LATE = np.where(np.arange(200) < 170, 0.5, U)
TWO_RUNS = Dataset.merge([record(U, lag(U), name="a"), record(U[:40], lag(U)[:40], 1, name="b")])
BIAS = ["sensor_bias"]


def ask(model=LAG, data=GOOD, noise_bound=None, effects=BIAS, test=0.2, **options):
    return diagnose(model, data, noise_bound, effects, test, **({"workers": 1, "certify": False} | options))


@pytest.fixture
def unfitted(monkeypatch):
    """Make sure that the mistake is told before anything is fitted."""

    def fit(*_arguments, **_options):
        raise AssertionError("fitted before the mistake was told")

    monkeypatch.setattr(sys.modules["smid.diagnosis.diagnose"], "fitted_base", fit)


@pytest.mark.usefixtures("unfitted")
@pytest.mark.parametrize(
    ("given", "error", "words"),
    [
        ({"effects": ["input_deadzone"]}, ModelError, ["'input_deadzone' is unknown", "input_dead_zone"]),
        ({"effects": "sensor_bias"}, ModelError, ["sensor_bias", "list"]),
        ({"effects": []}, ModelError, ["at least one"]),
        ({"effects": ["sensor_bias", "sensor_bias"]}, ModelError, ["once"]),
        ({"noise_bound": 0.0}, ModelError, ["noise bound of 'y' is 0.0", "positive"]),
        ({"noise_bound": -0.1}, ModelError, ["noise bound of 'y' is -0.1", "positive"]),
        ({"noise_bound": float("nan")}, ModelError, ["noise bound of 'y' is nan"]),
        ({"noise_bound": {"z": 0.1}}, ModelError, ["noise bound of 'z'", "name one of them"]),
        ({"noise_bound": {}}, ModelError, ["no noise bound for y"]),
        ({"test": 0.01}, DataError, ["test = 0.01", "between 0.05 and 0.9"]),
        ({"test": 1.0}, DataError, ["test = 1.0", "between 0.05 and 0.9"]),
        ({"test": float("nan")}, DataError, ["between 0.05 and 0.9"]),
        ({"test": 0.1}, DataError, ["test part needs 30 samples and has 20", "share in test", "longer record"]),
        ({"test": 0.85}, DataError, ["fits and the choice need 60 samples and have 30", "share in test"]),
        (
            {"data": record(U[:50], lag(U)[:50])},
            DataError,
            ["need 60 samples and have 40", "needs 30 samples and has 10"],
        ),
        ({"test": ["monday"]}, DataError, ["test experiment 'monday' is unknown", "run"]),
        ({"test": "monday"}, DataError, ["test experiment 'monday' is unknown", "run"]),
        ({"test": ["run"]}, DataError, ["test names every experiment", "leave one"]),
        ({"data": TWO_RUNS, "test": ["a", "b"]}, DataError, ["test names every experiment", "leave one"]),
        (
            {"data": TWO_RUNS, "test": ["b"]},
            DataError,
            ["test part needs 30 samples and has 0", "first 50", "do not count"],
        ),
        ({"test": []}, DataError, ["test part needs 30 samples and has 0"]),
        ({"workers": 0}, ModelError, ["workers = 0", "at least 1"]),
        ({"workers": -2}, ModelError, ["workers = -2", "at least 1"]),
        ({"model": OutputError(input="flow"), "data": TWO_INPUTS}, DataError, ["'flow'", "u, v, y"]),
        ({"data": record(np.full(200, 2.0), lag(U))}, DataError, ["'u' does not excite", "2", "moves"]),
        (
            {"data": record(U, lag(U), heat=HELD), "model": HEATED},
            DataError,
            ["'heat' does not excite", "20", "leave it out"],
        ),
        ({"data": record(LATE, lag(U))}, DataError, ["'u' does not excite", "before the test part"]),
        ({"data": record(U, HELD, bound=0.0)}, DataError, ["output 'y' is constant", "20", "check the sensor"]),
        ({"data": record(U[:3], lag(U)[:3])}, DataError, ["3 samples", "longer record"]),
    ],
)
def test_a_mistake_is_told_with_its_cure(given, error, words):
    with pytest.raises(error) as caught:
        ask(**given)
    for word in words:
        assert word in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.usefixtures("unfitted")
def test_a_second_input_that_is_not_there_is_not_taken_for_the_first():
    with pytest.raises(DataError, match="needs the channel 'flow'"):
        ask(LAG.add_term("w", 0.1 * signal("flow")[t]))


def test_a_record_without_measured_samples_is_refused_when_it_is_made():
    with pytest.raises(
        DataError, match="every sample of 'y' is missing in experiment 'experiment'; leave one of them out"
    ):
        Dataset.from_arrays(input={"u": U}, output={"y": np.nan * U}, sampling_time=0.1)


def decay(noise: str | None = "eta") -> Model:
    """A model without an input."""
    w, a = signal("w"), Parameter("a", 0.1, 0.99)
    return Model("decay", (a,), (Line(w[t], a.symbol * w[t - 1]),), (Measurement("y", "w", noise),))


@pytest.mark.usefixtures("unfitted")
@pytest.mark.parametrize("noise_bound", [None, BOUND])
def test_a_model_without_an_input_is_refused(noise_bound):
    with pytest.raises(ModelError, match="needs a model with an input and an output"):
        ask(decay(), noise_bound=noise_bound)


@pytest.mark.usefixtures("unfitted")
@pytest.mark.parametrize("noise_bound", [None, BOUND])
def test_a_model_without_an_output_is_refused(noise_bound):
    w, x, a = signal("w"), signal("x"), Parameter("a", 0.1, 0.99)
    blind = Model("blind", (a,), (Line(w[t], a.symbol * w[t - 1] + x[t - 1]),), (Measurement("u", "x", "zeta"),))
    with pytest.raises(ModelError, match="needs a model with an input and an output"):
        ask(blind, noise_bound=noise_bound)


@pytest.mark.usefixtures("unfitted")
def test_a_noise_bound_for_an_exact_output_is_refused():
    w, u, a = signal("w"), signal("u"), Parameter("a", 0.1, 0.99)
    exact = Model("exact", (a,), (Line(w[t], a.symbol * w[t - 1] + u[t - 1]),), (Measurement("y", "w", None),))
    with pytest.raises(ModelError, match="takes no output 'y' as noisy"):
        ask(exact, noise_bound=BOUND)


def test_a_base_model_that_runs_away_is_refused():
    with pytest.raises(DataError, match=r"cannot be simulated on these data.*Bound its parameters"):
        ask(OutputError(fixed={"a1": -3.0}))


def test_a_base_model_that_runs_away_on_the_test_part_is_refused():
    """The square is harmless while the input is small, and grows without end once it is not."""
    w, u, b = signal("w"), signal("u"), Parameter("b", 0.5, 2.0)
    bent = Model(
        "bent",
        (b,),
        (Line(w[t], 0.5 * w[t - 1] + w[t - 1] ** 2 + b.symbol * u[t - 1]),),
        (Measurement("y", "w", "eta"),),
    )
    u_ = np.where(np.arange(200) < 165, 0.05, 1.0) * U
    with pytest.raises(DataError, match="free run of experiment 'run' is not finite; the model is unstable"):
        ask(bent, record(u_, lag(u_, 0.5)))


def test_what_cannot_be_tried_is_listed_with_what_it_needs():
    needing = [e for e in EFFECTS if e.name in ("missing_input", "scheduled_parameter")]
    diagnosis = ask(effects=["missing_input", "scheduled_parameter", "sensor_bias"])
    assert diagnosis.verdict == "none"
    assert dict(diagnosis.skipped) == {e.name: e.needs for e in needing}
    assert all(e.needs for e in needing)
    assert diagnosis.to_dict()["skipped"] == dict(diagnosis.skipped)


def test_with_nothing_to_try_nothing_is_named():
    u = steps(1, 300)
    diagnosis = ask(data=record(u, lag(dead_zone(u, 0.4))), effects=["missing_input"])
    assert (diagnosis.verdict, diagnosis.causes) == ("none", ())
    assert set(diagnosis.skipped) == {"missing_input"}
    assert diagnosis.unexplained


def test_a_channel_that_stands_still_drives_nothing():
    diagnosis = ask(data=record(U, lag(U), heat=np.full(200, 20.0)), effects=["missing_input"])
    assert set(diagnosis.skipped) == {"missing_input"}


def test_experiments_may_be_kept_for_the_test_by_name():
    runs = []
    for seed, name in enumerate(("monday", "tuesday", "friday")):
        u = steps(seed, 120)
        runs.append(record(u, lag(u) + 0.4, seed, name=name))
    diagnosis = ask(data=Dataset.merge(runs), test=["tuesday"])
    assert [int(mask.sum()) for mask in diagnosis.test] == [0, diagnosis.data.experiments[1].n_samples - STARTING, 0]
    assert diagnosis.gain.samples == 120 - STARTING
    assert [c.effect for c in diagnosis.causes] == ["sensor_bias"]


@pytest.mark.parametrize("seed", range(3))
def test_a_record_of_noise_names_nothing(seed):
    """Output and input have nothing to do with each other."""
    random = np.random.default_rng(seed)
    data = record(steps(seed, 200), autoregressive(random, 200, 0.7), seed)
    diagnosis = ask(data=data, effects=["input_dead_zone", "input_delay", "sensor_bias"])
    assert diagnosis.verdict == "none"


@pytest.mark.parametrize(
    ("fields", "held_input", "words"),
    [
        ("fixed = {a1 = -3.0}", False, ["cannot be simulated on these data", "Bound its parameters"]),
        ("", True, ["'u' does not excite", "moves"]),
    ],
)
def test_on_the_command_line_it_is_one_line_and_exit_code_2(tmp_path, monkeypatch, fields, held_input, words):
    monkeypatch.chdir(tmp_path)
    u = np.full(200, 0.5) if held_input else U
    rows = [f"{0.1 * k:.1f},{u[k]:.6f},{y:.6f}" for k, y in enumerate(lag(U))]
    (tmp_path / "run.csv").write_text("\n".join(["time [s],u [V],y [bar]", *rows]) + "\n")
    (tmp_path / "model.toml").write_text(f'class = "OutputError"\n{fields}\n')
    line = "diagnose run.csv --input u --output y --model model.toml --effects sensor_bias --workers 1"
    result = CliRunner().invoke(main, line.split(), prog_name="smid")
    assert result.exit_code == 2, (result.output, result.exception)
    assert result.stdout == ""
    assert result.stderr.startswith("error: ")
    assert result.stderr.count("\n") == 1
    for word in words:
        assert word in result.stderr


def test_what_was_tried_is_not_listed_as_skipped():
    """On clean data the search ends before it tries anything; on others it may keep the best few only."""
    clean = ask(effects=["missing_input", "sensor_bias", "input_delay", "input_dead_zone"])
    u = steps(1, 300)
    bent = ask(data=record(u, lag(dead_zone(u, 0.4))), noise_bound=0.05, effects=None)
    assert set(clean.skipped) == {"missing_input"}
    assert bent.verdict == "named"
    assert not {"input_delay", "sensor_bias", "hysteresis", "output_curve"} & set(bent.skipped)
