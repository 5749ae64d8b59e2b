"""What was written comes back: the same plain data, the same words, and figures as soon as the record is there."""

import dataclasses
import json
import math
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache

import numpy as np
import pytest

import smid
from smid.data.columns import Table
from smid.data.overview import overview
from smid.display.from_plain import from_plain
from smid.identification.identify import EmptyFeasibleSetError
from smid.reports import documents
from smid.sensors import CFPX, sensor_to_dict

U, Y = [1.0, 0, 1, 1, 0, 0, 1, 0], [0.0, 1, 0.5, 1.3, 1.6, 0.8, 0.4, 1.2]
DATA = smid.Dataset.from_arrays(input={"u": U}, output={"y": Y}, sampling_time=0.1, units={"y": "bar"})
MODEL = smid.OutputError(stable=True)


@lru_cache
def estimated():
    return smid.identify(MODEL, DATA, 0.1)


@lru_cache
def noisy():
    rng = np.random.default_rng(1)
    u = np.repeat(rng.uniform(-1, 1, 40), 6)
    v, w = np.sign(u) * np.maximum(np.abs(u) - 0.3, 0), np.zeros(240)
    for k in range(1, 240):
        w[k] = 0.7 * w[k - 1] + 0.3 * v[k - 1]
    y = w + rng.uniform(-0.01, 0.01, 240)
    return smid.Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=0.1, units={"y": "bar"})


@lru_cache
def diagnosed():
    effects = ["input_dead_zone", "missing_input"]
    return smid.diagnose(smid.OutputError(1, stable=True), noisy(), 0.01, effects, workers=1)


@lru_cache
def studied():
    with ThreadPoolExecutor(1) as executor:
        return smid.order_study(MODEL, DATA, [0.1, 0.001], orders=[1], executor=executor)


def simulated():
    return smid.OutputError().with_values({"a1": -0.5, "b0": 1.0})


RESULTS = {
    "estimate": estimated,
    "validation": lambda: smid.validate(simulated(), DATA, 0.1),
    "fit": lambda: smid.fit(MODEL, DATA),
    "comparison": lambda: smid.compare([simulated(), estimated()], DATA),
    "residuals": lambda: smid.residuals(simulated(), noisy()),
    "diagnosis": diagnosed,
    "study": studied,
    "response": lambda: smid.step(estimated(), 5),
    "projections": lambda: smid.projections(estimated()),
}


def written(content, tmp_path):
    path = tmp_path / "result.json"
    path.write_text(json.dumps(content), encoding="utf-8")
    return path


@pytest.mark.parametrize("name", RESULTS)
def test_a_result_comes_back(name, tmp_path):
    result = RESULTS[name]()
    own = result.to_dict()
    path = written({"schema": own.pop("schema", type(result).SCHEMA), **own}, tmp_path)
    for again in (smid.load(path), smid.load(path, data=noisy() if name in ("residuals", "diagnosis") else DATA)):
        assert type(again) is type(result)
        assert again.to_dict() == result.to_dict()
        assert again == result
        assert str(again) == str(result)
        assert again._repr_html_().startswith(result._repr_html_()[:300])
        assert again.to_pandas().equals(result.to_pandas())
    assert again.plot().axes


@pytest.mark.parametrize("name", [name for name in RESULTS if name not in ("validation", "response", "projections")])
def test_a_written_report_is_loaded(name, tmp_path):
    result = RESULTS[name]()
    again = smid.load(smid.report(result, tmp_path / "result.json"))
    assert again == result
    with pytest.raises(smid.DataError, match=r"are not in the file of this result: .* smid.load\(path, data=record\)"):
        smid.report(again, tmp_path / "again.html")
    assert not (tmp_path / "again.html").exists()


def test_a_loaded_diagnosis_keeps_the_models_of_its_rivals(named, tmp_path):
    again = smid.load(smid.report(named, tmp_path / "why.json"))
    rivals = named.causes[0].rivals
    assert rivals
    assert [rival.model for rival in again.causes[0].rivals] == [rival.model for rival in rivals]


def inside(key, content):
    return {"schema": {"error_bound": documents.ERROR_BOUND, "verification": documents.VERIFY}[key], key: content}


def test_results_without_a_record_come_back(tmp_path):
    bound = smid.error_bound(MODEL, DATA)
    unknown = dataclasses.replace(bound, upper=math.inf, parameters={})
    smid.identify(MODEL, DATA, 0.1, certificate=tmp_path / "proof.json")
    proof = smid.verify(tmp_path / "proof.json", DATA)
    seen = overview(Table("run", "run.csv", {"time": ("0", "1", "3", "4"), "y": ("5", "", "6", "7")}))
    sensor = CFPX(order=3)
    for result, content in (
        (bound, documents.error_bound_document(bound, MODEL, DATA)),
        (unknown, documents.error_bound_document(unknown, MODEL, DATA)),
        (proof, {"schema": documents.VERIFY, "verification": proof.to_dict()}),
        (seen, {"schema": documents.SHOW, "overview": seen.to_dict()}),
    ):
        again = smid.load(written(content, tmp_path))
        assert type(again) is type(result)
        assert (again.to_dict(), str(again)) == (result.to_dict(), str(result))
    with pytest.raises(smid.DataError, match="the samples are not in the file"):
        again.plot()
    assert sensor_to_dict(smid.load(written(sensor_to_dict(sensor), tmp_path))) == sensor_to_dict(sensor)


def test_a_proof_of_emptiness_is_returned_not_raised(tmp_path):
    with pytest.raises(EmptyFeasibleSetError) as raised:
        smid.identify(MODEL, DATA, 0.001)
    again = smid.load(written(documents.empty_document(raised.value, None), tmp_path))
    assert isinstance(again, EmptyFeasibleSetError)
    assert (again.to_dict(), again.samples) == (raised.value.to_dict(), raised.value.samples)


def test_a_loaded_estimate_works_as_the_one_that_was_written(tmp_path):
    again = smid.load(smid.report(estimated(), tmp_path / "estimate.json"))
    assert again.parameters == estimated().parameters
    assert (again["a1"], again.summary, hash(again)) == (estimated()["a1"], estimated().summary, hash(estimated()))
    assert smid.validate(again, DATA, 0.1).to_dict() == smid.validate(estimated(), DATA, 0.1).to_dict()
    assert smid.compare({"loaded": again, "own": estimated()}, DATA).best
    with pytest.raises(smid.ModelError, match="sampling time"):
        smid.validate(again, dataclasses.replace(DATA, sampling_time=0.2))
    with pytest.raises(smid.DataError, match="are not in the file"):
        smid.identify(MODEL, again.data, 0.1)


def test_several_validations_are_a_tuple(tmp_path):
    runs = tuple(smid.validate(simulated(), DATA, bound) for bound in (0.1, 0.2))
    assert smid.load(written(documents.validate_document(runs), tmp_path)) == runs
    assert smid.load(written(documents.validate_document(runs[:1]), tmp_path)) == runs[0]


def test_the_runs_of_a_loaded_diagnosis_are_those_of_the_search(tmp_path):
    found = diagnosed()
    again = smid.load(smid.report(found, tmp_path / "diagnosis.json"), data=noisy())
    for ours, theirs in ((again.simulated, found.simulated), (again.extended, found.extended)):
        np.testing.assert_allclose(ours[0][found.test[0]], theirs[0][found.test[0]], atol=1e-3)
    assert (again.test[0] == found.test[0]).all()
    assert again.misfit.plot().axes
    assert smid.report(again, tmp_path / "again.html").exists()


def test_missing_runs_of_a_study_come_back(tmp_path):
    whole = studied()
    cut = dataclasses.replace(whole, outcomes=(None, *whole.outcomes[1:]), interrupted=True)
    again = smid.load(smid.report(cut, tmp_path / "study.json"), data={"experiment": DATA})
    assert again == cut
    assert again.conclusion == cut.conclusion


def test_another_record_is_refused(tmp_path):
    path = smid.report(estimated(), tmp_path / "estimate.json")
    with pytest.raises(smid.DataError, match=r"estimate\.json: the result is about another record"):
        smid.load(path, data=noisy())
    with pytest.raises(TypeError, match=r"the data are a tuple, not a Dataset"):
        smid.load(path, data=(U, Y))


def test_mistakes_are_told_in_one_line_with_file_key_and_cure(tmp_path):
    good = estimated().to_dict()
    lower = json.loads(json.dumps(good))
    lower["parameters"][1]["lower"] = "low"
    gone = {key: value for key, value in good.items() if key != "stopped"}
    for content, words in (
        ("{", ["is not valid JSON", "give a file"]),
        ("[]", ["holds no result", "give a file"]),
        ({"a": 1}, ["schema None", "give a file"]),
        ({"schema": "smid.clutch-records/1"}, ["smid.clutch-records/1", "give a file"]),
        ({**good, "schema": "smid.estimate/2"}, ["smid.estimate/2", "smid.estimate/1", "use the version"]),
        ({"schema": documents.IDENTIFY}, ["estimate or empty: the key is missing", "write it again"]),
        ({"schema": documents.IDENTIFY, "estimate": 3}, ["is not an object", "write it again"]),
        (gone, ["stopped: the key is missing", "write it again"]),
        (lower, ["parameters[1].lower: 'low' is not a float", "write it again"]),
        ({**good, "stopped": "never"}, ["stopped: 'never' is none of tight", "write it again"]),
        ({**good, "model": {}}, ["the stored model lacks"]),
    ):
        path = tmp_path / "estimate.json"
        path.write_text(content if isinstance(content, str) else json.dumps(content))
        with pytest.raises((smid.DataError, smid.ModelError)) as raised:
            smid.load(path)
        message = str(raised.value)
        assert "\n" not in message
        for word in (str(path), *words):
            assert word in message
    with pytest.raises(smid.DataError, match="no file"):
        smid.load(tmp_path / "none.json")
    path = written(documents.error_bound_document(smid.error_bound(MODEL, DATA), MODEL, DATA), tmp_path)
    with pytest.raises(smid.DataError, match="needs no record: leave out data"):
        smid.load(path, data=DATA)


def test_no_number_passes_as_another_type():
    for kind, value in ((float, True), (int, 1.5), (bool, 1), (str, 1), (tuple[int, ...], {}), (dict[str, int], [])):
        with pytest.raises(ValueError, match=" is not a"):
            from_plain(kind, value)


def test_results_are_collections_of_what_they_hold():
    estimate, diagnosis = estimated(), diagnosed()
    assert len(estimate) == len(MODEL.parameters)
    assert [interval.name for interval in estimate] == [p.name for p in MODEL.parameters]
    assert "a1" in estimate
    assert estimate["a1"] in estimate
    assert "c9" not in estimate
    run = smid.validate(simulated(), DATA)
    assert (len(run), next(iter(run))) == (1, run.scores[0])
    comparison = smid.compare({"own": simulated(), "found": estimate}, DATA)
    assert set(comparison) == {"own", "found"}
    assert comparison[comparison.best] is comparison.validations[comparison.best]
    assert [cause.effect for cause in diagnosis] == ["input_dead_zone"]
    assert "input_dead_zone" in diagnosis
    nothing = dataclasses.replace(diagnosis, causes=())
    assert (len(nothing), bool(nothing)) == (0, True)


def test_equal_results_have_the_same_hash_and_other_results_differ():
    again = smid.validate(simulated(), DATA, 0.1)
    assert {again, smid.validate(simulated(), DATA, 0.1)} == {again}
    assert again != smid.validate(simulated(), DATA, 0.2)
    assert estimated() != again


def damaged(content):
    """Yield copies of plain data, each with one key gone or one value of another kind; of a list, the first item."""
    places = content if isinstance(content, dict) else range(min(len(content), 1)) if isinstance(content, list) else ()
    for place in places:
        for other in (object, 7, "word", [], {}, None):
            copy = content.copy()
            if other is object:
                del copy[place]
            else:
                copy[place] = other
            yield copy
        for inner in damaged(content[place]):
            copy = content.copy()
            copy[place] = inner
            yield copy


@pytest.mark.parametrize("name", RESULTS)
def test_damage_anywhere_never_gives_a_traceback(name, tmp_path):
    result = RESULTS[name]()
    own = {"schema": type(result).SCHEMA, **result.to_dict()}
    copies, told = list(damaged(own)), []
    for k in np.random.default_rng(0).permutation(len(copies))[:200]:
        try:
            smid.load(written(copies[k], tmp_path))
        except (smid.DataError, smid.ModelError) as error:
            told.append(str(error))
    assert len(told) > 50
    assert all("\n" not in message and "result.json" in message for message in told)
