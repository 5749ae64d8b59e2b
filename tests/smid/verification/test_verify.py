"""Certificates tied to their origin: accepted for their model and data, refused after any one change."""

import copy
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from benchmarks.records import errors_in_variables, hammerstein, output_error
from benchmarks.soundness.piecewise_problems import piecewise_problem
from relaxations import check
from smid import (
    DataError,
    Dataset,
    EmptyFeasibleSetError,
    Hammerstein,
    ModelError,
    NotProvenError,
    OutputError,
    Reactor,
    Wiener,
    identify,
    verify,
)
from smid.cli import main


def record_of(u: Any, y: Any) -> Dataset:
    return Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=0.5)


def second_order() -> tuple[Any, Dataset, float]:
    rng = np.random.default_rng(3)
    u = np.round(rng.uniform(-1, 1, 12), 2)
    y = np.zeros(12)
    for k in range(2, 12):
        y[k] = 1.1 * y[k - 1] - 0.3 * y[k - 2] + 0.4 * u[k - 1]
    model = OutputError(2, stable=True, dc_gain=(0.5, 4.0), bounds={"b0": (0, 2)})
    return model, record_of(u, y + 0.01 * np.sign(u)), 0.02


def wiener() -> tuple[Any, Dataset, float]:
    rng = np.random.default_rng(4)
    u = np.round(rng.uniform(-1, 1, 8), 2)
    x = np.zeros(8)
    for k in range(1, 8):
        x[k] = 0.5 * x[k - 1] + 0.6 * u[k - 1]
    y = np.round(x - 0.2 * x**3, 3)
    bounds = {"alpha": (-0.9, 0), "beta": (0.1, 1), "s3": (0, 0.6)}
    model = Wiener(inverse_powers=[3], output_range=(-1, 1), bounds=bounds)
    return model, record_of(u, y), 0.05


def tank() -> tuple[Any, Dataset, float]:
    rng = np.random.default_rng(5)
    u, w = np.round(rng.uniform(0, 1, 14), 2), np.zeros(14)
    for k in range(1, 14):
        w[k] = w[k - 1] + 0.5 * ((1 / 2.0 - 0.12) * u[k - 1] - w[k - 1] / 2.0)
    return Reactor(tau=2.0, a=None, scheme="euler").bound(a=(0, 3)), record_of(u, w), 0.02


def two_runs() -> tuple[Any, Dataset, float]:
    known = output_error(10)
    u, y = known.data.values(known.data.inputs[0]), known.data.values(known.data.outputs[0])
    runs = [
        Dataset.from_arrays(input={"u": u[:6]}, output={"y": y[:6]}, sampling_time=1.0, name="first run"),
        Dataset.from_arrays(input={"u": u[5:]}, output={"y": y[5:]}, sampling_time=1.0, name="second"),
    ]
    return OutputError(stable=True), Dataset.merge(runs), 0.2


def with_a_zero() -> tuple[Any, Dataset, float]:
    rng = np.random.default_rng(6)
    u, w = np.round(rng.uniform(-1, 1, 16), 2), np.zeros(16)
    x = u + 0.5 * u**3
    for k in range(2, 16):
        w[k] = 0.6 * w[k - 1] + 0.3 * x[k - 1] + 0.1 * x[k - 2]
    return Hammerstein(1, (3, 1), 1, stable=True), record_of(u[1:], w[1:]), 0.02


def known(record: Any) -> tuple[Any, Dataset, Any]:
    return record.model, record.data, record.noise_bound


CASES = {
    "output error": lambda: known(output_error(12)),
    "Hammerstein, boxes by products": lambda: known(hammerstein(10)),
    "Hammerstein with a zero, boxes by products of two": with_a_zero,
    "errors in variables": lambda: known(errors_in_variables(6, poles=1)),
    "constraints of two poles": second_order,
    "a curved sensor": wiener,
    "a line in derivatives": tank,
    "two experiments": two_runs,
    "dead zone": lambda: known(piecewise_problem("two-sided dead zone", 4, 14, share=0.04)),
    "soft threshold": lambda: known(piecewise_problem("soft threshold", 4, 14, share=0.04)),
    "Coulomb": lambda: known(piecewise_problem("coulomb", 4, 14, share=0.3)),
}


QUICK = {"dead zone": {"order": 1}, "a curved sensor": {"rounds": 1}}
"""Wider intervals, proven by the same kinds of steps: the verification checks steps, not widths."""


@pytest.fixture(scope="module")
def proofs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[Any, Dataset, Any, Path]]:
    folder, made = tmp_path_factory.mktemp("proofs"), {}
    for name, make in CASES.items():
        model, data, bound = make()
        file = folder / f"{name}.json"
        settings: Any = QUICK.get(name, {})
        estimate = identify(model, data, bound, tolerance=0.2, certificate=file, **settings)
        made[name] = (model, data, bound, file)
        found = verify(file, data, model, bound)
        assert not found.empty
        for interval in estimate.intervals:
            assert found.intervals[interval.name] == (interval.lower, interval.upper), name
    return made


def test_a_proof_is_verified_against_its_model_and_data(proofs) -> None:
    model, data, bound, file = proofs["output error"]
    found = verify(file, data)
    text = str(found)
    assert "verified: the proof holds" in text
    assert "w[t] = " in text
    assert found.to_dict()["intervals"].keys() == {"a1", "b0"}
    assert found.equations == data.n_samples - 1
    assert verify(file, data, model, bound).intervals == found.intervals


def test_a_wrong_order_of_arguments_is_refused_with_the_right_one() -> None:
    model, data, _ = second_order()
    file = "proof.json"
    for wrong in ((model, data, file), (data, model, file), (data, file, model), (file, model, data), (data, file)):
        with pytest.raises(TypeError, match=r"give verify\(proof, data, model\): the file"):
            verify(*wrong)


def test_a_proof_that_nothing_fits_is_verified(tmp_path) -> None:
    record, file = output_error(12), tmp_path / "proof.json"
    bound = {c: 0.3 * b for c, b in record.noise_bound.items()}
    with pytest.raises(EmptyFeasibleSetError):
        identify(record.model, record.data, bound, certificate=file)
    found = verify(file, record.data, record.model, bound)
    assert found.empty
    assert "proven: no parameters explain the data" in str(found)


def test_a_proof_with_products_is_verified_where_the_input_begins_at_zero(tmp_path) -> None:
    u = [0.0, 0.0, 0.0, 1.0, 0.5, -0.5, 1.0, 0.25, -1.0, 0.75, 0.5, -0.25]
    w = [0.0]
    for past in u[:-1]:
        w.append(0.5 * w[-1] + 0.5 * past)
    data = record_of(u, w)
    model = Hammerstein(poles=1, powers=(1,), unit_dc_gain=True, stable=True)  # without bounds on gamma
    proof = tmp_path / "proof.json"
    identify(model, data, 0.01, certificate=proof)
    assert verify(proof, data, model, 0.01).equations > 0


def changed_sample(data: Dataset, rng: np.random.Generator) -> tuple[Dataset, str, int]:
    """Return the data with one sample changed by little."""
    channel = str(rng.choice(data.names))
    run = int(rng.integers(len(data.experiments)))
    k = int(rng.integers(data.experiments[run].n_samples))
    values = {c: data.experiments[run].values[c].copy() for c in data.names}
    values[channel][k] = np.nextafter(values[channel][k], np.inf) if rng.random() < 0.5 else values[channel][k] + 0.01
    inputs = {c: values[c] for c in data.inputs}
    outputs = {c: values[c] for c in data.outputs}
    return Dataset.from_arrays(input=inputs, output=outputs, sampling_time=data.sampling_time), channel, k


def test_another_datum_is_refused_and_named(proofs) -> None:
    rng = np.random.default_rng(0)
    for model, data, bound, file in proofs.values():
        if len(data.experiments) > 1:
            continue
        other, channel, k = changed_sample(data, rng)
        with pytest.raises(DataError, match=f"channel '{channel}' differs first at sample {k}"):
            verify(file, other, model, bound)


def test_another_model_or_noise_bound_is_refused_and_named(proofs) -> None:
    _, data, bound, file = proofs["output error"]
    (channel,) = bound
    with pytest.raises(ModelError, match=f"the noise bound of '{channel}' is"):
        verify(file, data, None, 1.0001 * bound[channel])
    with pytest.raises(ModelError, match="the parameter 'b0' of the model is not that of the proof"):
        verify(file, data, OutputError(stable=True, bounds={"b0": (0, 5)}))
    with pytest.raises(ModelError, match="the line 'w' of the model is not that of the proof"):
        verify(file, data, OutputError(stable=True, delay=2))
    with pytest.raises(ModelError, match=r"parameter '(alpha|a1)'"):
        verify(file, data, Hammerstein(stable=True))
    with pytest.raises(DataError, match="samples, the proof is about"):
        verify(file, data.crop(1, None), None)


def test_a_certificate_without_origin_is_refused(tmp_path, proofs) -> None:
    *_, data, _, file = proofs["output error"]
    content = json.loads(file.read_text())
    del content["origin"]
    (tmp_path / "bare.json").write_text(json.dumps(content))
    with pytest.raises(DataError, match="states no model and data"):
        verify(tmp_path / "bare.json", data)


# Each change falsifies what the file states about the model or the data; the proof itself may still hold.


def halve_a_noise_box(content: Any, rng: np.random.Generator) -> None:
    k = rng.choice([k for k, name in enumerate(content["variables"]) if "[" in name and name[:3] in ("eta", "zet")])
    content["box"][k] = [(0.5 * float.fromhex(end)).hex() for end in content["box"][k]]


def exchange_parameters(content: Any, rng: np.random.Generator) -> None:
    count = len(content["origin"]["model"]["parameters"])
    i, j = rng.choice(count, 2, replace=False)
    names = content["variables"]
    names[i], names[j] = names[j], names[i]


def rename_a_parameter(content: Any, rng: np.random.Generator) -> None:
    k = rng.integers(len(content["origin"]["model"]["parameters"]))
    content["variables"][k] += "_"


def narrow_a_prior(content: Any, rng: np.random.Generator) -> None:
    k = rng.integers(len(content["origin"]["model"]["parameters"]))
    low, high = content["box"][k]
    content["box"][k] = [low, "0x1.0p-3" if high is None or float.fromhex(high) > 0.125 else low]


def state_another_prior(content: Any, rng: np.random.Generator) -> None:
    parameters = content["origin"]["model"]["parameters"]
    name = str(rng.choice(list(parameters)))
    parameters[name] = ["-0x1.0p+9", "0x1.0p+9"]


def state_another_noise_bound(content: Any, rng: np.random.Generator) -> None:
    bounds = content["origin"]["noise_bounds"]
    name = str(rng.choice(list(bounds)))
    bounds[name] = (float.fromhex(bounds[name]) * 1.5).hex()


def state_another_line(content: Any, rng: np.random.Generator) -> None:
    lines = content["origin"]["model"]["lines"]
    name = str(rng.choice(list(lines)))
    lines[name] += str(rng.choice([" + 1/1024", f" + {next(iter(content['origin']['model']['parameters']))}"]))


def change_a_coefficient(content: Any, rng: np.random.Generator) -> None:
    row = content["equalities"][rng.integers(len(content["equalities"]))]
    term = row[rng.integers(len(row))]
    term[0] = (float.fromhex(term[0]) * (1 + 2.0**-20)).hex()


def add_a_row(content: Any, rng: np.random.Generator) -> None:
    k = int(rng.integers(len(content["origin"]["model"]["parameters"])))
    content["inequalities"].append([["0x1.0p+0", 0, [k]], ["0x1.0p+10", 0, []]])


def add_a_kink(content: Any, rng: np.random.Generator) -> None:
    names, argument = content["variables"], [["0x1.0p+0", 0, [int(rng.integers(len(content["variables"])))]]]
    kinks = content.setdefault("kinks", [])
    taken = {kink["variable"] for kink in kinks}
    if rng.random() < 0.5:  # a parameter that is said to be a kink
        free = [k for k in range(len(content["origin"]["model"]["parameters"])) if k not in taken]
        variable = int(rng.choice(free))
        argument[0][2] = [(variable + 1) % len(names)]
        if argument[0][2][0] in taken:
            argument[0][2] = []
    else:
        names.append("kink9[2]")
        content["box"].append(["0x0.0p+0", None])
        variable = len(names) - 1
        argument[0][2] = [0]
    kinks.append({"variable": variable, "kind": "positive part", "argument": argument})


CHANGES = (
    *(halve_a_noise_box, exchange_parameters, rename_a_parameter, narrow_a_prior, state_another_prior),
    *(state_another_noise_bound, state_another_line, change_a_coefficient, add_a_row, add_a_kink),
)


def test_no_changed_certificate_is_verified(tmp_path, proofs) -> None:
    rng = np.random.default_rng(28)
    file, cases = tmp_path / "changed.json", list(proofs.values())
    for k, change in enumerate(CHANGES):  # each meets half the proofs, and each proof half of them
        for j in range(len(cases) // 2):
            _, data, _, proof = cases[(k + j) % len(cases)]
            content = json.loads(proof.read_text())
            before = copy.deepcopy(content)
            change(content, rng)
            assert content != before
            file.write_text(json.dumps(content))
            with pytest.raises((NotProvenError, DataError, ModelError)):
                verify(file, data)


def test_the_command_verifies_and_refuses(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    record = output_error(12)
    u, y = record.data.values(record.data.inputs[0]), record.data.values(record.data.outputs[0])
    lines = ["current,pressure", *(f"{float(a)!r},{float(b)!r}" for a, b in zip(u, y, strict=True))]
    Path("run.csv").write_text("\n".join(lines) + "\n")
    Path("model.toml").write_text('class = "OutputError"\nstable = true\n')
    (bound,) = record.noise_bound.values()
    columns = ["--input", "current", "--output", "pressure", "--sampling-time", "0.5"]
    arguments = ["identify", "run.csv", *columns, "--model", "model.toml", "--noise-bound", str(bound)]
    assert CliRunner().invoke(main, [*arguments, "--certificate", "proof.json"]).exit_code == 0
    done = CliRunner().invoke(main, ["verify", "proof.json", "run.csv", "--model", "model.toml", "--json", "-"])
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout)["verification"]["intervals"].keys() == {"a1", "b0"}
    done = CliRunner().invoke(main, ["verify", "proof.json", "run.csv"])
    assert done.exit_code == 0
    assert "proven lower" in done.stdout

    content = json.loads(Path("proof.json").read_text())
    content["steps"][-1]["bound"] = "0x1.0p+9"
    Path("raised.json").write_text(json.dumps(content))
    done = CliRunner().invoke(main, ["verify", "raised.json", "run.csv"])
    assert (done.exit_code, done.stdout) == (1, "")
    assert done.stderr.startswith("refused: raised.json: step ")
    assert done.stderr.count("\n") == 1
    Path("other.csv").write_text("\n".join([*lines[:4], "9,9", *lines[5:]]) + "\n")
    for file, model, reason in (
        ("run.csv", 'class = "OutputError"\n', "the parameter 'a1' of the model is not that of the proof"),
        ("other.csv", 'class = "OutputError"\nstable = true\n', "channel 'current' differs first at sample 3"),
    ):
        Path("model.toml").write_text(model)
        done = CliRunner().invoke(main, ["verify", "proof.json", file, "--model", "model.toml"])
        assert done.exit_code == 2
        assert reason in done.stderr
    Path("broken.json").write_text("{")
    assert CliRunner().invoke(main, ["verify", "broken.json", "run.csv"]).exit_code == 2
    with pytest.raises(check.Unreadable):
        check.check(check.read("broken.json"))
