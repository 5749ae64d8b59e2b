"""The result of a diagnosis: plain data as documented, and words that agree with it."""

import json
from functools import lru_cache

import numpy as np
import pytest

from smid import Dataset, Model, ModelError, OwnModel
from smid.diagnosis import Diagnosis, diagnose
from smid.models.simulate import simulate
from tests.smid.diagnosis.lag_records import BOUND, LAG, dead_zone, known_lag, lag, record, steps

GAIN = {
    f"{figure}_{when}"
    for figure in ("rmse", "fit_percent", "noise_bound", "violations")
    for when in ("before", "after")
}
CAUSE = {"effect", "label", "sentence", "confidence", "parameters", "rivals", "evidence"}
WHOLE = {
    *(
        "schema",
        "verdict",
        "causes",
        "gain",
        "held_samples",
        "misfit",
        "shortened",
        "faults",
        "proof",
        "experiment",
        "skipped",
    ),
    *("failed", "dropped", "unexplained", "interrupted", "base", "model", "data", "details", "doubts", "test_samples"),
    *("name_proof", "alternatives"),
}


@lru_cache
def of(verdict: str) -> Diagnosis:
    """A diagnosis that ends so; the first two with a noise bound and a try at a proof."""
    if verdict == "ambiguous":
        u = np.repeat(np.random.default_rng(1).integers(0, 2, 60), 4).astype(float)
        return diagnose(known_lag(), record(u, lag(0.7 * u)), None, ["gain", "input_saturation"], workers=1)
    u = steps(1, 240)
    w = lag(dead_zone(u, 0.3) if verdict == "named" else u)
    return diagnose(LAG, record(u, w), BOUND, ["input_dead_zone", "missing_input"], workers=1)


VERDICTS = pytest.mark.parametrize("verdict", ["named", "none", "ambiguous"])


@VERDICTS
def test_it_is_plain_data_with_the_documented_keys(verdict):
    diagnosis = of(verdict)
    assert diagnosis.verdict == verdict
    plain = json.loads(json.dumps(diagnosis.to_dict(), allow_nan=False))
    assert set(plain) == WHOLE
    assert plain["verdict"] == verdict
    assert set(plain["gain"]) == GAIN
    for cause in plain["causes"]:
        assert set(cause) == CAUSE
        for parameter in cause["parameters"].values():
            assert set(parameter) == {"unit", "value", "lower", "upper", "null", "proven"}
        for rival in cause["rivals"]:
            assert set(rival) == {"effect", "rmse", "odds", "why", "model"}
    assert [c["effect"] for c in plain["causes"]] == [c.effect for c in diagnosis.causes]
    assert plain["held_samples"] == sum(int(h.sum()) for h in diagnosis.test)


@VERDICTS
def test_the_model_comes_back_from_it(verdict):
    diagnosis = of(verdict)
    back = Model.from_dict(json.loads(json.dumps(diagnosis.to_dict()["model"])))
    assert back.values == diagnosis.model.values
    assert [p.name for p in back.parameters] == [p.name for p in diagnosis.model.parameters]
    first = back.simulate(diagnosis.data).outputs[0]["y"]
    assert first == pytest.approx(diagnosis.model.simulate(diagnosis.data).outputs[0]["y"])


@VERDICTS
def test_the_words_agree_with_the_data(verdict):
    diagnosis = of(verdict)
    said = str(diagnosis)
    assert diagnosis.conclusion in said
    assert diagnosis.misfit.sentence in said
    for cause in diagnosis.causes:
        assert cause.sentence in said
    assert all(0 <= cause.confidence <= 1 for cause in diagnosis.causes)
    assert (diagnosis.experiment is not None) == (verdict == "ambiguous")
    assert bool(diagnosis.alternatives) == (verdict == "ambiguous")


def test_a_proof_comes_with_a_misfit_and_only_there():
    assert of("named").proof is not None
    assert of("named").proof.sentence in str(of("named"))
    assert of("none").proof is None
    assert of("ambiguous").proof is None, "there was no noise bound"


def test_only_what_is_named_extends_the_model():
    assert of("none").model is of("none").base
    assert of("none").new_parameters == ()
    named = of("named")
    assert set(named.new_parameters) == {p.name for p in named.model.parameters} - {
        p.name for p in named.base.parameters
    }
    assert named.skipped == {"missing_input": "a further measured channel that moves"}


def test_the_data_and_the_base_model_are_left_as_they_were():
    u = steps(1, 240)
    data = record(u, lag(u))
    checksum, values = data.checksum, dict(LAG.values)
    diagnose(LAG, data, None, ["sensor_bias"], certify=False, workers=1)
    assert data.checksum == checksum
    assert LAG.values == values


def two_levels():
    """Return a model of two tanks in a row, and their record: the sensor of the second level has a bias."""
    model = OwnModel(
        ["a[t] = p*a[t-1] + k*u[t-1]", "b[t] = q*b[t-1] + k*a[t-1]"],
        outputs={"upper": "a", "lower": "b"},
        inputs=["u"],
        parameters={"p": (0, 0.95), "q": (0, 0.95), "k": (0, 2)},
    )
    random = np.random.default_rng(0)
    u = np.repeat(random.uniform(0, 1, 30), 10)
    runs = simulate(model, {"u": u}, {"p": 0.7, "q": 0.8, "k": 0.4})
    noise = {name: runs[name] + random.uniform(-0.01, 0.01, u.size) for name in ("upper", "lower")}
    noise["lower"] += 0.5
    return model, Dataset.from_arrays(input={"u": u}, output=noise, sampling_time=1.0)


def test_each_of_several_outputs_can_be_diagnosed():
    model, data = two_levels()
    first = diagnose(model, data, {"upper": 0.02, "lower": 0.02}, ["sensor_bias"], certify=False, workers=1)
    assert first.output == "upper"
    assert "The diagnosis is about upper, not about the output lower." in first.shortened
    found = diagnose(
        model, data, {"upper": 0.02, "lower": 0.02}, ["sensor_bias"], output="lower", certify=False, workers=1
    )
    assert found.output == "lower"
    assert [cause.effect for cause in found.causes] == ["sensor_bias"]
    with pytest.raises(ModelError, match="'u' is no output of the model: choose among upper, lower"):
        diagnose(model, data, output="u")
