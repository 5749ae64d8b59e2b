"""The misfit: white errors have no structure, planted dependences are found with their share."""

import json
from collections import Counter
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter

from smid.data import DataError, Dataset
from smid.diagnosis.evidence.misfit import misfit
from smid.diagnosis.evidence.structure import input_direction

UNITS = {"current": "A", "pressure": "bar", "temperature": "°C"}


def record(seed, error=None, n=600, kind="smooth"):
    """A free run, and a measurement that differs from it by white noise of 0.1 bar and a given error."""
    random = np.random.default_rng(seed)
    if kind == "smooth":
        u = lfilter([0.1], [1, -0.9], np.repeat(random.uniform(0, 2, n), 15)[:n])
    elif kind == "prbs":
        u = np.repeat(random.choice([0.0, 1.0], n), 7)[:n]
    else:
        u = random.standard_normal(n)
    free = lfilter([0.5], [1, -0.9], u)
    temperature = 20 + np.cumsum(random.standard_normal(n)) * 0.2
    added = 0.0 if error is None else error(SimpleNamespace(t=np.arange(n), u=u, y=free, x=temperature))
    y = free + 0.1 * random.standard_normal(n) + added
    data = Dataset.from_arrays(
        input={"current": u}, output={"pressure": y}, sampling_time=0.02, units=UNITS, temperature=temperature
    )
    return data, free


def shares(found):
    return {s.kind: s.share for s in found.structure}


def test_white_errors_have_no_structure():
    count = Counter()
    for seed in range(120):
        data, free = record(seed, n=(150, 400, 900)[seed % 3], kind=("smooth", "prbs", "white")[seed % 3 - 1])
        found = misfit(data, "pressure", [free])
        assert max(s.share for s in found.structure) < 0.15
        count.update(kind for kind, share in shares(found).items() if share > 0)
    assert all(times <= 3 for times in count.values()), count


def test_a_correlated_error_is_its_own_past_and_little_else():
    others = 0
    for seed in range(60):
        data, free = record(seed)
        slow = 0.1 * lfilter([1.0], [1, -0.7], np.random.default_rng(seed).standard_normal(600))
        found = misfit(with_output(data, free + slow), "pressure", [free])
        assert shares(found)["own past"] == pytest.approx(0.49, abs=0.15)
        others += sum(s.share > 0 for s in found.structure if s.kind != "own past")
    assert others <= 12  # of 600


def with_output(data, y):
    run = data.experiments[0]
    return data.with_experiments([type(run)(run.name, {**run.values, "pressure": y}, run.start_time)])


ERRORS = {
    "mean": lambda r: 0.2 + 0 * r.t,
    "time": lambda r: 0.3 * (r.t > 250),
    "input level": lambda r: 0.3 * (r.u > np.quantile(r.u, 0.7)),
    "input direction": lambda r: 0.3 * np.isin(input_direction(r.u), (1, 3)),
    "output level": lambda r: 0.4 * (r.y < np.quantile(r.y, 0.3)),
    "velocity": lambda r: 0.8 * np.abs(np.gradient(r.y)) / np.abs(np.gradient(r.y)).max() ** 1.0,
    "velocity sign": lambda r: 0.3 * np.sign(np.gradient(r.y)),
    "channel": lambda r: 0.3 * (r.x > np.median(r.x)),
    "frequency": lambda r: 0.3 * np.sin(2 * np.pi * 0.02 * 3.1 * r.t),
    "past inputs": lambda r: 0.5 * np.roll(r.u, 5),
}


@pytest.mark.parametrize("kind", ERRORS)
def test_what_the_error_depends_on_is_found(kind):
    told, expected = [], []
    for seed in range(15):
        smooth = kind not in ("frequency", "past inputs")
        data, free = record(seed, ERRORS[kind], kind="smooth" if smooth else "white")
        found = misfit(data, "pressure", [free], skip=10)
        told.append(shares(found)[kind])
        run = data.experiments[0].values
        known = SimpleNamespace(t=np.arange(600), u=run["current"], y=free, x=run["temperature"])
        added = ERRORS[kind](known)[10:]
        power = np.mean(added**2) if kind == "mean" else np.var(added)
        expected.append(power / (power + 0.01))
    assert np.sum(np.array(told) > 0) >= 13
    assert np.median(told) == pytest.approx(np.median(expected), abs=0.15)


def test_the_line_of_the_spectrum_is_at_its_frequency():
    data, free = record(1, ERRORS["frequency"], kind="white")
    (line,) = [s for s in misfit(data, "pressure", [free]).structure if s.kind == "frequency"]
    assert line.at == pytest.approx(3.1, abs=0.1)
    assert "Hz" in line.sentence


def test_the_sentence_says_where_and_how_much():
    data, free = record(0, ERRORS["input direction"])
    found = misfit(data, "pressure", [free], noise_bound=0.3)
    assert "bar (RMSE" in found.sentence
    assert "current falls" in found.sentence
    assert "exceeds the noise bound of 0.3 bar" in found.sentence
    assert found.sentence.splitlines() == [found.sentence]
    assert "error against" in str(found)
    white, run = record(0)
    assert "depends on nothing that was measured" in misfit(white, "pressure", [run]).sentence


def test_numbers_follow_their_definitions():
    data, free = record(2)
    found = misfit(data, "pressure", [free], noise_bound=0.15, skip=7)
    e = (data.values("pressure") - free)[7:]
    y = data.values("pressure")[7:]
    assert found.samples == e.size
    assert found.rmse == pytest.approx(np.sqrt(np.mean(e**2)))
    assert found.fit_percent == pytest.approx(100 * (1 - np.linalg.norm(e) / np.linalg.norm(y - y.mean())))
    assert found.largest == np.abs(e).max()
    assert found.violations.count == np.sum(np.abs(e) > 0.15)
    assert sum(one.samples for one in found.violations.intervals) == found.violations.count
    assert found.violations.first[0][1] == data.time()[7 + np.flatnonzero(np.abs(e) > 0.15)[0]]


def test_violations_close_together_are_one_stretch():
    y = np.zeros(200)
    y[[50, 51, 53, 120]] = 1.0
    data = Dataset.from_arrays(input=np.arange(200.0), output=y, sampling_time=0.5)
    stretches = misfit(data, "output", [np.zeros(200)], noise_bound=0.5).violations.intervals
    assert [(s.start, s.stop, s.samples) for s in stretches] == [(25.0, 26.5, 3), (60.0, 60.0, 1)]


def test_experiments_that_differ_show_in_time():
    parts = [record(seed, lambda r, s=seed: 0.3 * s + 0 * r.t, n=200) for seed in (0, 1)]
    data = parts[0][0].with_experiments(
        [type(d.experiments[0])(f"run{k}", d.experiments[0].values) for k, (d, _) in enumerate(parts)]
    )
    found = misfit(data, "pressure", [free for _, free in parts], noise_bound=0.3)
    assert shares(found)["time"] > 0.5
    assert {one.experiment for one in found.violations.intervals} >= {"run1"}
    assert found.plot().axes


@pytest.mark.parametrize("case", ["perfect", "short", "constant", "big"])
def test_odd_records_do_not_break_it(case):
    n = 12 if case == "short" else 300
    y = np.ones(n) if case == "constant" else np.sin(np.arange(n))
    if case == "big":
        y = 1e9 * y
    data = Dataset.from_arrays(input=np.ones(n), output=y, sampling_time=1.0)
    found = misfit(data, "output", [y if case == "perfect" else 0.9 * y], noise_bound=0.05)
    json.dumps(found.to_dict(), allow_nan=False)
    assert str(found)
    assert found.plot().axes


def test_the_dictionary_is_json():
    data, free = record(3, ERRORS["time"])
    plain = json.loads(json.dumps(misfit(data, "pressure", [free], noise_bound=0.2).to_dict(), allow_nan=False))
    assert plain["structure"][0]["bins"] == [] or plain["structure"][0]["bins"][0]["samples"] > 0
    assert plain["violations"]["count"] > 0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"channel": "current"}, "no output"),
        ({"simulated": []}, "one for each"),
        ({"simulated": [np.zeros(3)]}, "shape"),
        ({"simulated": [np.full(600, np.inf)]}, "unstable"),
        ({"noise_bound": 0.0}, "not positive"),
        ({"skip": 600}, "longer record"),
        ({"input": "curent"}, "did you mean"),
    ],
)
def test_mistakes_are_told(change, message):
    data, free = record(0)
    with pytest.raises(DataError, match=message):
        misfit(**{"data": data, "channel": "pressure", "simulated": [free], **change})
