"""A fit is a minimum that keeps what the model states, and its standard errors are those of repeated noise."""

import dataclasses

import numpy as np
import pytest

import smid
from smid import DataError, Dataset, ModelError, OutputError

SECOND = {"a1": -1.5, "a2": 0.7, "b0": 1.0}


def record(seed: int, n: int = 120, noise: float = 0.1, pole: float = 0.8, name: str = "run", level: float = 0.0):
    rng = np.random.default_rng(seed)
    u, w = rng.standard_normal(n), np.full(n, level)
    for k in range(1, n):
        w[k] = pole * w[k - 1] + u[k - 1]
    y = w + noise * rng.standard_normal(n)
    return Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=0.1, units={"y": "bar"}, name=name)


def test_no_neighbour_is_better():
    data = record(0)
    squares, largest = smid.fit(OutputError(), data), smid.fit(OutputError(), data, "minimax")
    assert squares.scores[0].rmse < largest.scores[0].rmse
    assert largest.scores[0].largest < squares.scores[0].largest
    for change in (0.999, 1.001):
        for name in squares:
            moved = squares.model.with_values({name: change * squares[name]})
            held = dataclasses.replace(squares, model=moved).to_dict()
            simulated = smid.ModelFit.from_dict(held, data).simulated[0]["y"]
            assert np.sqrt(np.mean((data.values("y") - simulated) ** 2)) > squares.scores[0].rmse


def test_standard_errors_are_the_spread_of_fits_to_other_noise():
    found = [smid.fit(OutputError(), record(1).with_experiments([noisy(k)]), starts=2) for k in range(60)]
    for name in ("a1", "b0"):
        spread = np.std([one[name] for one in found])
        told = np.median([one.standard_errors[name] for one in found if one.standard_errors])
        assert spread / told == pytest.approx(1, abs=0.3)
    assert sum(bool(one.standard_errors) for one in found) > 55  # 1 % of white residuals fail the test


def noisy(seed: int):
    clean = record(1, noise=0.0).experiments[0]
    noise = 0.1 * np.random.default_rng(seed).standard_normal(clean.n_samples)
    return dataclasses.replace(clean, values={"u": clean.values["u"], "y": clean.values["y"] + noise})


def test_experiments_have_their_own_initial_states_and_missing_samples_are_not_read():
    data = Dataset.merge([record(2, noise=0, level=0.0, name="a"), record(3, noise=0, level=5.0, name="b")])
    found = smid.fit(OutputError(), data)
    assert found.parameters == pytest.approx({"a1": -0.8, "b0": 1.0}, abs=1e-5)
    assert [score.experiment for score in found.scores] == ["a", "b"]
    assert found.initial[1]["w", 1] != pytest.approx(found.initial[0]["w", 1], abs=1)
    y = record(4).values("y").copy()
    y[20:30] = np.nan
    gaps = Dataset.from_arrays(input={"u": record(4).values("u")}, output={"y": y}, sampling_time=0.1)
    fitted = smid.fit(OutputError(), gaps)
    assert fitted.scores[0].samples == 110
    assert np.isnan(fitted.error(0)[20:30]).all()
    assert "10 of 120 samples of y are missing" in str(fitted)


@pytest.mark.parametrize("method", ["least_squares", "minimax"])
def test_constraints_and_bounds_of_the_model_are_kept(method):
    rng = np.random.default_rng(5)
    u, w = rng.standard_normal(60), np.zeros(60)
    for k in range(2, 60):  # unstable: a pole at 1.02
        w[k] = 1.52 * w[k - 1] - 0.51 * w[k - 2] + u[k - 1]
    data = Dataset.from_arrays(input={"u": u}, output={"y": w}, sampling_time=1.0)
    free = smid.fit(OutputError(2), data, method)
    assert max(abs(np.roots([1, free["a1"], free["a2"]]))) > 1.01
    stable = smid.fit(OutputError(2, stable=True), data, method)
    assert max(abs(np.roots([1, stable["a1"], stable["a2"]]))) <= 1 + 1e-6
    assert not stable.standard_errors
    if method == "least_squares":
        assert "lies at a constraint" in stable.reason
    bounded = smid.fit(OutputError(bounds={"b0": (0.0, 0.5)}), record(0), method)
    assert bounded["b0"] <= 0.5
    assert bounded.to_pandas().set_index("name").loc["b0", "prior"] == "upper"
    assert not bounded.standard_errors.get("b0", np.nan) > 0


def test_no_standard_error_where_it_would_mislead():
    wrong = smid.fit(OutputError(0), record(6))
    assert "is not white" in wrong.reason
    u = np.ones(50)
    still = Dataset.from_arrays(input={"u": u}, output={"y": np.random.default_rng(0).random(50)}, sampling_time=1.0)
    unknown = smid.fit(OutputError(1, offset=True, bounds={"a1": (-0.9, 0.9)}), still)
    assert "do not determine every parameter" in unknown.reason


def test_a_fit_takes_the_place_of_a_model():
    data, other = record(7), record(8)
    found = smid.fit(OutputError(), data)
    assert smid.validate(found, other).to_dict() == smid.validate(found.model, other).to_dict()
    assert smid.compare([found, OutputError().with_values({"a1": -0.3, "b0": 1})], other).best == "output error 1"
    assert smid.residuals(found, other).is_white
    with pytest.raises(ModelError, match=r"the fit has a sampling time of 0\.1 s"):
        smid.validate(found, dataclasses.replace(other, sampling_time=0.2))


def test_mistakes_are_told_in_one_line():
    data = record(0)
    for call, error, words in (
        (lambda: smid.fit(OutputError(), data, "ridge"), ModelError, "'ridge' is unknown: take least_squares or"),
        (lambda: smid.fit(OutputError(), data, starts=0), ModelError, "starts = 0: give a whole number of at least 1"),
        (lambda: smid.fit(OutputError(3), data.crop(0, 4)), DataError, "take a longer record or a smaller model"),
        (lambda: smid.fit(OutputError(input="v"), data), DataError, "the model needs the channel 'v'"),
        (lambda: smid.fit(OutputError(), data)["c"], KeyError, "no parameter 'c': the model has a1, b0"),
    ):
        with pytest.raises(error, match=words) as told:
            call()
        assert "\n" not in str(told.value)
