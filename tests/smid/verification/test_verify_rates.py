"""Certificates about differential equations: accepted for their model and data, refused after any one change."""

import copy
import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.integrate import solve_ivp

from relaxations import check
from relaxations.check import runs
from smid import Dataset, EmptyFeasibleSetError, Model, ModelError, NotProvenError, OwnModel, identify, verify
from smid.cli import main

Rates = Callable[[Any, float], list[float]]


def solved(rates: Rates, u: Any, start: list[float], dt: float) -> Any:
    """Return the states at each sample, by another method."""
    states = [start]
    for held in u[:-1]:
        found = solve_ivp(lambda _, x, v=held: rates(x, v), (0, dt), states[-1], rtol=1e-10, atol=1e-12)
        states.append(found.y[:, -1].tolist())
    return np.array(states)


# Model, the truth, its rates, the start, how many samples, the noise bound.
PLANTS: dict[str, tuple[Model, dict[str, float], Rates, list[float], int, float]] = {
    "tank": (
        OwnModel(
            ["d/dt h = b*u - g*sqrt(h)"],
            {"y": "h"},
            ["u"],
            {"b": (0.2, 2), "g": (0.1, 1)},
            scheme="enclosed",
            substeps=8,
            sampling_time=1.5,
        ),
        {"b": 0.8, "g": 0.4},
        lambda x, u: [0.8 * u - 0.4 * math.sqrt(x[0])],
        [0.6],
        20,
        2e-3,
    ),
    "Arrhenius": (
        OwnModel(
            ["d/dt h = b*(u - h) - g*h*exp(-2/(h + 1))"],
            {"y": "h"},
            ["u"],
            {"b": (0.2, 2), "g": (0.5, 3)},
            scheme="enclosed",
            substeps=4,
            sampling_time=0.4,
        ),
        {"b": 1.0, "g": 1.5},
        lambda x, u: [u - x[0] - 1.5 * x[0] * math.exp(-2 / (x[0] + 1))],
        [0.6],
        16,
        2e-3,
    ),
}


def record(name: str, jump: float = 0.0) -> tuple[Model, Dataset, float]:
    """Return a model, a record of its solution, and the noise bound; with a jump no parameters fit."""
    model, _, rates, start, n, bound = PLANTS[name]
    rng = np.random.default_rng(2)
    u = np.repeat(rng.uniform(0.1, 1, n), 3)[:n]
    dt = model.sampling_time or 1.0
    y = solved(rates, u, start, dt)[:, 0] + rng.uniform(-bound, bound, n)
    y[n // 2] += jump
    return model, Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=dt), bound


@pytest.fixture(scope="module")
def tank(tmp_path_factory) -> tuple[Any, Path]:
    """Return the content of a certificate, and its file."""
    model, data, bound = record("tank")
    file = tmp_path_factory.mktemp("proofs") / "tank.json"
    identify(model, data, bound, tolerance=0.2, certificate=file)
    return check.read(file), file


@pytest.mark.parametrize("name", PLANTS)
def test_the_published_ends_are_proven_and_hold_the_truth(tmp_path, name: str) -> None:
    model, data, bound = record(name)
    file = tmp_path / "proof.json"
    found, alone = (identify(model, data, bound, tolerance=0.5, certificate=own) for own in (file, None))
    checked, verified = runs.check(check.read(file)), verify(file, data, model, bound)
    for interval, prior in zip(found, model.parameters, strict=True):
        assert tuple(map(float, checked[interval.name])) == (interval.lower, interval.upper)
        assert verified.intervals[interval.name] == (interval.lower, interval.upper)
        assert prior.lower < interval.lower <= PLANTS[name][1][interval.name] <= interval.upper < prior.upper
        assert interval.width < 1.2 * alone[interval.name].width


def test_an_empty_set_is_proven(tmp_path) -> None:
    model, data, bound = record("tank", jump=0.05)
    file = tmp_path / "proof.json"
    with pytest.raises(EmptyFeasibleSetError):
        identify(model, data, bound, certificate=file)
    assert runs.check(check.read(file)) is None
    assert verify(file, data, model).empty


def test_the_truth_is_kept_that_a_discretisation_excludes(tank) -> None:
    _, data, bound = record("tank")
    content, _ = tank
    model = replace(PLANTS["tank"][0], scheme="euler", substeps=1)
    truth = PLANTS["tank"][1]
    try:
        coarse = identify(model, data, bound, method="inversion", tolerance=0.2)
    except EmptyFeasibleSetError:
        coarse = None
    assert coarse is None or not all(i.lower <= truth[i.name] <= i.upper for i in coarse)
    assert all(low <= truth[name] <= high for name, (low, high) in runs.check(content).items())


# ---------------------------------------------------------------- changed certificates


def _narrower_claim(content: Any) -> None:
    low, high = map(float.fromhex, content["claim"]["b"])
    content["claim"]["b"] = [(low + 1e-6 * (high - low)).hex(), high.hex()]


def _claimed_empty(content: Any) -> None:
    content["claim"] = None


def _changed_sample(content: Any) -> None:
    samples = content["experiments"][0]["channels"]["y"]
    samples[7] = (float.fromhex(samples[7]) + 1e-3).hex()


def _fewer_steps(content: Any) -> None:
    content["steps"] = 1


def _other_law(content: Any) -> None:
    content["model"]["rates"]["h"] = content["model"]["rates"]["h"].replace("sqrt(h[t])", "h[t]**0.51")


def _longer_interval(content: Any) -> None:
    content["model"]["interval"] = "0x1.9p+0"


def _weaker_multiplier(content: Any) -> None:
    for side in (side for box in content["boxes"] for step in box.get("passes", ()) for side in step["sides"]):
        side[3][1] *= 2


CHANGES = [
    _narrower_claim,
    _claimed_empty,
    _changed_sample,
    _fewer_steps,
    _other_law,
    _longer_interval,
    _weaker_multiplier,
]


@pytest.mark.parametrize("change", CHANGES)
def test_a_changed_certificate_is_refused(tank, change) -> None:
    content = copy.deepcopy(tank[0])
    change(content)
    with pytest.raises(check.Refused):
        runs.check(content)


def test_every_part_of_the_statement_is_compared(tank, tmp_path) -> None:
    content, file = tank
    model, data, _ = record("tank")
    other = OwnModel(["d/dt h = b*u - g*h"], {"y": "h"}, ["u"], {"b": (0.2, 2), "g": (0.1, 1)}, scheme="enclosed")
    with pytest.raises(ModelError, match="the rate of 'h' of the model is not that of the proof"):
        verify(file, data, other)
    with pytest.raises(ModelError, match="the rate of 'h' of the model is not that of the proof: none, not"):
        verify(file, data, replace(model, scheme="rk4"))
    changed = copy.deepcopy(content)
    _longer_interval(changed)
    (tmp_path / "other.json").write_text(json.dumps(changed), encoding="utf-8")
    with pytest.raises(ModelError, match="the time between two samples"):
        verify(tmp_path / "other.json", data, model)
    (tmp_path / "other.json").write_text(json.dumps({**content, "first": {"h": 2}}), encoding="utf-8")
    with pytest.raises(NotProvenError, match="holds from sample 1 on, not from 2"):
        verify(tmp_path / "other.json", data, model)


def test_the_commands_check_and_verify(tank, tmp_path, capsys) -> None:
    _, file = tank
    assert check.main([str(file)]) == 0
    assert "model.rates.h: " in capsys.readouterr().out
    _, dataset, _ = record("tank")
    values = dataset.experiments[0].values
    rows = [
        f"{1.5 * k},{float(p)!r},{float(q)!r}" for k, (p, q) in enumerate(zip(values["u"], values["y"], strict=True))
    ]
    data = tmp_path / "data.csv"
    data.write_text("\n".join(["t,u,y", *rows]) + "\n", encoding="utf-8")
    result = CliRunner().invoke(main, ["verify", str(file), str(data)])
    assert result.exit_code == 0, result.output
    assert "d/dt h = " in result.output
