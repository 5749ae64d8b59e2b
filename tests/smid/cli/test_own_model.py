"""Every command with a model file of two inputs and two outputs, and its mistakes in one line."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

import smid as package

MODEL = """
class = "OwnModel"
equations = [
    "w[t] = a*w[t-1] + b*pump[t-1]",
    "v[t] = c*v[t-1] + d*w[t-1] + e*heater[t-1]",
]
inputs = ["pump", "heater"]
outputs = { level = "w", temperature = "v" }

[parameters]
a = 0.6
b = [0, 5]
c = [0, 1]
d = 0.8
e = [-2, 2]
"""
TRUE = {"a": 0.6, "b": 1.0, "c": 0.5, "d": 0.8, "e": -0.7}
BOUNDS = {"level": 0.05, "temperature": 0.1}
NAMED = "--noise-bound level=0.05,temperature=0.1"


@pytest.fixture(autouse=True)
def _tank(folder):  # noqa: ARG001  (the working folder)
    Path("tank.toml").write_text(MODEL, encoding="utf-8")
    write_tank("tank.csv", seed=1, count=12)
    write_tank("tank2.csv", seed=2, count=120)
    write_tank("biased.csv", seed=3, count=160, bias=2.0)


def write_tank(path, seed, count, bias=0.0):
    random = np.random.default_rng(seed)
    pump, heater = random.choice([-1.0, 1.0], (2, count))
    w, v = np.zeros((2, count))
    for k in range(1, count):
        w[k] = TRUE["a"] * w[k - 1] + TRUE["b"] * pump[k - 1]
        v[k] = TRUE["c"] * v[k - 1] + TRUE["d"] * w[k - 1] + TRUE["e"] * heater[k - 1]
    level = w + bias + random.uniform(-1, 1, count) * BOUNDS["level"]
    temperature = v + random.uniform(-1, 1, count) * BOUNDS["temperature"]
    columns = np.column_stack([np.arange(count), pump, heater, level, temperature])
    header = "time [s],pump [V],heater [kW],level [m],temperature [K]"
    np.savetxt(path, columns, "%.6f", ",", header=header, comments="")


def test_identify_does_what_python_does_and_its_result_serves_all_commands(smid):
    result = smid(f"identify tank.csv --model tank.toml {NAMED} --json est.json")
    assert result.exit_code == 0, result.output
    estimate = json.loads(Path("est.json").read_text())["estimate"]
    assert estimate["noise_bound"] == BOUNDS
    data = package.Dataset.from_file("tank.csv", ["pump", "heater"], ["level", "temperature"])
    in_python = package.identify(package.load_model("tank.toml"), data, BOUNDS)
    for interval in estimate["parameters"]:
        assert interval["lower"] <= TRUE[interval["name"]] <= interval["upper"]
        assert interval["lower"] == pytest.approx(in_python[interval["name"]].lower, abs=1e-6)

    # The order of the columns does not matter.
    result = smid(
        "validate est.json tank2.csv --output temperature --output level --input heater --input pump --json v"
    )
    assert result.exit_code == 0, result.output
    (run,) = json.loads(Path("v").read_text())["validations"]
    assert {score["channel"]: score["noise_bound"] for score in run["scores"]} == BOUNDS
    assert all(score["fit_percent"] > 80 for score in run["scores"])
    shutil.copy("est.json", "copy.json")
    for line in ("compare est.json copy.json tank2.csv", "residuals est.json tank2.csv --report page.md"):
        result = smid(line)
        assert result.exit_code == 0, result.output
        assert "level" in result.stdout
        assert "temperature" in result.stdout


BUILT_IN = """
class = "OutputError"
input = ["pump", "heater"]
output = ["level", "temperature"]
na = [1, 2]
nb = [[0, 0], [0, 1]]
delay = [[1, 1], [2, 1]]
stable = true
[bounds]
b0_temperature_pump = [-5, 5]
b0_temperature_heater = [-5, 5]
b1_temperature_heater = [-5, 5]
[fixed]
b0_level_heater = 0
"""


def test_a_built_in_model_states_the_same_plant(smid):
    # The level heats the second tank, so the temperature has the poles of both.
    Path("built_in.toml").write_text(BUILT_IN, encoding="utf-8")
    write_tank("tank3.csv", seed=3, count=30)
    result = smid(f"identify tank3.csv --model built_in.toml {NAMED} --json est.json")
    assert result.exit_code == 0, result.output
    estimate = json.loads(Path("est.json").read_text())["estimate"]
    assert estimate["noise_bound"] == BOUNDS
    a, b, c, d, e = TRUE.values()
    truth = {"a1_level": -a, "b0_level_pump": b, "a1_temperature": -a - c, "a2_temperature": a * c}
    truth |= {"b0_temperature_pump": d * b, "b0_temperature_heater": e, "b1_temperature_heater": -a * e}
    assert truth.keys() == {interval["name"] for interval in estimate["parameters"]}
    for interval in estimate["parameters"]:
        assert interval["lower"] <= truth[interval["name"]] <= interval["upper"]


def test_the_least_bound_of_one_output_lies_below_the_noise(smid):
    result = smid("error-bound tank.csv --model tank.toml --noise-bound temperature=0.1 --json least.json")
    assert result.exit_code == 0, result.output
    least = json.loads(Path("least.json").read_text())["error_bound"]
    assert least["channel"] == "level"
    assert 0 < least["lower"] <= BOUNDS["level"]
    used = smid("identify tank.csv --model tank.toml --noise-bound level=1.2x,temperature=0.1")
    assert used.exit_code == 0, used.output
    assert "noise bound used: 1.2 x" in used.stdout


def test_a_diagnosis_saves_the_extended_model(smid):
    line = f"diagnose biased.csv --model tank.toml {NAMED} --effects sensor_bias,input_delay --workers 1 --no-certify"
    result = smid(f"{line} --save-model extended.toml")
    assert result.exit_code == 0, result.output
    assert "Cause: sensor_bias" in result.stdout
    extended = package.load_model("extended.toml")
    assert "sensor_bias" in extended.origins.values()
    assert any(abs(value - 2.0) < 0.1 for name, value in extended.values.items() if name in extended.origins)
    again = smid("identify biased.csv --model extended.toml --noise-bound 0.2 --stop 24")
    assert again.exit_code == 0, again.output


def test_units_are_checked_before_any_work(smid):
    Path("cm.toml").write_text(MODEL + '[units]\nlevel = "cm"\n', encoding="utf-8")
    Path("sum.toml").write_text(MODEL.replace("d*w[t-1]", "w[t-1]"), encoding="utf-8")
    for model, words in {
        "cm": "'level' is in m in the data, and in cm in the model",
        "sum": "units: v[t] = c*v[t - 1] + e*heater[t - 1] + w[t - 1] has K on the left and m on the right",
    }.items():
        for command in ("identify", "error-bound", "diagnose"):
            result = smid(f"{command} tank.csv --model {model}.toml --noise-bound temperature=0.1,level=0.1")
            assert result.exit_code == 2
            assert words in result.stderr
            assert len(result.stderr.strip().splitlines()) == 1


MISTAKES = {
    "identify tank.csv --model tank.toml": "at most one of them a factor",
    f"identify tank.csv --model tank.toml {NAMED} --input pump --input heater --input level": "level",
    "identify tank.csv --model tank.toml --noise-bound level=0.1": "gives no bound of 'temperature': write",
    "identify tank.csv --model tank.toml --noise-bound level=0.1,0.2": "'0.2' names no channel",
    "identify tank.csv --model tank.toml --noise-bound level=0.1,levle=0.2": "'levle' is none of level, temperature",
    "identify tank.csv --model tank.toml --noise-bound level=0.1,level=0.2": "two bounds of 'level'",
    "identify tank.csv --model model.toml --input pump --input heater --output level": "not have the channel 'pump'",
    "identify tank.csv --model model.toml --input pump --input heater --output level --noise-bound 1": (
        'state all inputs in the model, as in input = ["pump", "heater"]'
    ),
    "identify run.csv --model model.toml --input u --output y --output u": "'u'",
    "identify run.csv --model tank.toml --noise-bound 0.1": "no column 'pump'",
    "identify run.csv --input u --output y --model tank.toml --noise-bound 0.1": "needs the channel 'pump'",
    "error-bound tank.csv --model tank.toml": "one output, not of level, temperature: write --noise-bound temperature=",
    "error-bound run.csv --model model.toml --noise-bound y=0.1": "leave out --noise-bound",
    "error-bound tank.csv --model tank.toml --noise-bound level=1.2x": "is a factor: give a number",
    "diagnose tank.csv --model tank.toml --noise-bound level=0.1": "gives no bound of 'temperature'",
    "diagnose tank2.csv --model tank.toml --save-model none/m.toml": "there is no folder none",
    "diagnose run.csv --simulated y": "Missing option '--input'",
}


@pytest.mark.parametrize("line", MISTAKES)
def test_mistakes_are_told_in_one_line(smid, line):
    result = smid(line)
    assert result.exit_code == 2, (result.output, result.exception)
    assert len(result.stderr.strip().splitlines()) == 1
    assert MISTAKES[line] in result.stderr
