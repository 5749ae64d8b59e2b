"""The enclosure of the least noise bound against linear programs at every pole."""

import json

import numpy as np
import pytest
from scipy.signal import lfilter

from benchmarks.soundness.random_problems import random_problem
from relaxations.search.enclosure import Reason
from smid import Dataset, EmptyFeasibleSetError, ErrorsInVariables, ModelError, OutputError, error_bound, identify
from smid.identification.windows import windowed
from tests.smid.first_order import first_order

CASES = [("output error", 15, 1), ("output error", 40, 2), ("hammerstein", 20, 3), ("hammerstein", 35, 4)]


@pytest.mark.parametrize(("kind", "n", "seed"), CASES)
def test_the_enclosure_holds_the_least_bound(kind: str, n: int, seed: int) -> None:
    problem = first_order(kind, n, seed)
    found = error_bound(problem.model, problem.data)
    least = problem.least_noise()
    # The oracle's programs are exact to about 1e-9, and its golden section stops a little above the minimum.
    assert found.lower <= least * (1 + 1e-7)
    assert found.upper >= least * (1 - 1e-7)
    assert found.gap <= 2e-3 * found.upper
    assert found.reason is Reason.TIGHT
    assert found.upper <= problem.noise_bound
    names = [p.name for p in problem.model.parameters]
    assert list(found.parameters) == names
    assert problem.least_noise_at(found.parameters[names[0]]) <= found.upper * (1 + 1e-7)


def test_two_experiments() -> None:
    problem = first_order("output error", (15, 12), 5)
    found = error_bound(problem.model, problem.data)
    assert found.lower <= problem.least_noise() * (1 + 1e-7)
    assert found.upper >= problem.least_noise() * (1 - 1e-7)
    one = error_bound(problem.model, problem.data.select("run0"))
    assert one.lower <= found.upper  # fewer samples need no more


@pytest.mark.parametrize("seed", [0, 1, 2, 3])
def test_never_above_the_bound_that_made_the_data(seed: int) -> None:
    problem = random_problem(seed, n_samples=20)
    fixed = {c: b for c, b in problem.noise_bound.items() if c != "y"}
    found = error_bound(problem.model, problem.data, fixed, rounds=4, tolerance=1e-2)
    assert 0 <= found.lower <= problem.noise_bound["y"]
    assert found.lower <= found.upper
    assert found.fixed == fixed


def test_the_input_bound_of_errors_in_variables() -> None:
    problem = random_problem(2, kind="errors in variables", n_samples=20)
    model, data = problem.model, problem.data
    narrow, wide = (error_bound(model, data, {"u": b}) for b in (1e-9, problem.noise_bound["u"]))
    assert wide.lower <= narrow.upper  # more freedom on the input needs no more on the output
    exact = error_bound(OutputError(1, 0, 0, stable=True), data)
    assert narrow.lower == pytest.approx(exact.upper, rel=5e-3)
    # The channel that stays open may as well be the input.
    on_input = error_bound(model, data, {"y": problem.noise_bound["y"]})
    assert on_input.channel == "u"
    assert on_input.lower <= problem.noise_bound["u"]


def test_identify_agrees_on_both_sides_of_the_enclosure() -> None:
    problem = first_order("output error", 20, 6)
    found = error_bound(problem.model, problem.data)
    with pytest.raises(EmptyFeasibleSetError):
        identify(problem.model, problem.data, 0.99 * found.lower)
    assert identify(problem.model, problem.data, 1.01 * found.upper).enclosure.witnesses


def test_data_without_noise_need_none() -> None:
    problem = first_order("output error", 12, 7, margin=1e18)
    found = error_bound(problem.model, problem.data)
    assert found.lower >= 0
    assert found.upper < 1e-12
    assert found.parameters == pytest.approx(problem.truth)


def test_exactly_one_channel_may_be_open() -> None:
    rng = np.random.default_rng(0)
    data = Dataset.from_arrays(input={"u": rng.normal(size=12)}, output={"y": rng.normal(size=12)}, sampling_time=1.0)
    model = ErrorsInVariables(stable=True)
    with pytest.raises(ModelError, match=r"noise bounds to find: y, u; give the known ones in fixed=.*exactly one"):
        error_bound(model, data)
    with pytest.raises(ModelError, match="noise bounds to find: none"):
        error_bound(model, data, {"u": 0.1, "y": 0.1})
    with pytest.raises(ModelError, match="noise bound of 'z': the noisy channels are y, u; name one of them"):
        error_bound(model, data, {"u": 0.1, "z": 0.1})
    with pytest.raises(ModelError, match=r"the noise bound of 'u' is -0\.1: give a positive number"):
        error_bound(model, data, {"u": -0.1})


def test_printed_ends_are_outside_and_the_dictionary_is_plain() -> None:
    problem = first_order("output error", 15, 1)
    found = error_bound(problem.model, problem.data)
    low, high = (float(end) for end in found.enclosure.strip("[]").split(","))
    assert low <= found.lower
    assert high >= found.upper
    assert "lower end certified, upper end witnessed" in str(found)
    plain = json.loads(json.dumps(found.to_dict()))
    assert plain["lower"] == found.lower
    assert plain["reason"] == "tight"
    assert plain["parameters"] == dict(found.parameters)


def test_progress_is_told() -> None:
    problem = first_order("output error", 15, 1)
    lines: list[str] = []
    error_bound(problem.model, problem.data, progress=lines.append)
    assert any("noise_bound in [" in line for line in lines)


def test_a_slow_pole_whose_windows_hold_the_whole_record(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(windowed, "LONG", 40)
    rng = np.random.default_rng(4)
    u = rng.uniform(-1, 1, 45)
    y = lfilter([0.0, 0.5], [1.0, -0.995], u) + rng.uniform(-0.1, 0.1, 45)
    data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    found = error_bound(OutputError(stable=True), data)
    assert 0 < found.lower <= found.upper <= 1.01 * 0.1
