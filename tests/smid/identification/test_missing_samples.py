"""Missing samples are no constraint: intervals hold the truth, and nothing is interpolated into a proof."""

import json

import numpy as np
import pandas as pd
import pytest
import sympy

import smid
from smid.data import DataError, Dataset
from smid.diagnosis import diagnose
from smid.feasible.feasible_set import FeasibleSet
from smid.fitting.fit import fit
from smid.models import ErrorsInVariables, Hammerstein, ModelError, OutputError, Wiener
from smid.models.simulate import simulate
from smid.models.symbols import signal, t
from smid.recursive import Arx, ForgettingFactor, track
from smid.validation.validate import validate
from smid.verification.verify import NotProvenError, verify

N, BOUND = 30, 0.05
TRUTH = {"a1": -0.8, "b0": 0.4}
MODEL = OutputError(na=1, stable=True)
AT_RANDOM, GAP = "at random", "one gap"
KINDS = {
    "output error": (MODEL, TRUTH),
    "second order": (OutputError(na=2, stable=True), {"a1": -1.1, "a2": 0.5, "b0": 0.4}),
    "errors in variables": (ErrorsInVariables(na=1, stable=True), {"a1": -0.7, "b0": 0.5}),
    "Hammerstein": (Hammerstein(powers=(1, 2), stable=True), {"alpha": -0.7, "gamma1": 0.5, "gamma2": 0.3}),
}


def measured(model, truth, seed, n=N):
    """Return input and output; noise is drawn near its bound, where an invented sample would show."""
    random = np.random.default_rng(seed)
    u = np.repeat(random.uniform(-1, 1, n // 2), 2)
    y = simulate(model, {model.inputs[0] if model.name.startswith("Errors") else "u": u}, truth)["y"]
    return u, y + BOUND * random.choice([-1.0, 1.0], n) * random.uniform(0.8, 1.0, n)


def lost(kind, seed, n=N):
    """Return the instants at which the output is missing."""
    return np.random.default_rng(seed).choice(n, n // 10, replace=False) if kind == AT_RANDOM else np.arange(10, 20)


def record(u, y, missing=()):
    y = y.copy()
    y[list(missing)] = np.nan
    return Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=0.1)


@pytest.fixture(scope="module")
def holes():
    u, y = measured(MODEL, TRUTH, 1)
    return record(u, y, lost(AT_RANDOM, 1))


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("output error", AT_RANDOM),
        ("output error", GAP),
        ("second order", GAP),
        ("errors in variables", AT_RANDOM),
        ("Hammerstein", AT_RANDOM),
    ],
)
def test_intervals_hold_the_truth_between_those_of_the_whole_and_of_the_parts(name, kind):
    model, truth = KINDS[name]
    u, y = measured(model, truth, 0)
    bound = {"u": 0.01, "y": BOUND} if name == "errors in variables" else BOUND
    data = record(u, y, lost(kind, 0))
    found, whole, parts = (
        smid.identify(model, one, bound, rounds=2) for one in (data, record(u, y), data.without_gaps())
    )
    slack = {i.name: 1e-4 * i.width for i in parts.intervals}
    for i, full, split in zip(found.intervals, whole.intervals, parts.intervals, strict=True):
        assert i.lower <= truth[i.name] <= i.upper
        assert i.lower <= full.inner_lower <= full.inner_upper <= i.upper
        assert split.lower - slack[i.name] <= i.lower <= i.upper <= split.upper + slack[i.name]
    # What the parts leave out tells more.
    assert any(i.width < 0.999 * split.width for i, split in zip(found.intervals, parts.intervals, strict=True))


@pytest.mark.parametrize("kind", [AT_RANDOM, GAP])
def test_a_proof_is_about_the_missing_samples_too(kind, tmp_path):
    u, y = measured(MODEL, TRUTH, 2)
    data, proof = record(u, y, lost(kind, 2)), tmp_path / "proof.json"
    found = smid.identify(MODEL, data, BOUND, certificate=proof)
    told = verify(proof, data, MODEL, BOUND)
    assert told.equations == N - 1
    assert told.intervals == {i.name: (i.lower, i.upper) for i in found.intervals}
    with pytest.raises(DataError, match="differs first at sample"):
        verify(proof, record(u, y), MODEL)
    with pytest.raises(DataError, match="differs first at sample"):
        verify(proof, record(u, y, [*lost(kind, 2), 25]), MODEL)


def test_a_noise_bound_on_a_missing_sample_is_no_proof(tmp_path):
    u, y = measured(MODEL, TRUTH, 2)
    data, proof = record(u, y, [20]), tmp_path / "proof.json"
    smid.identify(MODEL, data, BOUND, certificate=proof)
    content = json.loads(proof.read_text())
    place = content["variables"].index("eta[20]")
    assert content["box"][place] == [None, None]
    content["box"][place] = content["box"][content["variables"].index("eta[19]")]
    proof.write_text(json.dumps(content))
    with pytest.raises(NotProvenError, match=r"eta\[20\]"):
        verify(proof, data, MODEL)


def test_the_least_bound_needs_no_missing_sample():
    u, y = measured(MODEL, TRUTH, 3)
    wild = y.copy()
    wild[[7, 20]] += 5.0
    assert smid.error_bound(MODEL, record(u, wild), nodes=0).lower > BOUND
    found = smid.error_bound(MODEL, record(u, wild, [7, 20]))
    assert 0 < found.lower <= found.upper <= BOUND
    assert found.gap < 1e-2 * BOUND


def test_a_sensor_curve_and_a_kink_leave_out_what_reads_a_missing_sample():
    u, y = measured(MODEL, TRUTH, 4)
    whole, data = record(u, y / 4), record(u, y / 4, [10, 11])
    curved = FeasibleSet(Wiener(1, (3,)), data, BOUND)
    assert curved.n_equalities == FeasibleSet(Wiener(1, (3,)), whole, BOUND).n_equalities - 2
    assert [curved.problem.names[k] for k in curved.missing] == ["x[10]", "x[11]"]
    kinked = FeasibleSet(MODEL.add_term("w", sympy.Max(0, signal("w")[t - 1]) / 10), data, BOUND)
    assert kinked.n_equalities == N - 1 - 3
    assert not len(kinked.missing)


def test_a_missing_input_splits_the_record_and_says_so():
    u, y = measured(MODEL, TRUTH, 0)
    u[[12, 13]] = np.nan
    data = record(u, y, [20])
    assert [run.n_samples for run in data.experiments] == [12, N - 14]
    assert data.missing == {"u": 0, "y": 1}
    assert "2 of 30 samples of u are missing: the record is split there into 2 experiments" in data.source
    both = Dataset.from_arrays(input={"v": y}, output={"y": y, "u": u}, sampling_time=0.1)
    with pytest.raises(DataError, match="reads 'u' as an input, and 2 of its samples are missing"):
        smid.identify(MODEL, both, BOUND)


@pytest.mark.parametrize("kind", [AT_RANDOM, GAP])
def test_with_missing_inputs_intervals_hold_the_truth_and_are_no_wider_than_those_of_the_longest_part(kind):
    n = 2 * N
    u, y = measured(MODEL, TRUTH, 1, n)
    u[lost(kind, 1, n)] = np.nan
    data = record(u, y)
    longest = data.with_experiments([max(data.experiments, key=lambda run: run.n_samples)])
    left_out = n - int(np.isnan(u).sum()) - data.n_samples
    assert (f"{left_out} samples in parts of fewer than 10 are left out" in data.source) == (left_out > 0)
    found, alone = (smid.identify(MODEL, one, BOUND, rounds=2) for one in (data, longest))
    for i, other in zip(found.intervals, alone.intervals, strict=True):
        assert i.lower <= TRUTH[i.name] <= i.upper
        assert i.width < (1 + 1e-4) * other.width  # where the longest part decides an end, it is proven once more


def test_every_sample_of_a_file_is_a_measured_one(tmp_path):
    u, y = measured(MODEL, TRUTH, 1)
    frame = pd.DataFrame({"time": 0.1 * np.arange(N), "u": u, "y": y})
    gone = lost(AT_RANDOM, 1)
    frame.loc[gone, "y"] = np.nan
    frame.to_csv(tmp_path / "holes.csv", index=False)
    data = Dataset.from_file(tmp_path / "holes.csv", "u", "y")
    assert data.missing == {"u": 0, "y": len(gone)}
    np.testing.assert_array_equal(data.values("y"), frame["y"])
    frame.drop(index=gone).to_csv(tmp_path / "rows.csv", index=False)
    for run in Dataset.from_file(tmp_path / "rows.csv", "u", "y").experiments:
        rows = np.rint(run.start_time / 0.1).astype(int) + np.arange(run.n_samples)
        np.testing.assert_array_equal(run.values["y"], y[rows])


def test_a_record_with_missing_samples_keeps_them(holes, tmp_path):
    text = json.dumps(holes.to_dict(), allow_nan=False)
    assert Dataset.from_dict(json.loads(text)) == holes
    assert holes.checksum != record(*measured(MODEL, TRUTH, 1)).checksum
    assert holes.normalise().denormalise().missing == holes.missing
    with pytest.raises(DataError, match="samples of 'y' are missing, and the filter would read them"):
        holes.decimate(2)
    assert holes.decimate(2, antialias=False).n_samples == N // 2
    said = "3 of 30 samples of y are missing; they constrain nothing"
    assert said in str(holes)
    found = smid.identify(MODEL, holes, BOUND, rounds=1)
    assert said in str(found)
    assert found.to_dict()["data"]["missing"] == {"u": 0, "y": 3}
    smid.report(found, tmp_path / "page.html")
    assert said in (tmp_path / "page.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("garbage", [0.0, 1e3])
def test_no_fit_and_no_score_reads_a_missing_sample(garbage):
    """They are those of a mask over samples that hold anything."""
    u, y = measured(MODEL, TRUTH, 5)
    gone = np.array([0, 1, *lost(GAP, 5), N - 1])
    data = record(u, y, gone)
    kept = ~np.isin(np.arange(N), gone)
    found = fit(MODEL, data)
    wrong = y.copy()
    wrong[gone] = garbage
    masked = fit(MODEL.with_values(found.model.values), record(u, wrong), [kept])
    for name, value in TRUTH.items():
        assert found.model.values[name] == pytest.approx(value, abs=0.05)
        assert found.model.values[name] == pytest.approx(masked.model.values[name], rel=1e-4)
    (score,) = validate(found.model, data, 2 * BOUND).scores
    assert score.samples == kept.sum() - 1  # the first measured sample starts the run
    assert score.largest < 3 * BOUND
    run = MODEL.with_values(TRUTH).simulate(data).outputs[0]["y"]
    assert np.isnan(run).tolist() == [k < 2 for k in range(N)]
    assert run[2] == y[2]
    with pytest.raises(ModelError, match="nowhere are 2 samples of y in a row there"):
        OutputError(2).with_values({"a1": -0.5, "a2": 0.0, "b0": 1.0}).simulate(record(u, y, range(0, N, 2)))


def test_a_diagnosis_counts_no_missing_sample():
    random = np.random.default_rng(0)
    n, u = 240, random.uniform(-1, 1, 240)
    y = simulate(OutputError(delay=3), {"u": u}, TRUTH)["y"] + random.uniform(-0.02, 0.02, n)
    gone = [*random.choice(170, 17, replace=False), *range(200, 210)]
    effects = ["input_delay", "extra_lag"]
    found = diagnose(MODEL, record(u, y, gone), 0.02, effects=effects, workers=1)
    assert [cause.effect for cause in found.causes] == ["input_delay"]
    assert found.gain.samples == 48 - 10
    assert found.misfit.samples == 192 - len(set(gone)) + 10
    assert found.proof is not None
    assert np.isnan(found.data.values("y")).sum() == len(set(gone))
    assert found.shortened == (f"{len(set(gone))} of 240 samples of y are missing; they constrain nothing",)
    with pytest.raises(DataError, match="test part"):
        diagnose(MODEL, record(u, y, range(185, 240)), effects=effects, workers=1)


def test_what_reads_every_sample_refuses_missing_ones(holes):
    with pytest.raises(DataError, match=r"3 of 30 samples of 'y' are missing; give data\.without_gaps\(\)"):
        track(Arx(), ForgettingFactor(), holes)
    assert track(Arx(), ForgettingFactor(), holes.without_gaps()).record.startswith("experiment_1")
