"""Outliers anywhere: the truth is inside, what is spoilt is found, and nothing is stated that does not hold."""

import copy
import json
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from relaxations import check
from relaxations.search.enclosure import Reason
from smid import (
    DataError,
    Dataset,
    EmptyFeasibleSetError,
    ErrorsInVariables,
    Estimate,
    ModelError,
    OutputError,
    OwnModel,
    identify,
    projections,
    step,
)
from smid.data.window import Window
from smid.verification import NotProvenError, verify

BOUND = 0.05
MODEL = OutputError(na=1, nb=0, stable=True)
TRUTH = {"a1": -0.7, "b0": 0.5}


def record(n: int, outliers: int, seed: int = 0, size: float = 1.0) -> tuple[Dataset, np.ndarray]:
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-1, 1, n // 5 + 1), 5)[:n]
    y = lfilter([0, 0.5], [1, -0.7], u) + rng.uniform(-BOUND, BOUND, n)
    bad = rng.choice(np.arange(5, n - 5), outliers, replace=False)
    y[bad] += rng.choice([-1, 1], outliers) * rng.uniform(0.3, 3.0, outliers) * size
    return Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0), bad


def holds_truth(estimate: Estimate) -> bool:
    return all(estimate[name].lower <= value <= estimate[name].upper for name, value in TRUTH.items())


@pytest.fixture(scope="module")
def spoilt() -> tuple[Dataset, np.ndarray, Estimate]:
    data, bad = record(150, 3)
    return data, bad, identify(MODEL, data, BOUND, outliers=3, tolerance=1e-2)


def test_three_outliers_that_empty_the_set(spoilt):
    data, _, estimate = spoilt
    with pytest.raises(EmptyFeasibleSetError):
        identify(MODEL, data, BOUND)
    assert holds_truth(estimate)
    assert estimate.reason is not Reason.OUTLIERS
    assert all(interval.gap < interval.width for interval in estimate)
    assert "in all but 3 samples of each output" in str(estimate)


def test_inner_ends_fit_all_samples_but_three(spoilt):
    data, _, estimate = spoilt
    u, y = data.values("u"), data.values("y")
    for point in estimate.enclosure.witnesses:
        forced = lfilter([0, point[1]], [1, point[0]], u)
        decay = (-point[0]) ** np.arange(len(y))
        # The best initial state is among those that leave one error at its bound.
        starts = ((y - forced)[:40, None] + BOUND * np.array([-1, 1])) / decay[:40, None]
        beyond = [np.sum(np.abs(y - forced - s * decay) > BOUND * (1 + 1e-6)) for s in starts.ravel()]
        assert min(beyond) <= 3


def test_the_intervals_are_nearly_those_without_the_outliers(spoilt):
    data, bad, estimate = spoilt
    y = data.values("y").copy()
    y[bad] = np.nan
    clean = Dataset.from_arrays(input={"u": data.values("u")}, output={"y": y}, sampling_time=1.0)
    known = identify(MODEL, clean, BOUND, tolerance=1e-2)
    for interval in estimate:
        assert interval.lower <= known[interval.name].inner_lower
        assert interval.upper >= known[interval.name].inner_upper
        assert interval.width < 2 * known[interval.name].width


@pytest.mark.parametrize("seed", range(6))
def test_the_truth_is_inside_wherever_and_however_large_the_outliers_are(seed):
    q = 1 + seed // 3
    data, _ = record(60, q, seed, size=(0.05, 0.3, 1.0)[seed % 3])
    estimate = identify(MODEL, data, BOUND, outliers=q, tolerance=0.1)
    assert holds_truth(estimate)
    assert all(not i.inner_lower < i.lower and not i.inner_upper > i.upper for i in estimate)


@pytest.mark.parametrize(("n", "seed"), [(30, 1), (30, 4), (36, 5)])
def test_stretches_that_leave_little_of_a_part(n, seed):
    """No sample, or nearly none, was left of a part, and the parts before were lost."""
    data, _ = record(n, 3, seed, size=0.15)
    assert holds_truth(identify(MODEL, data, BOUND, outliers=3, tolerance=0.5))


def test_outliers_that_are_not_there_cost_width_and_say_so():
    data, _ = record(80, 0)
    estimate, plain = identify(MODEL, data, BOUND, outliers=1, tolerance=0.1), identify(MODEL, data, BOUND)
    assert holds_truth(estimate)
    assert estimate.reason is Reason.OUTLIERS
    assert all(estimate[i.name].lower <= i.inner_lower and estimate[i.name].upper >= i.inner_upper for i in plain)


def test_more_outliers_than_are_allowed_are_proven():
    data, _ = record(120, 4, 2)
    with pytest.raises(EmptyFeasibleSetError, match="even if 1 samples of each output"):
        identify(MODEL, data, BOUND, outliers=1)


def test_noisy_inputs():
    data, _ = record(100, 1, 3)
    u = data.values("u") + np.random.default_rng(4).uniform(-0.02, 0.02, 100)
    both = Dataset.from_arrays(input={"u": u[:-1]}, output={"y": data.values("y")[1:]}, sampling_time=1.0)
    estimate = identify(
        ErrorsInVariables(na=1, nb=0, stable=True), both, {"u": 0.02, "y": BOUND}, outliers=1, tolerance=0.1
    )
    assert holds_truth(estimate)


def test_an_interrupt_keeps_what_is_proven():
    data, _ = record(300, 3)
    assert identify(MODEL, data, BOUND, outliers=3, seconds=0.01).reason is Reason.TIME


def test_what_rests_on_trusted_samples_is_refused(spoilt):
    _, _, estimate = spoilt
    for ask in (step, projections):
        with pytest.raises(ModelError, match="allow outliers"):
            ask(estimate)


@pytest.mark.parametrize("outliers", [-1, 1.5, True, "2"])
def test_a_number_that_is_none_is_refused(outliers):
    with pytest.raises(ModelError, match="how many samples"):
        identify(MODEL, record(60, 0)[0], BOUND, outliers=outliers)


def test_more_than_leave_information_are_refused():
    with pytest.raises(ModelError, match="20 outliers leave no information in 60 samples"):
        identify(MODEL, record(60, 0)[0], BOUND, outliers=20)


def test_it_lives_in_json(spoilt):
    data, _, estimate = spoilt
    assert Estimate.from_dict(estimate.to_dict(), data).outliers == 3


def test_a_window_without_others():
    whole = Window(0, 0, 9)
    assert whole.without([Window(0, 3, 4), Window(1, 0, 9), Window(0, 8, 12)]) == [Window(0, 0, 2), Window(0, 5, 7)]
    assert whole.without([Window(0, 0, 9)]) == []
    assert whole.without([]) == [whole]


@pytest.fixture(scope="module")
def kept(tmp_path_factory) -> tuple[Dataset, dict, Estimate]:
    data, _ = record(60, 2, 1)
    file = tmp_path_factory.mktemp("proof") / "proof.json"
    estimate = identify(MODEL, data, BOUND, outliers=2, tolerance=1e-2, certificate=file)
    return data, check.read(file), estimate


def verified(content: dict, data: Dataset, folder: Path, model=MODEL):
    file = folder / "changed.json"
    file.write_text(json.dumps(content), encoding="utf-8")
    return verify(file, data, model, BOUND)


def test_the_certificate_proves_the_published_ends(kept, tmp_path):
    data, content, estimate = kept
    plain = identify(MODEL, data, BOUND, outliers=2, tolerance=1e-2)
    found = verified(content, data, tmp_path)
    for interval in estimate:
        assert found.intervals[interval.name] == (interval.lower, interval.upper)
        assert interval.lower == pytest.approx(plain[interval.name].lower, abs=1e-6)
    assert holds_truth(estimate)
    assert "outliers: at most 2 samples of each output" in str(found)
    assert sum(len(one["spoilt"]) for one in content["rounds"]) == 2


def test_a_certificate_of_too_many_outliers_is_verified(tmp_path):
    data, _ = record(120, 4, 2)
    with pytest.raises(EmptyFeasibleSetError):
        identify(MODEL, data, BOUND, outliers=1, certificate=tmp_path / "proof.json")
    assert verify(tmp_path / "proof.json", data, MODEL, BOUND).empty


def moved(windows: list[list[int]], by: int) -> None:
    for window in windows:
        window[1:] = [window[1] + by, window[2] + by]


def last_part(content: dict) -> dict:
    return content["rounds"][-1]["parts"][0]


CHANGES = {
    "a part of other samples": lambda c: moved(c["rounds"][0]["parts"][1]["windows"], -1),
    "exchanged parts": lambda c: c["rounds"][0]["parts"][0].update(windows=c["rounds"][0]["parts"].pop()["windows"]),
    "a stretch of other samples": lambda c: moved(c["rounds"][0]["spoilt"][0]["windows"], 1),
    "a shorter stretch, so that a later part has its samples": lambda c: c["rounds"][0]["spoilt"][0].update(
        windows=[[0, *(2 * [c["rounds"][0]["spoilt"][0]["windows"][0][1]])]]
    ),
    "fewer outliers than stated": lambda c: c.update(outliers=1),
    "more outliers stated": lambda c: c["origin"].update(outliers=5),
    "a box that is not the prior": lambda c: c.update(box=[["-0x1p-1", "0x1p+0"], c["box"][1]]),
    "another noise bound": lambda c: c["origin"]["noise_bounds"].update(y=(0.04).hex()),
    "another line": lambda c: c["origin"]["model"]["lines"].update(w="-a1*w[t - 1] + 2*b0*u[t - 1]"),
    "samples that the data lack": lambda c: last_part(c).update(windows=[[0, 0, 99]]),
    "an experiment that the data lack": lambda c: last_part(c).update(windows=[[1, 0, 59]]),
    "a certificate of another box": lambda c: last_part(c)["certificates"][0]["box"].__setitem__(
        0, ["0x0p+0", "0x1p+0"]
    ),
    "a wider bound of a noise": lambda c: last_part(c)["certificates"][0]["box"].__setitem__(5, ["-0x1p-1", "0x1p-1"]),
    "an equation of another datum": lambda c: last_part(c)["certificates"][0]["equalities"][2][0].__setitem__(0, 1),
}


@pytest.mark.parametrize("change", CHANGES)
def test_a_changed_certificate_is_refused(kept, tmp_path, change):
    data, content, _ = kept
    content = copy.deepcopy(content)
    CHANGES[change](content)
    with pytest.raises((NotProvenError, ModelError, DataError)):
        verified(content, data, tmp_path)


def test_a_changed_sample_is_named(kept, tmp_path):
    data, content, _ = kept
    y = data.values("y").copy()
    y[30] += 0.01
    other = Dataset.from_arrays(input={"u": data.values("u")}, output={"y": y}, sampling_time=1.0)
    with pytest.raises(DataError, match="differs first at sample 30"):
        verified(content, other, tmp_path)


def test_the_inversion_has_a_certificate_with_outliers(tmp_path):
    # The same model with a root, which is no polynomial.
    rng = np.random.default_rng(3)
    u = np.repeat(rng.uniform(0.5, 1.5, 6), 4)
    y = lfilter([0, 0.5], [1, -0.7], np.sqrt(u)) + rng.uniform(-BOUND, BOUND, len(u))
    y[12] += 2
    data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    model = OwnModel(["w[t] = a*w[t-1] + b*sqrt(u[t-1])"], {"y": "w"}, ["u"], {"a": [0.2, 1], "b": [0, 2]})
    file = tmp_path / "proof.json"
    plain = identify(model, data, BOUND, outliers=1, tolerance=0.1, nodes=200)
    estimate = identify(model, data, BOUND, outliers=1, tolerance=0.1, nodes=200, certificate=file)
    assert plain["a"].lower <= 0.7 <= plain["a"].upper
    assert estimate["a"].lower <= 0.7 <= estimate["a"].upper
    found = verify(file, data, model, BOUND)
    for interval in estimate:
        assert found.intervals[interval.name] == (interval.lower, interval.upper)
    content = check.read(file)
    CHANGES["a part of other samples"](content)
    with pytest.raises(NotProvenError):
        verified(content, data, tmp_path, model)
