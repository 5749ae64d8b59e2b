"""Scores of a free run, against the formulas written out."""

import json

import numpy as np
import pytest

from smid import DataError, Dataset, ModelError, OutputError, validate

MODEL = OutputError(1, 0).with_values({"a1": -0.5, "b0": 1.0})


def record(n: int, seed: int, name: str = "run") -> Dataset:
    rng = np.random.default_rng(seed)
    u = rng.normal(size=n)
    w = np.zeros(n)
    for k in range(1, n):
        w[k] = 0.5 * w[k - 1] + u[k - 1]
    y = w + rng.uniform(-0.1, 0.1, n)
    return Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0, units={"y": "bar"}, name=name)


def free_run(data: Dataset, experiment: int = 0) -> np.ndarray:
    u, y = data.values("u", experiment), data.values("y", experiment)
    w = y.copy()
    for k in range(1, len(w)):
        w[k] = 0.5 * w[k - 1] + u[k - 1]
    return w


def test_scores_are_the_formulas() -> None:
    data = record(30, 0)
    error = (data.values("y") - free_run(data))[1:]
    y = data.values("y")[1:]
    score = validate(MODEL, data, 0.05).scores[0]
    assert (score.channel, score.unit, score.samples) == ("y", "bar", 29)
    assert score.rmse == pytest.approx(np.sqrt(np.mean(error**2)))
    assert score.fit_percent == pytest.approx(100 * (1 - np.linalg.norm(error) / np.linalg.norm(y - y.mean())))
    assert score.largest == pytest.approx(np.abs(error).max())
    assert score.violations == int((np.abs(error) > 0.05).sum()) > 0


def test_warm_up_stays_out() -> None:
    from dataclasses import replace

    data = replace(record(30, 0), n_init=10)
    error = (data.values("y") - free_run(data))[10:]
    score = validate(MODEL, data).scores[0]
    assert score.samples == 20
    assert score.rmse == pytest.approx(np.sqrt(np.mean(error**2)))
    assert score.violations is None


def test_every_experiment_is_scored_on_its_own() -> None:
    data = Dataset.merge([record(20, 1, "a"), record(15, 2, "b")])
    found = validate(MODEL, data, {"y": 0.3})
    assert [(s.experiment, s.samples) for s in found.scores] == [("a", 19), ("b", 14)]
    for k, run in enumerate(found.simulated):
        np.testing.assert_allclose(run["y"], free_run(data, k))
    table = str(found).splitlines()
    assert table[0].split()[:3] == ["experiment", "output", "samples"]
    assert "bar" in table[1]


def test_a_constant_output_has_no_fit() -> None:
    data = Dataset.from_arrays(input={"u": [1.0, 0, 0, 1]}, output={"y": [1.0, 1, 1, 1]}, sampling_time=1.0)
    found = validate(MODEL, data)
    assert found.scores[0].fit_percent == -np.inf
    plain = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert plain["scores"][0]["fit_percent"] is None


def test_channels_are_bound_by_role() -> None:
    data = record(20, 3)
    renamed = Dataset.from_arrays(
        input={"valve": data.values("u")}, output={"pressure": data.values("y")}, sampling_time=1.0
    )
    assert validate(MODEL, renamed).scores[0].rmse == validate(MODEL, data).scores[0].rmse


def test_what_cannot_be_scored_is_refused() -> None:
    with pytest.raises(DataError, match=r"has 1 samples, none of .* after the first ones.*take a longer record"):
        validate(MODEL, record(1, 0))
    with pytest.raises(ModelError, match="a1"):
        validate(OutputError(1, 0), record(10, 0))
    with pytest.raises(TypeError, match="a float cannot be simulated: give a model with values, an estimate or a fit"):
        validate(1.0, record(10, 0))  # type: ignore[arg-type]
