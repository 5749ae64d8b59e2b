"""Certificates of inversion: accepted for their model and data, refused after any one change."""

import copy
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy
from click.testing import CliRunner

from relaxations import check
from relaxations.check import runs
from smid import (
    DataError,
    Dataset,
    EmptyFeasibleSetError,
    Model,
    ModelError,
    NotProvenError,
    OwnModel,
    Parameter,
    identify,
    verify,
)
from smid.cli import main
from smid.identification.inversion import certificate
from smid.identification.inversion.contraction import Contraction
from smid.identification.inversion.cover import Cover
from smid.identification.inversion.record import Record
from smid.models import VALUE, Line, Measurement, signal, t

x, u = signal("x"), signal("u")
a, b = (sympy.Symbol(name, real=True) for name in "ab")
BOUND = 0.02
POLE = sympy.Max(a, sympy.Rational(1, 1000))
# Line, the same in numbers, the true start, boxes, and how far the input is shifted.
PLANTS = {
    "square-root tank": (
        x[t - 1] - a * sympy.sqrt(x[t - 1]) + b * u[t - 1],
        lambda x, u: x - 0.12 * np.sqrt(x) + 0.2 * u,
        ((0.02, 0.3), (0.05, 0.5)),
        (1.0, 0.0),
    ),
    "sine": (
        0.9 * x[t - 1] - a * sympy.sin(x[t - 1]) + b * u[t - 1],
        lambda x, u: 0.9 * x - 0.12 * np.sin(x) + 0.2 * u,
        ((0.02, 0.3), (0.05, 0.5)),
        (1.0, 0.5),
    ),
    "tanh friction": (
        x[t - 1] - a * sympy.tanh(5 * x[t - 1]) + b * u[t - 1],
        lambda x, u: x - 0.05 * np.tanh(5 * x) + 0.4 * u,
        ((0.0, 0.3), (0.1, 1.0)),
        (0.5, 0.5),
    ),
    "power": (
        0.8 * x[t - 1] + b * u[t - 1] ** a,
        lambda x, u: 0.8 * x + 0.4 * u**1.5,
        ((0.5, 3.0), (0.1, 1.0)),
        (0.5, 0.0),
    ),
    "dead zone": (
        0.7 * x[t - 1] + b * (sympy.Max(0, u[t - 1] - a) + sympy.Min(0, u[t - 1] + a)),
        lambda x, u: 0.7 * x + 0.9 * (max(0, u - 0.2) + min(0, u + 0.2)),
        ((0.0, 0.5), (0.1, 2.0)),
        (0.1, 0.5),
    ),
    "branches": (
        0.7 * x[t - 1] + sympy.Piecewise((b * u[t - 1], u[t - 1] > 0), (a * u[t - 1], True)),
        lambda x, u: 0.7 * x + (0.9 if u > 0 else 0.4) * u,
        ((0.0, 2.0), (0.0, 2.0)),
        (0.1, 0.5),
    ),
    # A lag with a pace that the input changes; as it is written, a pole of one divides by zero.
    "pace": (
        x[t - 1] + a * (u[t - 1] - x[t - 1]) * (1 - POLE ** sympy.exp(b * u[t - 1])) / (1 - POLE),
        lambda x, u: x + 0.4 * (u - x) * (1 - 0.4 ** np.exp(1.5 * u)) / 0.6,
        ((0.01, 1.1), (-3.0, 3.0)),
        (0.1, 0.5),
    ),
}
TRUTH = {
    "square-root tank": (0.12, 0.2),
    "sine": (0.12, 0.2),
    "tanh friction": (0.05, 0.4),
    "power": (1.5, 0.4),
    "dead zone": (0.2, 0.9),
    "branches": (0.4, 0.9),
    "pace": (0.4, 1.5),
}


def record(name: str, jump: float = 0.0) -> tuple[Model, Dataset]:
    """Return a model and a simulated record of 30 samples; with a jump of a sample no parameters fit."""
    expression, step, boxes, (start, shift) = PLANTS[name]
    rng = np.random.default_rng(1)
    inputs = rng.uniform(0, 1, 30) - shift
    states = [start]
    for k in range(1, 30):
        states.append(step(states[-1], inputs[k - 1]))
    measured = np.array(states) + rng.uniform(-BOUND, BOUND, 30)
    measured[15] += jump
    parameters = tuple(Parameter(own, *box) for own, box in zip("ab", boxes, strict=True))
    model = Model(name, parameters, (Line(x[t], expression),), (Measurement("y", "x", "eta"),))
    return model, Dataset.from_arrays(input={"u": inputs}, output={"y": measured}, sampling_time=1.0)


@pytest.fixture(scope="module")
def tank(tmp_path_factory) -> tuple[Any, Path]:
    """Return the content of a certificate with boxes that are cut, and its file."""
    model, data = record("square-root tank")
    file = tmp_path_factory.mktemp("proofs") / "tank.json"
    identify(model, data, BOUND, method="inversion", tolerance=0.005, certificate=file)
    content = check.read(file)
    assert any("cut" in box for box in content["boxes"])
    return content, file


@pytest.mark.parametrize("name", PLANTS)
def test_the_published_ends_are_proven_and_hold_the_truth(tmp_path, name: str) -> None:
    model, data = record(name)
    file = tmp_path / "proof.json"
    estimate = identify(model, data, BOUND, method="inversion", tolerance=0.05, certificate=file)
    claim = runs.check(check.read(file))
    found = verify(file, data, model, BOUND)
    assert found.equations == 29
    for interval, truth, prior in zip(estimate.intervals, TRUTH[name], model.parameters, strict=True):
        assert tuple(map(float, claim[interval.name])) == (interval.lower, interval.upper)
        assert found.intervals[interval.name] == (interval.lower, interval.upper)
        assert interval.lower <= truth <= interval.upper
        assert prior.lower < interval.lower < interval.upper < prior.upper


@pytest.mark.parametrize("name", PLANTS)
def test_an_empty_set_is_proven(tmp_path, name: str) -> None:
    model, data = record(name, jump=4 * BOUND)
    file = tmp_path / "proof.json"
    with pytest.raises(EmptyFeasibleSetError):
        identify(model, data, BOUND, method="inversion", certificate=file)
    assert runs.check(check.read(file)) is None
    assert verify(file, data, model).empty


def test_a_box_that_one_contraction_does_not_empty_is_halved(monkeypatch) -> None:
    monkeypatch.setattr(certificate, "_MOST", 1)
    model, data = record("power", jump=4 * BOUND)
    cover = Cover(Record(model, data, {"y": BOUND}), 0.05)
    cover.root.contractions.append(Contraction(cover.root.lower, cover.root.upper, None, (), empty=True))
    claim, content = certificate.run_certificate(cover, {"y": BOUND}, print)
    assert claim is None
    assert len(content["boxes"]) > 1
    assert runs.check(content) is None


def test_a_contraction_beyond_the_limit_of_the_checker_is_left_out(monkeypatch) -> None:
    model, data = record("square-root tank")
    cover = Cover(Record(model, data, {"y": BOUND}), 0.05)
    while not cover.done:
        cover.step()
    whole, _ = certificate.run_certificate(cover, {"y": BOUND}, print)
    monkeypatch.setattr(runs.read, "WORK", 50_000)
    claim, content = certificate.run_certificate(cover, {"y": BOUND}, print)
    assert runs.check(content) is not None
    for parameter in model.parameters:
        (low, high), (best_low, best_high) = claim[parameter.name], whole[parameter.name]
        assert parameter.lower <= low <= best_low < best_high <= high <= parameter.upper
        assert high - low > best_high - best_low
    # Where even the first one is, nothing is proven.
    monkeypatch.setattr(runs.read, "WORK", 10_000)
    claim, content = certificate.run_certificate(cover, {"y": BOUND}, print)
    assert content is None
    assert claim == {p.name: (p.lower, p.upper) for p in model.parameters}


def test_a_model_with_rates_a_clock_and_missing_samples(tmp_path) -> None:
    h, k = signal("h"), signal("k")
    clock = Line(k[t], k[t - 1] + 0.05)
    rate = Line(h[t], b * u[t] * (1 + 0.3 * sympy.sin(k[t])) - a * sympy.sqrt(h[t]), rate=True)
    boxes = (Parameter("a", 0.1, 2), Parameter("b", 0.1, 2))
    model = Model("tank", boxes, (clock, rate), (Measurement("y", "h", "eta"),), scheme="euler", sampling_time=0.1)
    rng = np.random.default_rng(2)
    inputs, states = rng.uniform(0, 1, 40), [0.6]
    for n in range(1, 40):
        flow = 0.9 * inputs[n - 1] * (1 + 0.3 * np.sin(0.05 * (n - 1)))
        states.append(states[-1] + 0.1 * (flow - 0.5 * np.sqrt(states[-1])))
    measured = np.array(states) + rng.uniform(-0.002, 0.002, 40)
    measured[[7, 20]] = np.nan
    data = Dataset.from_arrays(input={"u": inputs}, output={"y": measured}, sampling_time=0.1)
    file = tmp_path / "proof.json"
    estimate = identify(model, data, 0.002, method="inversion", tolerance=0.1, certificate=file)
    assert estimate["a"].lower <= 0.5 <= estimate["a"].upper
    found = verify(file, data, model)
    assert found.intervals["b"] == (estimate["b"].lower, estimate["b"].upper)
    content = check.read(file)
    # The clock is an unknown of the checker alone, and the level's begin is bounded as in the search.
    begin = runs.read.document(content).stated.unknowns.index("h[0]")
    assert begin in {side[0] for box in content["boxes"] for step in box.get("passes", ()) for side in step["sides"]}
    content["initial"].append([0, "h", 0, 0, 1])
    changed = tmp_path / "changed.json"
    changed.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(NotProvenError, match="states h at sample 0, of which nothing is known"):
        verify(changed, data, model)


def test_sensors_noisy_inputs_constraints_and_several_experiments(tmp_path) -> None:
    v = signal("v")
    line = Line(x[t], a * sympy.tanh(x[t - 1]) + b * v[t - 1])
    curved = Measurement("z", "x", "zeta", VALUE + 0.1 * VALUE**3)
    sensors = (Measurement("y", "x", "eta"), curved, Measurement("u", "v", "xi"))
    boxes = (Parameter("a", 0.2, 1.2), Parameter("b", 0.2, 1.2))
    model = Model("sensed", boxes, (line,), sensors, constraints=(1.5 - a - b,))
    rng, runs_ = np.random.default_rng(3), []
    for _ in range(2):
        inputs, states = rng.uniform(-1, 1, 25), [0.4]
        for k in range(1, 25):
            states.append(0.6 * np.tanh(states[-1]) + 0.8 * inputs[k - 1])
        # The sensor shows the value whose curve is the state.
        shown = np.array([np.roots([0.1, 0, 1, -state])[-1].real for state in states])
        noise = rng.uniform(-0.01, 0.01, (3, 25))
        runs_.append({"u": inputs + noise[0], "y": states + noise[1], "z": shown + noise[2]})
    outputs = {name: runs_[0][name] for name in "yz"}
    data = Dataset.from_arrays(input={"u": runs_[0]["u"]}, output=outputs, sampling_time=1.0)
    (first,) = data.experiments
    data = data.with_experiments([replace(first, name=f"run {k}", values=own) for k, own in enumerate(runs_)])
    file = tmp_path / "proof.json"
    estimate = identify(model, data, 0.011, method="inversion", tolerance=0.3, nodes=60, certificate=file)
    found = verify(file, data, model)
    assert found.equations == 48
    for name, truth in (("a", 0.6), ("b", 0.8)):
        assert found.intervals[name] == (estimate[name].lower, estimate[name].upper)
        assert 0.2 < estimate[name].lower <= truth <= estimate[name].upper < 1.2


# ---------------------------------------------------------------- changed certificates


def _weaker_multiplier(content: Any) -> None:
    sides = [side for box in content["boxes"] for step in box.get("passes", ()) for side in step["sides"]]
    for side in sides:
        side[3][1] *= 2


def _moved_cut(content: Any) -> None:
    for box in content["boxes"]:
        if "cut" in box:
            box["cut"][1] = "0x0p+0"


def _dropped_leaf(content: Any) -> None:
    content["boxes"].pop()


def _dropped_passes(content: Any) -> None:
    for box in content["boxes"]:
        box.pop("passes", None)


def _further_box(content: Any) -> None:
    content["boxes"].append({})


def _no_boxes(content: Any) -> None:
    content["boxes"] = []


def _changed_sample(content: Any) -> None:
    samples = content["experiments"][0]["channels"]["y"]
    samples[:] = [(float.fromhex(y) + 0.01 * (-1) ** k).hex() for k, y in enumerate(samples)]


def _wider_noise(content: Any) -> None:
    content["noise_bounds"]["y"] = float(1.1 * BOUND).hex()


def _wider_box(content: Any) -> None:
    content["model"]["parameters"]["a"] = ["0x0p+0", "0x1p+3"]


def _narrower_claim(content: Any) -> None:
    low, high = map(float.fromhex, content["claim"]["a"])
    content["claim"]["a"] = [(low + 1e-6 * (high - low)).hex(), high.hex()]


def _claimed_empty(content: Any) -> None:
    content["claim"] = None


def _other_line(content: Any) -> None:
    content["model"]["lines"]["x"] = content["model"]["lines"]["x"].replace("sqrt", "2*sqrt")


CHANGES = [
    _weaker_multiplier,
    _moved_cut,
    _dropped_leaf,
    _dropped_passes,
    _further_box,
    _no_boxes,
    _changed_sample,
    _wider_noise,
    _wider_box,
    _narrower_claim,
    _claimed_empty,
    _other_line,
]


@pytest.mark.parametrize("change", CHANGES)
def test_a_changed_certificate_is_refused(tank, change) -> None:
    content = copy.deepcopy(tank[0])
    change(content)
    with pytest.raises(check.Refused):
        runs.check(content)


def test_every_part_of_the_statement_is_compared(tank, tmp_path) -> None:
    content, file = tank
    model, data = record("square-root tank")
    with pytest.raises(ModelError, match=r"noise bound of 'y' is 0\.03"):
        verify(file, data, model, 0.03)
    with pytest.raises(ModelError, match="the parameter 'a' of the model is not that of the proof"):
        verify(file, data, model.bound(a=(0, 0.3)))
    with pytest.raises(DataError, match="differs first at sample"):
        verify(file, record("square-root tank", jump=0.1)[1], model)

    def changed(**parts: Any) -> Path:
        other = tmp_path / "other.json"
        other.write_text(json.dumps({**content, **parts}), encoding="utf-8")
        return other

    # A proof that holds, about samples that are not those of the origin.
    (run,) = content["experiments"]
    sample = [None, *run["channels"]["y"][1:]]
    experiments = [{**run, "channels": {**run["channels"], "y": sample}}]
    with pytest.raises(NotProvenError, match="the samples of y in the proof are not those of the data"):
        verify(changed(experiments=experiments), data, model)
    with pytest.raises(NotProvenError, match="holds from sample 1 on, not from 2"):
        verify(changed(first={"x": 2}), data, model)
    with pytest.raises(DataError, match="states no model and data"):
        verify(changed(origin=None), data, model)


def test_the_commands_check_and_verify(tank, tmp_path, capsys) -> None:
    _, file = tank
    assert check.main([str(file)]) == 0
    said = capsys.readouterr().out
    assert "accepted: 1 parameter" not in said
    assert "accepted: 2 parameters" in said
    assert "model.lines.x: " in said
    assert "a in [0.02, 0.3]: 0.1" in said
    data = tmp_path / "data.csv"
    _, dataset = record("square-root tank")
    values = dataset.experiments[0].values
    rows = [f"{float(p)!r},{float(q)!r}" for p, q in zip(values["u"], values["y"], strict=True)]
    data.write_text("\n".join(["u,y", *rows]) + "\n", encoding="utf-8")
    result = CliRunner().invoke(main, ["verify", str(file), str(data)])
    assert result.exit_code == 0, result.output
    assert "verified: the proof holds, and its 29 equations are those of the model" in result.output


def test_bounds_of_a_hidden_state_are_stated_and_compared(tmp_path) -> None:
    lines = ["v[t] = a*v[t-1] + u[t-1]", "x[t] = 0.5*x[t-1] + 0.3*sin(v[t-1])"]
    model = OwnModel(lines, {"y": "x"}, ["u"], {"a": (0.1, 0.9)}).bound(v=(-3.0, 3.0))
    generator = np.random.default_rng(0)
    u, states = generator.uniform(-1, 1, 20), [(0.4, 0.0)]
    for k in range(19):
        v, x = states[-1]
        states.append((0.6 * v + u[k], 0.5 * x + 0.3 * np.sin(v)))
    y = np.array(states)[:, 1] + generator.uniform(-BOUND, BOUND, 20)
    data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    file = tmp_path / "proof.json"
    found = identify(model, data, BOUND, tolerance=0.05, certificate=file)["a"]
    assert found.lower < 0.6 < found.upper
    verify(file, data, model, BOUND)
    for other in (model.bound(v=(-2.0, 2.0)), replace(model, bounds={})):
        with pytest.raises(ModelError, match="bounds of 'v'"):
            verify(file, data, other, BOUND)
    narrow = model.bound(v=(-0.5, 0.5))  # v leaves these later
    with pytest.raises(EmptyFeasibleSetError):
        identify(narrow, data, BOUND, certificate=tmp_path / "empty.json")
    verify(tmp_path / "empty.json", data, narrow, BOUND)
    with pytest.raises(ModelError, match="bounds of 'v'"):
        verify(tmp_path / "empty.json", data, model, BOUND)
    # No other piece begins at the sample that a forged link names.
    content = json.loads(file.read_text())
    assert len(content["pieces"]) > 1
    forged = json.loads(file.read_text())
    rows = next(
        step["rows"] for box in forged["boxes"] for step in box["passes"] if any(r[0] > 1 for r in step["rows"])
    )
    place = next(k for k, row in enumerate(rows) if row[0] > 1)
    rows[place][3] -= 1
    (tmp_path / "forged.json").write_text(json.dumps(forged))
    with pytest.raises(NotProvenError, match=f"nothing is known of row {place}"):
        verify(tmp_path / "forged.json", data, model, BOUND)
    content["initial"].append([0, "v", 0, 0, 0])
    file.write_text(json.dumps(content))
    with pytest.raises(NotProvenError):
        verify(file, data, model, BOUND)
