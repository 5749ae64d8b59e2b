import json
import signal
import subprocess
import sys
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from smid.cli import loading
from smid.cli.console import INTERRUPTED, Progress
from smid.data.read_file import read_file
from smid.diagnosis import EFFECTS
from smid.diagnosis.diagnosis import ENDED_EARLY
from smid.reports import schemas

FEW = "--effects input_dead_zone,input_delay,missing_input --workers 1"
COMMON = "dead.csv --input u --output y --model model.toml"


@pytest.fixture(autouse=True)
def _records(folder):
    """Beside the record of the other commands, one of the same plant behind a dead zone of 0.4 V."""
    random = np.random.default_rng(0)
    u = np.repeat(random.uniform(-1, 1, 36), 10)
    v = np.sign(u) * np.maximum(np.abs(u) - 0.4, 0)
    w = np.zeros(u.size)
    for k in range(1, u.size):
        w[k] = 0.7 * w[k - 1] + 0.5 * v[k - 1]
    y, junk = w + random.uniform(-0.02, 0.02, u.size), random.uniform(size=u.size)
    rows = [f"{0.1 * k:.1f},{u[k]:.6f},{y[k]:.6f},{junk[k]:.4f}" for k in range(u.size)]
    (folder / "dead.csv").write_text("\n".join(["# SIMULATED", "time [s],u [V],y [bar],oil temp [degC]", *rows]) + "\n")


def written(name="out.json"):
    return json.loads(Path(name).read_text(encoding="utf-8"))


def test_a_cause_is_named_and_both_files_are_written(smid):
    result = smid(f"diagnose {COMMON} {FEW} --noise-bound 0.02 --json out.json --report out.html")
    assert result.exit_code == 0, result.output
    assert "Cause: input_dead_zone." in result.stdout
    assert "Proven: no parameters of the base model explain" in result.stdout
    assert result.stderr == "", "quiet in a pipe"
    document = written()
    jsonschema.validate(document, schemas()["smid.diagnose/1"])
    assert document["verdict"] == "named"
    assert set(document["gain"]) == {
        f"{name}_{when}"
        for name in ("rmse", "fit_percent", "noise_bound", "violations")
        for when in ("before", "after")
    }
    (cause,) = document["causes"]
    assert cause["effect"] == "input_dead_zone"
    (threshold,) = cause["parameters"].values()
    assert threshold["lower"] <= 0.4 <= threshold["upper"]
    assert threshold["null"] == 0
    assert {rival["effect"] for rival in cause["rivals"]} == {"input_delay"}
    assert document["data"]["source"] == "dead.csv (SIMULATED)"
    page = Path("out.html").read_text(encoding="utf-8")
    assert "Diagnosis of y: input dead zone" in page
    assert "simulated data, not measured" in page


def test_nothing_named_is_no_failure(smid):
    result = smid(f"diagnose {COMMON} --effects input_delay --workers 1 --no-certify --json out.json")
    assert result.exit_code == 0, result.output
    document = written()
    jsonschema.validate(document, schemas()["smid.diagnose/1"])
    assert (document["verdict"], document["causes"], document["proof"]) == ("none", [], None)
    assert document["gain"]["violations_before"] is None
    assert document["gain"]["rmse_before"] == document["gain"]["rmse_after"]


def test_json_to_standard_output_comes_alone(smid):
    result = smid(f"diagnose {COMMON} --effects input_delay --workers 1 --json -")
    assert json.loads(result.stdout)["verdict"] == "none"


def test_only_the_channels_that_were_named_are_considered(smid):
    line = f"diagnose {COMMON} --effects missing_input --workers 1 --json out.json"
    assert smid(line).exit_code == 0
    assert written()["skipped"] == {"missing_input": "a further measured channel that moves"}
    result = smid(f"{line} --channel oil_temp")
    assert result.exit_code == 0, result.output
    assert written()["skipped"] == {}


def test_the_effects_are_listed(smid):
    result = smid("diagnose --list-effects")
    assert result.exit_code == 0
    assert [line.split()[0] for line in result.stdout.splitlines()] == [effect.name for effect in EFFECTS]


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (f"{COMMON} --effects input_deadzone", ["input_deadzone", "input_dead_zone"]),
        (f"{COMMON} --effects ,", ["at least one"]),
        (f"{COMMON} --noise-bound 0", ["--noise-bound"]),
        (f"{COMMON} --test 0.99", ["--test"]),
        (f"{COMMON} --stop 50", ["too short", "longer record"]),
        (f"{COMMON} --channel junk", ["no column 'junk'"]),
        (f"{COMMON} --workers 0", ["--workers"]),
        (f"{COMMON} --report missing/r.html", ["there is no folder missing"]),
        ("dead.csv --input u --output y", ["--model"]),
    ],
)
def test_bad_input_is_told_in_one_line(smid, monkeypatch, line, words):
    def fit(*_arguments, **_options):
        raise AssertionError("fitted before the mistake was told")

    # The package's name for this module is the function in it.
    monkeypatch.setattr(sys.modules["smid.diagnosis.diagnose"], "fitted_base", fit)
    result = smid(f"diagnose {line}")
    assert result.exit_code == 2, (result.output, result.exception)
    assert result.stdout == ""
    assert result.stderr.startswith("error: ")
    assert result.stderr.count("\n") == 1
    for word in words:
        assert word in result.stderr


@pytest.fixture
def _ctrl_c_at_the_first_cause(monkeypatch):
    def interrupt(_self, line):
        if line.startswith("best so far: "):
            raise KeyboardInterrupt

    monkeypatch.setattr(Progress, "__call__", interrupt)


@pytest.mark.usefixtures("_ctrl_c_at_the_first_cause")
def test_interrupted_in_the_search_keeps_what_was_found(smid):
    result = smid(f"diagnose {COMMON} {FEW} --no-certify --json out.json --report out.html")
    assert result.exit_code == 130
    assert ENDED_EARLY in result.stdout
    assert "Cause: input_dead_zone." in result.stdout
    document = written()
    assert document["interrupted"]
    assert document["causes"][0]["effect"] == "input_dead_zone"
    assert ENDED_EARLY in Path("out.html").read_text(encoding="utf-8")


@pytest.mark.usefixtures("_ctrl_c_at_the_first_cause")
def test_a_program_that_reads_the_json_is_told_of_the_interrupt_too(smid):
    result = smid(f"diagnose {COMMON} {FEW} --no-certify --json -")
    assert json.loads(result.stdout)["interrupted"]
    assert ENDED_EARLY in result.stderr


def test_sigterm_keeps_what_was_found_as_ctrl_c_does():
    effects = "--effects input_dead_zone,input_delay,input_curve,input_saturation,extra_lag,hysteresis"
    line = f"diagnose {COMMON} {effects} --workers 1 --no-certify --verbose --json out.json".split()
    with subprocess.Popen(
        [sys.executable, "-m", "smid", *line], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert any("best so far: " in logged for logged in process.stderr), "it ended before it could be stopped"
        process.send_signal(signal.SIGTERM)
        said, _ = process.communicate(timeout=60)
    assert process.returncode == INTERRUPTED
    assert ENDED_EARLY in said
    document = written()
    assert document["interrupted"]
    assert document["causes"]


def test_progress_in_a_file_is_a_line_now_and_then(monkeypatch, capsys):
    now = iter((0.0, 1.0, 16.0, 20.0, 40.0))
    monkeypatch.setattr("smid.cli.console.time.monotonic", lambda: next(now))
    with Progress() as progress:
        for line in ("first", "second", "third", "fourth"):
            progress(line)
    assert capsys.readouterr().err == "after 16 s: second\nafter 40 s: fourth\n"


def test_a_proof_that_fails_costs_only_the_proof(smid):
    """Two samples are too few for an interval."""
    result = smid(f"diagnose {COMMON} {FEW} --noise-bound 0.02 --no-certify --prove 2 --json out.json")
    assert result.exit_code == 0, result.output
    assert "the intervals were not certified" in result.stderr
    assert written()["causes"][0]["effect"] == "input_dead_zone"


def test_interrupted_before_the_search_there_is_no_result(smid, monkeypatch):
    def interrupt(*_arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr(Progress, "__call__", interrupt)
    result = smid(f"diagnose {COMMON} {FEW}")
    assert result.exit_code == 130
    assert "there is no result yet" in result.stderr


def test_a_pipe_is_quiet():
    line = f"diagnose {COMMON} --effects input_delay,extra_lag --workers 2".split()
    done = subprocess.run([sys.executable, "-m", "smid", *line], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    assert "\x1b" not in done.stdout


def test_the_record_is_read_once(smid, monkeypatch):
    read = []
    monkeypatch.setattr(loading, "read_file", lambda *given: read.append(given) or read_file(*given))
    result = smid(f"diagnose {COMMON} --effects sensor_drift --workers 1 --no-certify")
    assert "Columns that were not read: oil_temp" in result.stdout
    assert len(read) == 1


def test_nothing_is_proven_without_a_noise_bound(smid):
    result = smid(f"diagnose {COMMON} --prove 40")
    assert result.exit_code == 2
    assert "--prove needs a noise bound" in result.stderr
    result = smid(f"diagnose {COMMON} --prove-name 20")
    assert result.exit_code == 2
    assert "--prove-name needs a noise bound" in result.stderr
    result = smid(f"diagnose {COMMON} --noise-bound 0.02 --certificates proofs")
    assert result.exit_code == 2
    assert "--certificates needs a proof" in result.stderr


def test_the_name_is_proven_on_demand(smid):
    few = FEW.replace("input_delay", "gain")  # a proof on a delay takes its whole time limit
    proof = "--prove-name 5 --certificates proofs"
    result = smid(f"diagnose {COMMON} {few} --noise-bound 0.02 --no-certify {proof} --json out.json")
    assert result.exit_code == 0, result.output
    assert "Proof of the name on samples" in result.stdout
    document = written()
    assert document["name_proof"]["base"]["certificate"] == str(Path("proofs", "base.json"))
    assert smid(f"verify {Path('proofs', 'base.json')} {COMMON.split()[0]}").exit_code == 0
    assert document["name_proof"]["base"]["status"] == "excluded"
    assert document["proof"]["first"] == document["name_proof"]["base"]["first"]


def test_ctrl_c_in_the_proof_of_the_name_keeps_the_diagnosis(smid, monkeypatch):
    def interrupt(*_arguments, **_settings):
        raise KeyboardInterrupt

    monkeypatch.setattr("smid.cli.diagnose.prove_name", interrupt)
    result = smid(f"diagnose {COMMON} {FEW} --noise-bound 0.02 --no-certify --prove-name 20 --json out.json")
    assert result.exit_code == 0, result.output
    assert "the name was not proven: interrupted" in result.stderr
    assert written()["causes"][0]["effect"] == "input_dead_zone"


def test_intervals_are_proven_on_demand(smid):
    Path("model.toml").write_text('class = "OutputError"\nstable = true\n', encoding="utf-8")
    line = f"diagnose {COMMON} --effects input_dead_zone --noise-bound 0.02 --no-certify --prove 40 --json out.json"
    result = smid(f"{line} --workers 1")
    assert result.exit_code == 0, result.output
    (threshold,) = written()["causes"][0]["parameters"].values()
    assert threshold["proven"]
    assert threshold["lower"] <= 0.4 <= threshold["upper"]


def simulated_record() -> None:
    """Write a record whose sensor has a bias, beside what a simulator gave."""
    random = np.random.default_rng(0)
    u = np.repeat(random.uniform(-1, 1, 30), 10)
    w = np.zeros(u.size)
    for k in range(1, u.size):
        w[k] = 0.7 * w[k - 1] + 0.5 * u[k - 1]
    y = w + 0.3 + random.uniform(-0.02, 0.02, u.size)
    rows = [f"{0.1 * k:.1f},{u[k]:.6f},{y[k]:.6f},{w[k]:.6f}" for k in range(u.size)]
    Path("beside.csv").write_text("\n".join(["time [s],u [V],y [bar],Simulink out [bar]", *rows]) + "\n")


def test_a_recorded_simulation_takes_the_place_of_the_model(smid):
    simulated_record()
    columns = "beside.csv --input u --output y --simulated Simulink_out"
    result = smid(f"diagnose {columns} --effects sensor_bias,missing_input --workers 1 --json out.json")
    assert result.exit_code == 0, result.output
    assert "Cause: sensor_bias." in result.stdout
    document = written()
    jsonschema.validate(document, schemas()["smid.diagnose/1"])
    assert "simulation" in document["base"]["origins"].values()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("", "give --model TOML, or --simulated COL"),
        ("--model model.toml --simulated Simulink_out", "give --model TOML, or --simulated COL"),
        ("--simulated Simulink_out --prove 30 --noise-bound 0.02", "--prove needs a model"),
        ("--simulated Simscape_out", "no column 'Simscape_out'"),
    ],
)
def test_a_recorded_simulation_is_asked_for_in_one_way(smid, options, words):
    simulated_record()
    result = smid(f"diagnose beside.csv --input u --output y {options}")
    assert result.exit_code == 2
    assert words in result.stderr
