"""Several models over one record: the true one is first, and each score is that of validate on common samples."""

import json

import numpy as np
import pytest

from smid import DataError, Dataset, ModelError, OutputError, compare, identify, validate

TRUE = OutputError(1).with_values({"a1": -0.8, "b0": 0.4})
SLOW = OutputError(1).with_values({"a1": -0.9, "b0": 0.2})
LATE = OutputError(1, delay=4).with_values({"a1": -0.8, "b0": 0.4})


def record(n: int, seed: int, name: str = "run") -> Dataset:
    rng = np.random.default_rng(seed)
    u, w = np.repeat(rng.uniform(-1, 1, n), 4)[:n], np.zeros(n)
    for k in range(1, n):
        w[k] = 0.8 * w[k - 1] + 0.4 * u[k - 1]
    y = w + rng.uniform(-0.05, 0.05, n)
    return Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=0.1, units={"y": "bar"}, name=name)


@pytest.mark.parametrize("seed", range(5))
def test_the_true_model_is_first(seed: int) -> None:
    models = {"late": LATE, "slow": SLOW, "true": TRUE}
    found = compare(models, record(200, seed))
    assert found.best == "true"
    fits = [run.scores[0].fit_percent for run in found.validations.values()]
    assert fits == sorted(fits, reverse=True)
    assert compare(dict(reversed(models.items())), record(200, seed)).to_dict() == found.to_dict()


def test_every_model_is_scored_on_the_samples_after_the_longest_start() -> None:
    data = record(100, 0)
    found = compare({"true": TRUE, "late": LATE}, data)
    assert {run.scores[0].samples for run in found.validations.values()} == {100 - LATE.max_lag}
    assert found.validations["true"].scores == validate(TRUE, data.with_n_init(LATE.max_lag)).scores


def test_each_experiment_has_its_rows_the_best_first() -> None:
    data = Dataset.merge([record(80, 1, "a"), record(90, 2, "b")])
    found = compare([SLOW, TRUE], data)
    assert list(found.validations) == ["output error 2", "output error 1"]
    frame = found.to_pandas()
    assert frame["experiment"].tolist() == ["a", "a", "b", "b"]
    assert frame["model"].tolist() == ["output error 2", "output error 1"] * 2
    assert [row[0] for row in found.table.rows] == frame["model"].tolist()
    assert "Best mean fit: output error 2" in str(found)
    assert json.loads(json.dumps(found.to_dict(), allow_nan=False))["order"] == list(found.validations)
    assert len(found.plot(1).axes[0].lines) == 3  # measured, and one for each model


def test_an_estimate_stands_for_its_central_model() -> None:
    data = record(60, 3)
    estimate = identify(OutputError(1, stable=True), data, 0.06)
    assert compare([estimate], data).validations["output error"].scores == validate(estimate.model, data).scores
    slower = data.decimate(2, antialias=False)
    with pytest.raises(
        ModelError, match=r"model 'plant': the estimate has a sampling time of 0\.1 s, .* 0\.2 s: resample"
    ):
        compare({"plant": estimate}, slower)


def constant(data: Dataset) -> Dataset:
    return Dataset.from_arrays(input={"u": data.values("u")}, output={"y": np.ones(data.n_samples)}, sampling_time=0.1)


@pytest.mark.parametrize(
    ("models", "data", "error", "words"),
    [
        ({}, record(50, 0), ModelError, "no model to compare: give at least one"),
        ({"free": OutputError(1)}, record(50, 0), ModelError, "model 'free': .*a1"),
        ({"true": TRUE, "other": OutputError(1, input="v").with_values({"a1": -0.8, "b0": 0.4})}, record(50, 0),
         ModelError, "model 'other': the data lack the channel 'v': they have u, y"),
        ({"true": TRUE}, constant(record(50, 0)), DataError,
         "output 'y' is constant in experiment 'experiment', so it has no fit: leave the experiment out"),
        ({"late": LATE}, record(3, 0), DataError, "has 3 samples, none after the first 4 .*: take a longer record"),
        ([1.0], record(50, 0), TypeError, "a float cannot be simulated: give a model with values, an estimate or"),
        (TRUE, record(50, 0), TypeError, "a single Model was given: give a list or a mapping of models"),
        ([TRUE], [1.0], TypeError, "the data are a list, not a Dataset"),
    ],
)  # fmt: skip
def test_a_mistake_is_told_in_one_line(models: object, data: Dataset, error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=words) as told:
        compare(models, data)  # type: ignore[arg-type]
    assert "\n" not in str(told.value)
