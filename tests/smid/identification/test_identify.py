"""Published intervals: exact where an oracle tells, honest about what is proven everywhere."""

from collections.abc import Callable

import numpy as np
import pytest

from relaxations.points.witness import verify
from relaxations.search.enclosure import Proof, Reason
from smid import (
    CentreStatus,
    Dataset,
    EmptyFeasibleSetError,
    ErrorsInVariables,
    Estimate,
    FeasibleSet,
    Hammerstein,
    OutputError,
    Wiener,
    error_bound,
    identify,
)
from smid.identification import polynomial
from tests.smid.first_order import FirstOrder, first_order

EXACT = [("output error", 15, 1), ("output error", 30, 2), ("hammerstein", 20, 3)]


def check_against_the_oracle(problem: FirstOrder, estimate: Estimate) -> None:
    poles = problem.pole_interval()
    for k, interval in enumerate(estimate.intervals):
        low, high = poles if k == 0 else problem.linear_interval(k - 1, poles)
        width = high - low
        # Linear programs are exact to about 1e-9 of the noise bound: that is all they may lie outside.
        slack = 1e-7 * width
        assert interval.lower <= low + slack, interval.name
        assert interval.upper >= high - slack, interval.name
        assert interval.lower == pytest.approx(low, abs=1e-4 * width), interval.name
        assert interval.upper == pytest.approx(high, abs=1e-4 * width), interval.name
        assert low - 1e-6 * width <= interval.inner_lower <= interval.inner_upper <= high + 1e-6 * width


@pytest.mark.parametrize(("kind", "n", "seed"), EXACT)
def test_ends_are_those_of_the_oracle(kind: str, n: int, seed: int) -> None:
    problem = first_order(kind, n, seed)
    check_against_the_oracle(problem, identify(problem.model, problem.data, problem.noise_bound))


def test_two_experiments_shrink_the_interval_of_one() -> None:
    problem = first_order("output error", (14, 11), 4)
    both = identify(problem.model, problem.data, problem.noise_bound)
    check_against_the_oracle(problem, both)
    for run in ("run0", "run1"):
        one = identify(problem.model, problem.data.select(run), problem.noise_bound)
        for name, true in problem.truth.items():
            assert one[name].lower - 1e-6 <= both[name].lower <= true <= both[name].upper <= one[name].upper + 1e-6
        assert sum(both[name].width for name in problem.truth) < 0.99 * sum(one[name].width for name in problem.truth)


@pytest.fixture(scope="module")
def problem() -> FirstOrder:
    return first_order("output error", 15, 1)


@pytest.fixture(scope="module")
def estimate(problem: FirstOrder) -> Estimate:
    return identify(problem.model, problem.data, problem.noise_bound)


def test_ends_come_from_the_data_or_from_the_prior_and_say_so(problem: FirstOrder, estimate: Estimate) -> None:
    assert estimate.derived == ("b0",)
    for interval in estimate.intervals:  # a1 had a prior box, b0 one that was derived: both ends are the data's
        assert (interval.proof_lower, interval.proof_upper) == (Proof.PROVEN, Proof.PROVEN)
    inside = 0.5 * (problem.truth["b0"] + estimate["b0"].lower)
    told = identify(problem.model.bound(b0=(inside, 9.0)), problem.data, problem.noise_bound)
    assert told.derived == ()
    assert told["b0"].lower == inside
    assert (told["b0"].proof_lower, told["b0"].proof_upper) == (Proof.BOX, Proof.PROVEN)
    row = next(line for line in str(told).splitlines() if line.split()[0] == "b0")
    assert row.endswith("prior box / proven")
    for name in ("a1", "b0"):  # a prior can only shrink the intervals
        assert told[name].lower >= estimate[name].lower - 1e-6
        assert told[name].upper <= estimate[name].upper + 1e-6


def test_a_proven_empty_set_carries_its_proof(problem: FirstOrder) -> None:
    least = problem.least_noise()
    with pytest.raises(EmptyFeasibleSetError) as caught:
        identify(problem.model, problem.data, 0.8 * least)
    assert 0.8 * least < caught.value.least_bound <= least * (1 + 1e-7)
    assert caught.value.least_bound == pytest.approx(least, rel=5e-3)
    assert caught.value.samples
    for name, k, weight in caught.value.samples:
        assert name == "run0"
        assert 1 <= k < problem.data.n_samples
        assert 0 < weight <= 1
    message = str(caught.value)
    assert "proven: no parameters explain the data within" in message
    assert "raise the bound above it or extend the model" in message


def test_the_samples_named_are_those_that_refuse() -> None:
    """One sample of a clean record is spoilt: the proof must rest on it or its neighbour, which read it."""
    clean = first_order("output error", 25, 5, noise_bound=0.02)
    y = clean.data.values("y").copy()
    y[13] += 2.0
    spoilt = Dataset.from_arrays(input={"u": clean.data.values("u")}, output={"y": y}, sampling_time=1.0)
    with pytest.raises(EmptyFeasibleSetError) as caught:
        identify(clean.model, spoilt, 0.1)
    assert {k for _, k, _ in caught.value.samples[:2]} & {13, 14}


def feasible_with(problem: FirstOrder, parameters: dict[str, float]) -> bool:
    """Tell by a linear program at the parameters' pole whether they explain the data."""
    values = list(parameters.values())
    g = problem.responses(values[0])
    rest = problem.y - g[:, : problem.n_linear] @ np.array(values[1:])
    start = g[:, problem.n_linear :]
    low, high = -np.inf, np.inf
    for value, slope in zip(rest, start[:, 0], strict=True):  # |value - slope w0| <= D
        ends = sorted(((value - problem.noise_bound) / slope, (value + problem.noise_bound) / slope))
        low, high = max(low, ends[0]), min(high, ends[1])
    return low <= high + 1e-9


@pytest.mark.parametrize("seed", [1, 2, 8, 9])
@pytest.mark.parametrize("kind", ["output error", "hammerstein"])
def test_the_verdict_on_the_centre_is_right(kind: str, seed: int) -> None:
    drawn = first_order(kind, 14, seed)
    found = identify(drawn.model, drawn.data, drawn.noise_bound)
    if found.centre_status is CentreStatus.FEASIBLE:
        assert feasible_with(drawn, found.centre)
        assert found.nearest is None
        assert found.parameters == found.centre
    else:
        if found.centre_status is CentreStatus.INFEASIBLE:
            assert not feasible_with(drawn, found.centre)
        assert found.nearest is not None
        assert feasible_with(drawn, dict(found.nearest))
        assert found.parameters == dict(found.nearest)
    assert dict(found.model.values) == found.parameters


def test_both_verdicts_on_the_centre_occur() -> None:
    drawn = first_order("output error", 14, 1)
    told = {identify(drawn.model, drawn.data, bound).centre_status for bound in (drawn.noise_bound, 0.5)}
    narrow = first_order("hammerstein", 25, 3, noise_bound=0.1)
    least = error_bound(narrow.model, narrow.data).upper
    told.add(identify(narrow.model, narrow.data, 1.05 * least).centre_status)
    assert told >= {CentreStatus.FEASIBLE, CentreStatus.INFEASIBLE}


def test_witnesses_are_verified_points_of_the_users_problem(problem: FirstOrder, estimate: Estimate) -> None:
    feasible = FeasibleSet(problem.model, problem.data, problem.noise_bound)
    assert estimate.enclosure is not None
    for point in estimate.enclosure.witnesses:
        assert verify(feasible.problem, feasible.problem.variable(0), point) is not None


def test_the_sparse_hierarchy_agrees_with_the_lift() -> None:
    drawn = first_order("output error", 9, 6, bounds={"b0": (-4, 4)})
    lifted, sparse = (
        identify(drawn.model, drawn.data, drawn.noise_bound, method=method, order=2) for method in ("lift", "sparse")
    )
    assert lifted.enclosure.method == "lift"
    assert sparse.enclosure.method == "sparse"
    for name in drawn.truth:
        width = lifted[name].width
        assert sparse[name].lower == pytest.approx(lifted[name].lower, abs=1e-4 * width)
        assert sparse[name].upper == pytest.approx(lifted[name].upper, abs=1e-4 * width)


def test_a_wiener_model_by_the_sparse_hierarchy() -> None:
    rng = np.random.default_rng(0)
    truth = {"alpha": -0.5, "beta": 0.8, "s2": 0.2}
    n = 8
    u = rng.uniform(-1, 1, n)
    x = np.zeros(n)
    for k in range(1, n):
        x[k] = 0.5 * x[k - 1] + 0.8 * u[k - 1]
    z = (np.sqrt(1 + 4 * 0.2 * x) - 1) / (2 * 0.2)  # x = z + 0.2 z^2
    data = Dataset.from_arrays(input={"u": u}, output={"y": z + rng.uniform(-0.02, 0.02, n)}, sampling_time=1.0)
    model = Wiener(1, (2,), stable=True, bounds={"beta": (0, 2), "s2": (-1, 1)})
    found = identify(model, data, 0.02, rounds=1, method="sparse")
    assert found.enclosure is not None
    assert found.enclosure.method == "sparse"
    for name, true in truth.items():
        assert found[name].lower <= true <= found[name].upper
    assert found["beta"].width < 2


def test_another_solver_by_name_is_looser_and_true(problem: FirstOrder, estimate: Estimate) -> None:
    model = problem.model.bound(b0=(-5, 5))
    scs = identify(model, problem.data, problem.noise_bound, solver="SCS", order=1, rounds=2)
    for name, true in problem.truth.items():
        assert scs[name].lower <= true <= scs[name].upper
        assert scs[name].lower <= estimate[name].inner_lower
        assert scs[name].upper >= estimate[name].inner_upper


def test_errors_in_variables_hold_the_truth_and_meet_their_witnesses() -> None:
    rng = np.random.default_rng(1)
    n = 15
    u = rng.choice([-1.0, 1.0], n)
    w = np.zeros(n)
    for k in range(1, n):
        w[k] = 0.6 * w[k - 1] + u[k]
    data = Dataset.from_arrays(
        input={"u": u + rng.uniform(-0.03, 0.03, n)}, output={"y": w + rng.uniform(-0.05, 0.05, n)}, sampling_time=1.0
    )
    found = identify(ErrorsInVariables(1, 0, stable=True), data, {"u": 0.03, "y": 0.05}, tolerance=1e-2)
    for name, true in {"a1": -0.6, "b0": 1.0}.items():
        assert found[name].lower <= true <= found[name].upper
        assert found[name].gap <= 2e-2 * found[name].width


def test_an_offset_in_the_record() -> None:
    """A record that is not centred: without the offset nothing explains it, with it the truth is found."""
    drawn = first_order("output error", 20, 1)
    shifted = Dataset.from_arrays(
        input={"u": drawn.data.values("u")}, output={"y": drawn.data.values("y") + 7.0}, sampling_time=1.0
    )
    with pytest.raises(EmptyFeasibleSetError):
        identify(drawn.model, shifted, drawn.noise_bound)
    found = identify(OutputError(1, 0, offset=True, stable=True), shifted, drawn.noise_bound)
    truth = {**drawn.truth, "offset": 7.0 * (1 + drawn.truth["a1"])}
    for name, true in truth.items():
        assert found[name].lower <= true <= found[name].upper
        assert found[name].gap <= 1e-3 * found[name].width


def interrupt_at(call: int) -> Callable[[str], None]:
    calls = iter(range(1, 10_000))

    def progress(_: str) -> None:
        if next(calls) == call:
            raise KeyboardInterrupt

    return progress


@pytest.mark.parametrize("call", [1, 2, 3, 5])
def test_an_interrupted_run_keeps_what_is_proven(problem: FirstOrder, estimate: Estimate, call: int) -> None:
    model = problem.model.bound(b0=(-5, 5))
    found = identify(model, problem.data, problem.noise_bound, progress=interrupt_at(call))
    assert found.enclosure is not None
    assert found.enclosure.reason is Reason.INTERRUPTED
    assert "interrupted" in str(found)
    for name, true in problem.truth.items():
        assert found[name].lower <= true <= found[name].upper
        assert found[name].lower <= estimate[name].inner_lower
        assert found[name].upper >= estimate[name].inner_upper
    assert found["a1"].lower > -1  # the first end was proven before the interruption
    assert found["b0"].proof_upper is (Proof.PROVEN if found["b0"].upper < 5 else Proof.BOX)


@pytest.mark.parametrize("stop", [KeyboardInterrupt, MemoryError])
@pytest.mark.parametrize("step", ["with_finite_box", "_first_witness", "centre_status"])
def test_stopped_in_any_step_there_is_a_result(
    monkeypatch: pytest.MonkeyPatch, problem: FirstOrder, step: str, stop: type[BaseException]
) -> None:
    """Whatever is stopped, what comes back says what is proven so far: at least the prior box."""

    def stopped(*_: object, **__: object) -> None:
        raise stop

    monkeypatch.setattr(polynomial, step, stopped)
    try:
        found = identify(problem.model, problem.data, problem.noise_bound)
    except (KeyboardInterrupt, MemoryError) as lost:
        pytest.fail(f"{lost!r} in {step} left no result")
    for name, true in problem.truth.items():
        assert found[name].lower <= true <= found[name].upper


def test_the_hammerstein_box_is_labelled_as_derived() -> None:
    drawn = first_order("hammerstein", 20, 3)
    found = identify(drawn.model, drawn.data, drawn.noise_bound, order=1, rounds=2)
    assert found.derived == ("gamma1", "gamma2")
    assert {i.proof_lower for i in found.intervals} == {Proof.PROVEN}
    assert isinstance(found.model, type(Hammerstein(1, (3, 1))))
