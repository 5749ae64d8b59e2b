"""A data column may have any name, also one that a model uses for a signal, a noise or a parameter."""

import contextlib
import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import smid
from smid.cli import main
from smid.fitting.binding import bind
from smid.fitting.fit import fit
from smid.models import (
    ErrorsInVariables,
    Hammerstein,
    Model,
    ModelError,
    OutputError,
    Reactor,
    RotatingArm,
    Wiener,
    simulate,
)

BUILDERS = {
    "Hammerstein": lambda **names: Hammerstein(powers=(1, 3), **names),
    "noisy Hammerstein": lambda **names: Hammerstein(powers=(1, 3), input_noise=True, **names),
    "Wiener": lambda **names: Wiener(inverse_powers=(3,), **names),
    "OutputError": OutputError,
    "ErrorsInVariables": ErrorsInVariables,
    "Reactor": lambda **names: Reactor(sampling_time=0.1, **names),
    "RotatingArm": lambda **names: RotatingArm(drag=True, sampling_time=0.01, **names),
}
COLUMNS = [
    ("v", "w"),
    ("x", "v"),
    ("w", "x"),
    ("eta", "zeta"),
    ("y", "z"),
    ("w", "u"),
    ("a1", "b0"),
    ("alpha", "gamma1"),
    ("tau", "a"),
    ("theta", "c"),
    ("angle", "speed"),
    ("u_true", "s3"),
    ("w2", "w"),
]


def values(model: Model) -> dict[str, float]:
    return {
        p.name: p.lower if p.lower == p.upper else {"tau": 2.0, "x": 1.0}.get(p.name, 0.1) for p in model.parameters
    }


@pytest.mark.parametrize("columns", COLUMNS, ids=" and ".join)
@pytest.mark.parametrize("name", BUILDERS)
def test_a_model_runs_the_same_whatever_its_columns_are_called(name: str, columns: tuple[str, str]) -> None:
    build, (first, second) = BUILDERS[name], columns
    plain, u = build(), np.abs(np.sin(np.arange(40.0)))
    expected = simulate(plain, {"u": u}, values(plain))["y"]
    data = smid.Dataset.from_arrays(
        input={first: u},
        output={second: expected},
        sampling_time=plain.sampling_time or 1.0,
    )
    for model in (build(input=first, output=second), bind(plain, data)):
        assert model.channels == (first, second)
        assert [p.name for p in model.parameters] == [p.name for p in plain.parameters]
        np.testing.assert_allclose(simulate(model, {first: u}, values(model))[second], expected, rtol=1e-9)
        assert Model.from_dict(json.loads(json.dumps(model.to_dict()))) == model
        assert len(str(model).splitlines()) <= len(str(plain).splitlines()) + 1


def test_equations_stay_as_they_are_where_no_name_clashes() -> None:
    assert str(Hammerstein(powers=(3,), input="current", output="pressure")).splitlines()[1:5] == [
        "  v[t] = current[t]",
        "  x[t] = gamma1*v[t]**3",
        "  w[t] = -alpha*w[t - 1] + (alpha + 1)*x[t - 1]",
        "  pressure[t] = w[t] + eta[t]",
    ]


def test_equations_are_numbered_where_a_name_clashes() -> None:
    assert str(Hammerstein(powers=(3,), input="v", output="w")).splitlines()[1:5] == [
        "  v2[t] = v[t]",
        "  x[t] = gamma1*v2[t]**3",
        "  w2[t] = -alpha*w2[t - 1] + (alpha + 1)*x[t - 1]",
        "  w[t] = w2[t] + eta[t]",
    ]


def test_roles_decide_where_the_data_call_the_input_y_and_the_output_u() -> None:
    data = smid.Dataset.from_arrays(input={"y": [0.0, 1, 1, 0]}, output={"u": [0.0, 0, 1, 1.5]}, sampling_time=1.0)
    assert (bind(OutputError(), data).input_channels, bind(OutputError(), data).output_channels) == (("y",), ("u",))


def test_one_column_for_input_and_output_is_refused() -> None:
    with pytest.raises(ModelError, match="'w' stands for 2 channels"):
        OutputError(input="w", output="w")


@pytest.mark.parametrize("columns", [("w", "b0"), ("a1", "eta"), ("b0", "w")], ids=" and ".join)
def test_intervals_are_the_same_whatever_the_columns_are_called(columns: tuple[str, str]) -> None:
    rng = np.random.default_rng(0)
    u = rng.uniform(-1, 1, 30)
    y = simulate(OutputError(), {"u": u}, {"a1": -0.5, "b0": 1.0})["y"] + rng.uniform(-0.05, 0.05, 30)

    def found(first: str, second: str) -> smid.Estimate:
        data = smid.Dataset.from_arrays(input={first: u}, output={second: y}, sampling_time=1.0)
        return smid.identify(OutputError(stable=True), data, 0.05)

    plain, renamed = found("u", "y"), found(*columns)
    for interval in plain.intervals:
        other = renamed[interval.name]
        assert (other.lower, other.upper) == pytest.approx((interval.lower, interval.upper), abs=1e-6)


@pytest.mark.parametrize("further", ["v", "x", "w", "eta", "zeta", "u_true", "a1", "alpha", "u", "y"])
@pytest.mark.parametrize("name", ["OutputError", "Hammerstein", "noisy Hammerstein", "ErrorsInVariables", "Reactor"])
def test_a_further_column_changes_nothing_whatever_it_is_called(name: str, further: str) -> None:
    rng = np.random.default_rng(0)
    u = rng.uniform(-1, 1, 40)
    y = simulate(OutputError(), {"u": u}, {"a1": -0.6, "b0": 0.4})["y"] + rng.uniform(-0.05, 0.05, 40)
    plain = smid.Dataset.from_arrays(input={"current": u}, output={"pressure": y}, sampling_time=0.1)
    more = smid.Dataset.from_arrays(
        input={"current": u}, output={"pressure": y}, sampling_time=0.1, **{further: rng.uniform(-1, 1, 40)}
    )
    costs = [fit(bind(BUILDERS[name](), data), data, starts=2).cost for data in (plain, more)]
    assert costs[0] == costs[1]


@pytest.mark.parametrize("columns", ["v w", "x v", "w x", "y u"])
def test_the_command_takes_columns_named_as_signals_of_the_model(columns: str, tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    u = rng.uniform(-1, 1, 30)
    y = simulate(OutputError(), {"u": u}, {"a1": -0.5, "b0": 1.0})["y"] + rng.uniform(-0.05, 0.05, 30)
    first, second = columns.split()
    names = [first, second, *({"v", "w", "x", "u", "y"} - {first, second})]
    table = np.column_stack([u, y, rng.uniform(-1, 1, (30, 3))])
    np.savetxt(tmp_path / "run.csv", table, delimiter=",", header=",".join(names), comments="")
    (tmp_path / "model.toml").write_text('class = "Hammerstein"\npowers = [1]\nstable = true\n')
    arguments = ["identify", "run.csv", "--input", first, "--output", second, "--sampling-time", "0.1"]
    arguments += ["--model", "model.toml", "--noise-bound", "0.05", "--json", "out.json"]
    with contextlib.chdir(tmp_path):
        told = CliRunner().invoke(main, arguments)
        assert told.exit_code == 0, told.output
        found = json.loads(Path("out.json").read_text())["estimate"]["parameters"]
    ends = {p["name"]: (p["lower"], p["upper"]) for p in found}
    assert ends["alpha"][0] < -0.5 < ends["alpha"][1]
    assert ends["gamma1"][0] < 2.0 < ends["gamma1"][1]
