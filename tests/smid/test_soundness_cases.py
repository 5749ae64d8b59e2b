"""The random cases of ``python -m benchmarks.soundness``: the truth is inside, the empty sets are empty."""

from typing import Any

import numpy as np
import pytest

from benchmarks.soundness import library_cases
from benchmarks.soundness.cases import KINDS, LEVELS, SMOOTH, STATIC, drawn, empty_case, feasible_case, new_case
from benchmarks.soundness.check_case import check_case, check_inversion, check_new
from benchmarks.soundness.emptiness import Record, least_noise_bound
from benchmarks.soundness.library_cases import library_case
from benchmarks.soundness.score import CaseResult, markdown
from relaxations.algebra.arrays import Array
from smid import FeasibleSet
from smid.identification.windows import windowed
from smid.models.compiled import compile_loop
from smid.models.structure import is_clock

COUNT = len(KINDS)


@pytest.mark.parametrize("seed", range(COUNT))
def test_a_seed_gives_the_same_case(seed: int) -> None:
    for draw in (feasible_case, empty_case):
        one, other = draw(seed), draw(seed)
        assert (one.kind, one.construction, one.noise_bound, one.truth) == (
            other.kind,
            other.construction,
            other.noise_bound,
            other.truth,
        )
        assert one.data.checksum == other.data.checksum
        assert one.kind == KINDS[seed % COUNT]


@pytest.mark.parametrize("seed", range(2 * COUNT))
def test_the_truth_lies_within_the_priors(seed: int) -> None:
    case = feasible_case(seed)
    parameters = FeasibleSet(case.model, case.data, case.noise_bound).model.parameters
    assert {p.name for p in parameters} == set(case.truth)
    assert all(p.lower <= case.truth[p.name] <= p.upper for p in parameters)


def test_an_outlier_is_out_of_reach_of_any_parameters() -> None:
    """Random parameters within their boxes, from the record's own past: none comes near."""
    rng = np.random.default_rng(0)
    for seed in (0, 1, 2 * COUNT):
        case = empty_case(seed)
        u, y = case.data.values("u"), case.data.values("y")
        bound, second = case.noise_bound["y"], case.kind == "output error 2"
        reached = np.full(len(y), -np.inf)
        for _ in range(300):
            noise = rng.choice([-bound, bound], len(y))
            w = y - noise
            radius, angle = np.sqrt(rng.uniform(0, 1)), rng.uniform(0, np.pi)
            a = (-2 * radius * np.cos(angle), radius**2) if second else (rng.uniform(-1, 1), 0.0)
            b = rng.uniform(-3, 3, 2) * (1.0, 1.0 if second else 0.0)
            for t in range(2, len(y)):
                found = -a[0] * w[t - 1] - a[1] * w[t - 2] + b[0] * u[t - 1] + b[1] * u[t - 2]
                reached[t] = max(reached[t], np.sign(y[t]) * found)
        assert (np.abs(y) - bound > reached)[2:].any()


def test_the_oracle_lies_below_the_noise_that_made_the_data_and_close_to_the_least() -> None:
    rng = np.random.default_rng(1)
    u = rng.uniform(-1, 1, 20)
    w = np.zeros(20)
    for t in range(1, 20):
        w[t] = 0.6 * w[t - 1] + 1.2 * u[t - 1]
    noise = rng.uniform(-0.1, 0.1, 20)
    record = Record(w + noise, np.r_[0.0, u[:-1]][:, None])
    found = least_noise_bound(record)
    assert 0.02 < found <= np.abs(noise).max()
    assert least_noise_bound(record, 20) <= found
    # Without noise nothing is needed.
    assert least_noise_bound(Record(w, np.r_[0.0, u[:-1]][:, None])) == pytest.approx(0.0, abs=1e-7)


@pytest.mark.parametrize("kind", [k for k in KINDS if k in SMOOTH or k in STATIC])
def test_a_small_bound_is_below_what_the_true_noise_needed(kind: str) -> None:
    seed = COUNT + KINDS.index(kind)
    case = empty_case(seed)
    assert case.construction == "small bound"
    assert 0 < case.noise_bound["y"] < drawn(kind, seed, LEVELS).noise_bound["y"]


@pytest.mark.parametrize("seed", [0, 4, 16, 18])
@pytest.mark.parametrize("feasible", [True, False])
def test_nothing_false_is_said(feasible: bool, seed: int) -> None:
    result = check_case(feasible, seed)
    assert not result.is_false, result
    assert result.verdict in ("inside", "inside, no box", "certified empty", "undecided"), result


@pytest.mark.parametrize("seed", [9, 51])
def test_a_set_whose_kinks_are_all_decided_is_certified_empty(seed: int) -> None:
    assert check_case(False, seed).verdict == "certified empty"


def test_the_section_counts_what_is_false_and_names_its_seed() -> None:
    results = [
        CaseResult("relay", "feasible", 1, 10, "inside", 1.0),
        CaseResult("relay", "feasible", 2, 10, "truth outside", 1.0, "d = 0.3 outside"),
        CaseResult("relay", "outlier", 3, 10, "certified empty", 2.0),
        CaseResult("relay", "outlier", 4, 10, "undecided", 2.0),
    ]
    text = markdown(results, 6.0)
    assert "False statements: 1" in text
    assert "- truth outside, relay, feasible, seed 2: d = 0.3 outside" in text
    assert "| relay, outlier | 2 | 1 | 1 | 0 | 0 | 2.00 | 2.0 |" in text


@pytest.mark.parametrize("seed", range(16))
def test_the_truth_of_a_new_case_lies_within_the_priors(seed: int) -> None:
    case = new_case(True, seed)
    parameters = FeasibleSet(case.model, case.data, case.noise_bound).model.parameters
    assert {p.name for p in parameters} == set(case.truth)
    assert all(p.lower <= case.truth[p.name] <= p.upper for p in parameters)
    assert new_case(True, seed).data.checksum == case.data.checksum
    assert (case.outliers > 0) == (seed % 4 == 3)


@pytest.mark.parametrize("seed", [2, 6])
def test_no_parameters_reach_the_outlier_beside_a_hidden_state(seed: int) -> None:
    rng, case = np.random.default_rng(0), new_case(False, seed)
    u, x, bound = case.data.values("u"), case.data.values("x"), case.noise_bound["x"]
    reached = np.full(len(x), -np.inf)
    for _ in range(300):
        seen = x - rng.choice([-bound, bound], len(x))
        p = {q.name: rng.uniform(q.lower, q.upper) for q in case.model.parameters}
        for t in range(2, len(x)):
            if seed == 2:  # position and speed, Euler's step of 0.1 s
                speed = (seen[t - 1] - seen[t - 2]) / 0.1
                found = seen[t - 1] + 0.1 * (speed + 0.1 * (p["b"] * u[t - 2] - p["k"] * seen[t - 2] - p["c"] * speed))
            else:
                hidden = seen[t - 1] - p["a"] * seen[t - 2]
                hidden = p["c"] * seen[t - 2] + 0.3 * hidden + p["b"] * u[t - 2]
                found = p["a"] * seen[t - 1] + hidden
            reached[t] = max(reached[t], np.sign(x[t]) * found)
    assert (np.abs(x) - bound > reached)[2:].any()


@pytest.mark.parametrize(("feasible", "seed"), [(True, 3), (False, 3), (False, 1)])
def test_a_new_case_is_judged(feasible: bool, seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("LONG", "_SHARE", "MOST_PIECEWISE"):
        monkeypatch.setattr(windowed, name, getattr(windowed, name))  # what the check sets is taken back
    assert check_new(feasible, seed).verdict == ("inside" if feasible else "certified empty")


@pytest.mark.parametrize("seed", [0, 4, 12, 33])
def test_a_case_of_the_effect_library_holds_the_truth_or_contradicts_itself(seed: int) -> None:
    case, empty = library_case(True, seed), library_case(False, seed)
    assert library_case(True, seed).data.checksum == case.data.checksum
    assert all(p.lower <= case.truth[p.name] <= p.upper for p in case.model.parameters)
    # Two samples of the output differ by something else than the channel of their difference shows.
    (lag,) = (lag for line in empty.model.lines if line.signal == "change" for _, lag in line.reads if lag)
    bound = empty.noise_bound["difference"]
    assert set(empty.noise_bound.values()) == {bound}
    left = [
        np.abs(run.values["y"][lag:] - run.values["y"][:-lag] - run.values["difference"][lag:])
        for run in empty.data.experiments
    ]
    assert np.nanmax(np.concatenate(left)) > 3 * bound


@pytest.mark.parametrize("seed", [28, 120, 124, 51])  # lags of one and two samples in a model; a clock
def test_each_line_of_a_run_holds_from_its_own_lag_on(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    runs = []
    draw = library_cases._run

    def kept(*given: Any) -> dict[str, Array]:
        runs.append((*given[2:], draw(*given)))
        return runs[-1][-1]

    monkeypatch.setattr(library_cases, "_run", kept)
    library_case(True, seed)
    model, truth, run = runs[-1]
    clocks = [line.signal for line in model.lines if is_clock(line)]
    assert [run[name][0] for name in clocks] == pytest.approx([0.0] * len(clocks), abs=1e-9)
    for line in model.lines:
        lag = max((lag for _, lag in line.reads), default=0)
        for now in range(lag, len(run["u"])):
            known = {name: samples[: now + 1].copy() for name, samples in run.items()}
            compile_loop((line,)).run(known, truth, now)
            assert known[line.signal][now] == pytest.approx(run[line.signal][now], rel=1e-9, abs=1e-9)


@pytest.mark.parametrize(("feasible", "seed"), [(True, 0), (True, 9), (False, 0), (False, 9)])
def test_a_case_of_the_effect_library_is_judged(feasible: bool, seed: int) -> None:
    assert check_inversion(feasible, seed, 10.0).verdict == ("inside" if feasible else "certified empty")
