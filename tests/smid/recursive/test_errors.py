"""The three errors side by side, the free run, and what they say in words."""

import json

import numpy as np
import pytest

from smid.data import DataError, Dataset
from smid.models import ModelError
from smid.recursive import (
    Arx,
    ForgettingFactor,
    KalmanFilter,
    NormalisedGradient,
    UnnormalisedGradient,
    compare,
    free_run,
    track,
)
from tests.smid.recursive.arx_records import STRUCTURES, TRUE, arx_record, as_data


@pytest.mark.parametrize("name", STRUCTURES)
def test_the_free_run_equals_a_loop_by_hand(name):
    arx, theta = STRUCTURES[name], np.array(TRUE[name])
    u, y = arx_record(arx, theta, 80, seed=1)
    w = y.copy()
    for k in range(arx.max_lag, 80):
        outputs = w[k - arx.na : k][::-1].tolist()
        inputs = (arx.input_scale * u[k - arx.delay - arx.nb : k + 1][::-1]).tolist()
        w[k] = np.dot(arx.row(outputs, inputs), theta)
    found = free_run(arx, theta, u, y)
    np.testing.assert_allclose(found.output, w, rtol=1e-10, atol=1e-12)
    assert found.stopped is None
    assert found.radius < 1


def test_an_unstable_frozen_model_is_stopped_and_said():
    u, y = np.ones(400), np.full(400, 2.0)
    found = free_run(Arx(), [-1.2, 1.0], u, y)
    assert found.radius == pytest.approx(1.2)
    # 7 * 1.2^k - 5 passes a million times the largest output.
    expected = next(k for k in range(400) if 7 * 1.2**k - 5 > 2e6)
    assert found.stopped == expected
    assert np.isfinite(found.output[:expected]).all()
    assert np.isnan(found.output[expected:]).all()

    grown = np.zeros(40)
    for k in range(1, 40):
        grown[k] = 1.2 * grown[k - 1] + 1
    rest = np.concatenate([grown, np.zeros(360)])
    found = track(Arx(stable=False), ForgettingFactor(1.0), as_data(np.ones(400), rest).crop(0, 40))
    assert "final model unstable, pole 1.2" in str(found)
    late = track(Arx(stable=False), NormalisedGradient(), as_data(np.ones(400), np.r_[np.ones(398), 1.0, 9.0]))
    assert late.frozen.stopped is not None
    assert np.isnan(late.free_run.rmse)
    assert f"free run stopped at sample {late.frozen.stopped}" in str(late)
    assert "diverged and was stopped" in late.meaning


def test_an_exact_record_has_no_error_ahead_and_none_in_free_run():
    arx = STRUCTURES["three poles"]
    u, y = arx_record(arx, TRUE["three poles"], 400, seed=2, noise=0.0)
    found = track(arx, ForgettingFactor(1.0), as_data(u, y), start=TRUE["three poles"])
    assert found.one_step.largest < 1e-12
    assert found.free_run.largest < 1e-11
    assert found.held.rmse > 0.1


def test_errors_count_after_the_warm_up_only():
    arx = Arx()
    u, y = arx_record(arx, [-0.8, 0.5], 200, seed=3)
    whole = track(arx, ForgettingFactor(), as_data(u, y))
    later = track(arx, ForgettingFactor(), as_data(u, y).with_n_init(100))
    np.testing.assert_array_equal(whole.one_step.samples, later.one_step.samples)
    assert later.one_step.rmse == pytest.approx(np.sqrt(np.mean(whole.one_step.samples[100:] ** 2)))
    assert later.one_step.largest < whole.one_step.largest


def test_words_and_table_of_the_thesis_choice():
    rng = np.random.default_rng(4)
    found = track(Arx(), NormalisedGradient(), as_data(rng.normal(size=300), rng.normal(size=300)))
    text = str(found)
    assert text.splitlines()[1].split() == ["error", "RMSE", "[bar]", "largest", "[bar]"]
    assert [line.split("  ")[0] for line in text.splitlines()[2:6]] == [
        "a posteriori",
        "one step ahead",
        "free run",
        "last output held",
    ]
    assert found.largest_left_alone < 1e-13 < 0.5 < found.one_step.rmse
    assert "with gain 1 the updated model fits the present sample exactly" in found.meaning
    assert "2e-14" in found.meaning
    other = track(Arx(), ForgettingFactor(), as_data(rng.normal(size=300), rng.normal(size=300)))
    assert "2e-14" not in other.meaning
    assert "the parameters already use the sample" in other.meaning


def test_no_estimate_is_said():
    found = track(Arx(na=0, delay=0), UnnormalisedGradient(1.0), as_data(np.full(600, 3.0), np.ones(600)))
    assert found.meaning.startswith("There is no estimate: the parameters diverged at sample")
    assert len(found.plot().axes) == 3
    assert json.loads(json.dumps(found.to_dict()))["one_step"]["rmse"] is None


def test_several_estimators_on_several_records():
    arx = Arx()
    runs = [as_data(*arx_record(arx, [-0.8, 0.5], 120, seed), name=f"run {seed}") for seed in (1, 2)]
    methods = [ForgettingFactor(), KalmanFilter(0.01), NormalisedGradient(), UnnormalisedGradient(0.05)]
    models = [arx, Arx(na=2, powers=(2, 1))]
    found = compare(models, methods, Dataset.merge(runs))
    assert [t.record for t in found.trackings] == ["run 1"] * 8 + ["run 2"] * 8
    alone = track(models[1], methods[2], runs[1])
    same = found.trackings[14]
    assert (same.arx, same.method) == (models[1], methods[2])
    np.testing.assert_array_equal(same.history.parameters, alone.history.parameters)
    assert str(found).splitlines()[0] == "16 runs, RMSE [bar]"
    assert len(str(found).splitlines()) == 18
    assert len(found.plot().axes) == 2
    assert len(json.loads(json.dumps(found.to_dict()))["trackings"]) == 16
    with pytest.raises(ModelError, match="nothing to compare"):
        compare([arx], [], runs[0])


def test_records_that_do_not_fit_are_refused():
    two = Dataset.from_arrays(input={"u": [1, 2]}, output={"y": [1, 2], "z": [1, 2]}, sampling_time=1)
    with pytest.raises(DataError, match="there are 2 outputs"):
        track(Arx(), ForgettingFactor(), two)
    with pytest.raises(DataError, match="too few"):
        track(Arx(na=3), ForgettingFactor(), as_data([1, 2], [1, 2]))
    with pytest.raises(ModelError, match="give 2 finite numbers, a1, b0"):
        free_run(Arx(), [1.0], [1, 2], [1, 2])
