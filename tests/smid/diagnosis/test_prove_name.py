"""The proof of the name: what is proven agrees with other arithmetic, and a proof that fails costs only itself."""

import json
import time
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import sympy
from scipy.optimize import minimize_scalar
from scipy.signal import lfilter

from relaxations.check import main as program
from smid.data import DataError
from smid.diagnosis import certify_name, diagnose, prove_name
from smid.diagnosis.proof import decide as deciding
from smid.diagnosis.proof import name as naming
from smid.diagnosis.proof.decide import Decision, Status, decide
from smid.diagnosis.proof.window import Window, windows
from smid.fitting.fit import fit
from smid.models import ModelError, OutputError, OwnModel, Parameter, signal, t
from smid.verification import verify
from tests.smid.diagnosis.lag_records import BOUND, GAIN, LAG, POLE, dead_zone, lag, least_bound, record, steps

BOUNDS = {"y": BOUND}


@pytest.fixture(scope="module")
def found():
    u = steps(1, 300)
    return diagnose(
        LAG,
        record(u, lag(dead_zone(u, 0.3))),
        BOUND,
        ["input_dead_zone", "gain", "sensor_bias"],  # a proof on a delay takes its whole time limit
        workers=1,
    )


@pytest.fixture(scope="module")
def proven(found):
    return prove_name(found, BOUND, 60)  # a first run compiles within the time


def least_bound_of_all(u, y):
    """Return the least noise bound of the lag over all poles."""

    def at(pole):
        return least_bound(u, y, pole)

    grid = np.linspace(-0.99, 0.99, 40)
    best = grid[np.argmin([at(pole) for pole in grid])]
    return minimize_scalar(at, bounds=(best - 0.06, best + 0.06), method="bounded", options={"xatol": 1e-6}).fun


@pytest.mark.parametrize("seed", range(8))
def test_both_answers_agree_with_a_linear_program(seed):
    """Small dead zones are within the noise, large ones are not; either answer has to be right."""
    u = steps(seed, 120)
    data = record(u, lag(dead_zone(u, 0.04 * seed)), seed)
    window = Window(0, 30, 79)
    answer = decide(fit(LAG, data).model, data, window, BOUNDS, 20).status
    least = least_bound_of_all(u[30:80], data.values("y")[30:80])
    assert answer is (Status.EXCLUDED if least > BOUND else Status.FEASIBLE)


@pytest.mark.parametrize("seed", range(8))
def test_the_truth_is_never_excluded(seed):
    """With odd seeds the noise sits on its bound."""
    u = steps(seed, 200)
    clean = lag(dead_zone(u, 0.3))
    noise = BOUND * (1 - 1e-9) * np.random.default_rng(seed).choice([-1.0, 1.0], len(u))
    data = record(u, clean + noise, bound=0.0) if seed % 2 else record(u, clean, seed)
    zone = Parameter("zone", 0, 1)
    read = signal("u")[t - 1]
    dead = sympy.Max(read - zone.symbol, 0) - sympy.Max(-read - zone.symbol, 0)
    model = LAG.replace_line("w", LAG.lines[0].expression.subs(read, dead), [zone])
    truth = model.with_values({"a1": -POLE, "b0": GAIN, "zone": 0.3})
    answer = decide(truth, data, Window(0, 100, 139), BOUNDS, 20)
    assert answer.status is not Status.EXCLUDED
    assert seed % 2 or answer.status is Status.FEASIBLE


def test_a_limit_on_a_hidden_signal_is_verified_too():
    """Nothing bounds the signal inside Min before its value is known."""
    u = steps(3, 120)
    limit = Parameter("limit", 0, 5)
    model = LAG.insert_sensor("y", lambda w: sympy.Min(w, limit.symbol), [limit])
    truth = model.with_values({"a1": -POLE, "b0": GAIN, "limit": 0.8})
    data = record(u, np.minimum(lag(u), 0.8))
    assert decide(truth, data, Window(0, 20, 59), BOUNDS, 20).status is Status.FEASIBLE


@pytest.mark.parametrize(("begin", "status"), [(0, Status.FEASIBLE), (5.0, Status.EXCLUDED)])
def test_a_clock_counts_from_the_start_of_the_record(begin, status):
    """Only the gain is free; the drift of the second record is as if the clock had begun elsewhere."""
    u = steps(4, 200)
    step = sympy.Rational(1, 10)
    model = OutputError(fixed={"a1": -POLE}).bound(b0=(0, 1)).with_values({"b0": GAIN})
    model = model.with_line("time", signal("time")[t - 1] + step)
    model = model.add_term("w", signal("time")[t] / 100)
    data = record(u, lag(u) + lfilter([0.01], [1.0, -POLE], np.arange(200) / 10 - begin))
    assert decide(model, data, Window(0, 150, 189), BOUNDS, 20).status is status


@pytest.mark.parametrize(
    ("excess", "status"), [(-0.01, Status.FEASIBLE), (0.0, Status.UNDECIDED), (0.01, Status.EXCLUDED)]
)
def test_a_model_without_a_free_number_is_decided(excess, status):
    """The error of one sample is at the noise bound, but for rounding: then nothing is proven, and the search ends."""
    u = np.linspace(0.5, 1.5, 12)
    model = OwnModel(["w[t] = exp(-a)*u[t]"], {"y": "w"}, ["u"], {"a": (0.5, 0.5)}).with_values({"a": 0.5})
    y = np.exp(-0.5) * u
    y[5] += BOUND + excess
    found = decide(model, record(u, y, bound=0.0), Window(0, 0, 11), BOUNDS, 20)
    assert found.status is status
    assert "failed" not in found.reason


def test_windows_lie_within_each_other_around_the_largest_error():
    rng = np.random.default_rng(0)
    for _ in range(50):
        residual = [rng.normal(size=int(n)) for n in rng.integers(30, 400, 2)]
        found = list(windows(residual))
        worst = int(np.argmax([np.abs(r).max() for r in residual]))
        for one in found:
            assert one.experiment == worst
            assert 0 <= one.first <= one.last < len(residual[worst])
        for inner, outer in pairwise(found):
            assert outer.first <= inner.first <= inner.last <= outer.last
            assert outer.last - outer.first > inner.last - inner.first


def test_the_name_is_proven_on_the_same_samples(found, proven):
    proof = proven.name_proof
    assert found.causes[0].effect == "input_dead_zone"
    assert proof.base.excluded
    assert proof.extended.status is Status.FEASIBLE
    assert (proof.extended.first, proof.extended.last) == (proof.first, proof.last)
    assert set(proof.rivals) == {r.effect for r in found.causes[0].rivals}
    assert proof.rivals["gain"].excluded, "a gain leaves the lag as it is"
    for decision in (proof.base, *proof.rivals.values()):
        assert proof.first <= decision.first <= decision.last <= proof.last
        assert all(decision.first <= k <= decision.last and share > 0 for k, share in decision.samples)
    u, y = (found.data.values(c)[proof.base.first : proof.base.last + 1] for c in ("u", "y"))
    assert least_bound_of_all(u, y) > BOUND
    assert proof.last < int(np.flatnonzero(found.test[0])[0]), "the test part is not used"


def test_the_statement_is_about_the_longest_window_on_which_the_extended_model_is_verified(found, proven):
    """Here these are all the samples before the test part; a spike in them leaves only shorter windows."""
    last = int(np.flatnonzero(found.test[0])[0]) - 1
    assert (proven.name_proof.first, proven.name_proof.last) == (0, last)
    worst = int(np.argmax(np.abs(found.data.values("y") - found.simulated[0])[: last + 1]))
    y = found.data.values("y").copy()
    y[(worst + last // 2) % last] += 8 * BOUND  # half of the record away from what the windows grow around
    spoiled = replace(found, data=record(found.data.values("u"), y, bound=0.0), proof=None)
    proof = prove_name(spoiled, BOUND, 20).name_proof
    assert proof.extended.status is Status.FEASIBLE
    assert proof.last - proof.first < last


def test_a_decision_on_a_window_says_what_it_says_of_a_part():
    """Excluded by samples of a part is excluded there; a run that fits a longer part fits."""
    race = deciding.Race([LAG] * 4, None, Window(0, 0, 99), BOUNDS)
    race.decisions[0] = Decision(Status.EXCLUDED, 20, 39, ((30, 1.0),), "", 0.0)
    race.decisions[1] = Decision(Status.FEASIBLE, 0, 99, (), "", 0.0)
    race.parts[2] = Window(0, 10, 59)
    kinds = {"whole": Window(0, 0, 99), "both": Window(0, 10, 59), "short": Window(0, 30, 49)}
    found = {name: [one.status.value for one in race.on(part)] for name, part in kinds.items()}
    assert found == {
        "whole": ["excluded", "feasible", "undecided", "undecided"],
        "both": ["excluded", "feasible", "feasible", "undecided"],
        "short": ["undecided", "feasible", "feasible", "undecided"],
    }
    for part in kinds.values():
        assert all(part.first <= one.first <= one.last <= part.last for one in race.on(part))
    assert race.on(kinds["short"])[0].reason == "it is excluded by samples 20 to 39"


def test_a_model_without_end_leaves_the_others_their_time(monkeypatch):
    """What seems nearest to its end is next, and the others get a share of the steps."""
    steps_of = {"slow": 0, "favoured": 0}

    def deciding_of(model, _data, window, *_rest):
        if model == "quick":
            yield 5.0
            yield Decision(Status.EXCLUDED, window.first, window.last, ((0, 1.0),), "", 0.0)
        while True:
            steps_of[model] += 1
            time.sleep(0.002)
            yield 30.0

    monkeypatch.setattr(deciding, "_deciding", deciding_of)
    race = deciding.Race(["slow", "quick", "favoured", None], None, Window(0, 0, 9), BOUNDS, weights={2: 3.0})
    race.run(0.4)
    assert [one.status for one in race.decisions] == [Status.UNDECIDED, Status.EXCLUDED, *[Status.UNDECIDED] * 2]
    assert race.decisions[1].seconds < 0.1
    assert race.decisions[0].reason == "the time allowed is used up"
    assert 2 * steps_of["slow"] < steps_of["favoured"]
    assert steps_of["slow"] > 10


def test_words_data_and_rivals_say_the_same(found, proven):
    proof = proven.name_proof
    said = str(proven)
    assert proof.title in said
    assert proven.proof.sentence in said
    for rival in proven.causes[0].rivals:
        assert rival.why.endswith("; excluded by proof") == proof.rivals[rival.effect].excluded
        assert ("in place of input_dead_zone" in said) == bool(proof.rivals)
    plain = json.loads(json.dumps(proven.to_dict(), allow_nan=False))["name_proof"]
    assert set(plain) == {
        *("noise_bound", "unit", "experiment", "first", "last", "causes", "base", "extended", "against", "rivals"),
        *("interrupted", "seconds", "title"),
    }
    assert set(plain["base"]) == {"status", "first", "last", "samples", "reason", "seconds", "certificate"}
    assert plain["base"]["status"] == "excluded"
    assert found.name_proof is None


def test_a_method_that_raises_costs_only_the_proof(found, monkeypatch):
    def broken(*_arguments, **_settings):
        raise RuntimeError("no luck")

    monkeypatch.setattr(deciding, "posed", broken)
    proof = prove_name(replace(found, proof=None), BOUND, 5).name_proof
    assert proof.base.status is Status.UNDECIDED
    assert proof.base.reason == "failed with RuntimeError: no luck"


def test_no_time_decides_nothing_and_raises_nothing(found):
    proof = prove_name(replace(found, proof=None), BOUND, 1e-6).name_proof
    assert proof.base.status is Status.UNDECIDED
    assert proof.extended.status is Status.UNDECIDED


def test_what_the_diagnosis_has_proven_is_taken_over(found, proven):
    """At its own noise bound; at a larger one it would be a weaker statement."""
    assert found.proof.samples == proven.name_proof.base.samples
    assert prove_name(found, 1.0, 20).name_proof.base.status is Status.FEASIBLE


@pytest.mark.parametrize("decided", [0, 1])
def test_ctrl_c_keeps_what_was_proven(found, monkeypatch, decided):
    """The base model is decided at once, or nothing is."""
    begun = iter(range(100))

    def until(_model, _data, window, *_rest):
        if next(begun) >= decided:
            raise KeyboardInterrupt
        yield Decision(Status.FEASIBLE, window.first, window.last, (), "", 0.0)

    monkeypatch.setattr(deciding, "_deciding", until)
    monkeypatch.setattr(naming, "fitted", lambda *_: None)
    if decided:
        proof = prove_name(replace(found, proof=None), BOUND, workers=1).name_proof
        assert proof.interrupted
        assert "(interrupted)" in proof.title
        assert proof.base.status is Status.FEASIBLE
    else:
        with pytest.raises(KeyboardInterrupt):
            prove_name(replace(found, proof=None), BOUND, workers=1)


def test_an_effect_on_the_noise_cannot_be_posed(found):
    first, *rest = found.causes
    rival = replace(first.rivals[0], model=None)
    changed = replace(found, causes=(replace(first, rivals=(rival,)), *rest))
    proof = prove_name(changed, BOUND, 20).name_proof
    assert proof.rivals[rival.effect].status is Status.NOT_POSABLE
    assert "acts on the noise" in proof.rivals[rival.effect].reason


def test_each_exclusion_has_a_certificate(proven, tmp_path):
    """The standard-library checker accepts it, it is about the record, and no other record passes."""
    (tmp_path / "base.json").write_text("of another proof")
    proof = certify_name(proven, BOUND, tmp_path, 30).name_proof
    excluded = [one for _, one in proof.decisions if one.excluded]
    assert proof.base in excluded
    assert len(excluded) >= 2
    for one in excluded:
        assert program([one.certificate]) == 0
        verified = verify(one.certificate, proven.data)
        assert verified.empty
        (window,) = verified.origin["windows"]
        assert (window["first"], window["last"]) == (one.first, one.last)
    assert {str(file) for file in tmp_path.iterdir()} == {one.certificate for one in excluded}
    changed = proven.data.experiments[0].values["y"].copy()
    changed[proof.base.first] += 0.1
    other = record(proven.data.values("u"), changed, bound=0.0)
    with pytest.raises(DataError, match="differs first at sample 0"):
        verify(proof.base.certificate, other)
    assert str(tmp_path / "base.json") in str(proof)


def test_without_time_there_is_no_file(proven, tmp_path):
    (tmp_path / "base.json").write_text("of another proof")
    assert not certify_name(proven, BOUND, tmp_path, 1e-6).name_proof.base.certificate
    assert not list(tmp_path.iterdir())


def test_nothing_is_certified_that_is_not_proven(found, tmp_path):
    with pytest.raises(ModelError, match="prove_name first"):
        certify_name(found, BOUND, tmp_path)


def test_bad_input_is_refused(found):
    with pytest.raises(ModelError, match="noise bound"):
        prove_name(found, -1.0)
    with pytest.raises(ValueError, match="seconds"):
        prove_name(found, BOUND, 0)
    with pytest.raises(ModelError, match="workers = 0"):
        prove_name(found, BOUND, workers=0)
