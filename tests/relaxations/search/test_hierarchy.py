"""Intervals: true whatever happens on the way, empty sets proven, wrong calls refused before any work."""

import dataclasses

import numpy as np
import pytest

from relaxations.algebra.polynomial import Polynomials
from relaxations.errors import ProblemError
from relaxations.problem.problem import PolynomialProblem
from relaxations.proof import bounding
from relaxations.search.enclosure import Reason, contracted
from relaxations.search.hierarchy import intervals
from relaxations.search.plan import Plan


def with_noise_bound(model, bound):
    first = 1 + model.n_linear
    lower, upper = model.problem.lower.copy(), model.problem.upper.copy()
    lower[first:], upper[first:] = -bound, bound
    return model.problem.with_box(lower, upper)


def contains(enclosure, points, targets):
    return all(
        interval.lower <= points[:, k].min() and points[:, k].max() <= interval.upper
        for interval, k in zip(enclosure.intervals, targets, strict=True)
    )


@pytest.mark.parametrize("method", ["auto", "lift", "sparse", "dense", "terms", "chordal", "textbook"])
def test_every_method_contains_every_feasible_point(output_error, method):
    model = output_error(4 if method == "dense" else 7, seed=8)
    points = model.sample(60, np.random.default_rng(9))
    found = intervals(model.problem, [0, 1], method=method, order=2, rounds=2)
    assert contains(found, points, [0, 1])
    for interval in found.intervals:
        assert interval.lower <= interval.inner_lower or np.isnan(interval.inner_lower)
        assert interval.inner_upper <= interval.upper or np.isnan(interval.inner_upper)


def test_noise_is_a_target_like_any_other(output_error):
    model = output_error(8, seed=10)
    targets = [2, 5, 9]
    found = intervals(model.problem, targets)
    assert contains(found, model.sample(60, np.random.default_rng(11)), targets)
    assert [i.name for i in found.intervals] == ["e0", "e3", "e7"]


@pytest.mark.parametrize("kind", ["output_error", "hammerstein"])
def test_a_noise_bound_below_the_least_one_is_proven_empty(request, kind):
    model = request.getfixturevalue(kind)(15, seed=2)
    low, high = model.problem.lower[0], model.problem.upper[0]
    least = min(model.least_noise(p) for p in np.linspace(low, high, 400))
    found = intervals(with_noise_bound(model, 0.8 * least), [0])
    assert found.reason is Reason.EMPTY
    assert found.empty.weights.shape == (model.problem.equalities.n_rows,)
    assert (found.empty.weights >= 0).all()
    assert found.empty.weights.sum() == pytest.approx(1)
    assert intervals(with_noise_bound(model, 1.01 * least + 1e-9), [0], rounds=3).empty is None


def test_the_samples_that_carry_the_proof_of_emptiness_have_the_weight(output_error):
    model = output_error(20, seed=3)
    spoilt = model.y.copy()
    spoilt[12] += 3.0
    # The same rows with one output moved: sample 12 appears in equations 11 and 12 (t = 12 and 13).
    p = model.problem.equalities
    mid = p.coefficients.mid.copy()
    for t, key in ((12, []), (13, [0])):
        hit = (p.rows == t - 1) & [[v for v in f if v >= 0] == key for f in p.factors.tolist()]
        assert hit.sum() == 1
        mid[hit] += 3.0
    rows = Polynomials(p.n_rows, p.rows, p.factors, type(p.coefficients).exact(mid))
    found = intervals(dataclasses.replace(model.problem, equalities=rows), [0])
    assert found.reason is Reason.EMPTY
    assert set(np.argsort(found.empty.weights)[-2:]) & {10, 11, 12, 13}


def test_equalities_of_different_degrees_do_not_take_the_blame_for_each_other():
    # p^2 = z can always be met; w = 3 cannot in [-1, 1].
    harmless, guilty = {(0, 0): 1.0, (1,): -1.0}, {(2,): 1.0, (): -3.0}
    for rows in ([harmless, guilty], [guilty, harmless]):
        problem = PolynomialProblem(
            ("p", "z", "w"), -np.ones(3), np.ones(3), Polynomials.from_terms(rows), Polynomials.empty()
        )
        found = intervals(problem, [0], method="lift", order=1)
        assert found.reason is Reason.EMPTY
        assert found.empty.weights.sum() == pytest.approx(1)
        assert found.empty.weights[rows.index(guilty)] >= 0.5 - 1e-9


@pytest.mark.parametrize(("failure", "reason"), [(KeyboardInterrupt, Reason.INTERRUPTED), (MemoryError, Reason.MEMORY)])
@pytest.mark.parametrize("call", [1, 2, 3, 6])
def test_a_stop_inside_a_solve_returns_the_ends_proven_so_far(output_error, monkeypatch, failure, reason, call):
    model = output_error(15, seed=4)
    points = model.sample(40, np.random.default_rng(5))
    whole = intervals(model.problem, [0, 1], order=1, tolerance=0.0)
    real, calls = bounding.solve, []

    def fails_at_last(*arguments):
        calls.append(1)
        if len(calls) == call:
            raise failure
        return real(*arguments)

    monkeypatch.setattr(bounding, "solve", fails_at_last)
    found = intervals(model.problem, [0, 1], order=1, tolerance=0.0)
    assert found.reason is reason
    assert found.solves == call - 1
    assert contains(found, points, [0, 1])
    for k, (so_far, end) in enumerate(zip(found.intervals, whole.intervals, strict=True)):
        assert model.problem.lower[k] <= so_far.lower <= end.lower + 1e-12
        assert end.upper - 1e-12 <= so_far.upper <= model.problem.upper[k]
    proven = [i.lower > model.problem.lower[k] for k, i in enumerate(found.intervals)]
    assert proven[0] == (call > 1)


@pytest.mark.parametrize("failure", [KeyboardInterrupt, MemoryError])
def test_a_stop_while_a_relaxation_is_built_returns_the_box(output_error, monkeypatch, failure):
    model = output_error(6)

    def fails(*_, **__):
        raise failure

    monkeypatch.setattr("relaxations.search.by_rounds.relax", fails)
    found = intervals(model.problem, [0, 1])
    assert [(i.lower, i.upper, i.from_box) for i in found.intervals] == [
        (-1.0, 1.0, (True, True)),
        (-5.0, 5.0, (True, True)),
    ]
    assert found.solves == 0


def no_solve(*_, **__):
    raise AssertionError("a solve was begun")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"method": "magic"},
            "unknown method 'magic': choose auto, benders, lift, rlt, sparse, dense, terms, chordal, textbook",
        ),
        ({"rounds": 0}, "rounds is 0: at least one is needed"),
        ({"order": 0}, "the least order is 1"),
        ({"solver": "none"}, "unknown solver 'none': choose one of clarabel"),
        ({"method": "dense", "order": 4}, "lower the order"),
    ],
)
def test_a_wrong_call_is_refused_before_any_solve(hammerstein, monkeypatch, options, message):
    monkeypatch.setattr(bounding, "solve", no_solve)
    with pytest.raises(ProblemError, match=message):
        intervals(hammerstein(12).problem, [0], **options)


def test_an_infinite_box_is_refused_before_any_solve(output_error, monkeypatch):
    monkeypatch.setattr(bounding, "solve", no_solve)
    problem = output_error(6).problem
    upper = problem.upper.copy()
    upper[1] = np.inf
    with pytest.raises(ProblemError, match="b1 has no finite box"):
        intervals(problem.with_box(problem.lower, upper), [0])


def test_the_default_method_is_the_lift_and_says_so(output_error):
    problem = output_error(6).problem
    plan = Plan.of(problem)
    assert (plan.method.name, plan.order) == ("lift", 2)
    found = intervals(problem, [0])
    assert found.method == "lift"
    assert found.complicating == ("a",)
    assert found.largest_block <= 3


def test_tight_means_that_every_gap_is_below_the_tolerance(output_error):
    found = intervals(output_error(20, seed=1).problem, [0, 1], tolerance=1e-4)
    assert found.reason is Reason.TIGHT
    for interval in found.intervals:
        assert 0 <= interval.gap <= 1e-4 * interval.width
        assert interval.lower < interval.centre < interval.upper
        assert interval.width == interval.upper - interval.lower


def test_without_witnesses_the_gap_is_infinite(output_error):
    found = intervals(output_error(6).problem, [0], witnesses=False)
    assert found.witnesses == ()
    assert found.intervals[0].gap == float("inf")


def test_an_end_that_the_box_sets_is_told(output_error):
    model = output_error(10, seed=2)
    upper = model.problem.upper.copy()
    upper[0] = model.truth[0]
    found = intervals(model.problem.with_box(model.problem.lower, upper), [0])
    assert found.intervals[0].from_box == (False, True)
    assert found.intervals[0].upper == model.truth[0]


def test_known_points_serve_as_witnesses(output_error):
    model = output_error(10, seed=2)
    found = intervals(model.problem, [0], known=[model.truth], rounds=1, order=1)
    assert found.intervals[0].inner_lower <= model.truth[0] <= found.intervals[0].inner_upper


def test_contraction_keeps_every_feasible_point(output_error):
    model = output_error(10, seed=6)
    found = intervals(model.problem, [0, 1], witnesses=False)
    smaller = contracted(model.problem, found)
    assert (smaller.lower[:2] > model.problem.lower[:2]).all()
    points = model.sample(60, np.random.default_rng(7))
    assert (points >= smaller.lower).all()
    assert (points <= smaller.upper).all()


def test_progress_is_told_in_lines(output_error):
    lines = []
    intervals(output_error(6).problem, [0], progress=lines.append)
    assert lines
    assert all(line.startswith("a in [") for line in lines)


def test_branching_closes_the_gap_that_contraction_leaves(hammerstein):
    model = hammerstein(20, seed=0)
    targets = range(len(model.truth))
    stalled = intervals(model.problem, targets, order=1, rounds=3, tolerance=1e-3)
    branched = intervals(model.problem, targets, order=1, rounds=3, tolerance=1e-3, nodes=200)
    assert stalled.reason is not Reason.TIGHT
    assert branched.reason is Reason.TIGHT
    for before, after, true in zip(stalled.intervals, branched.intervals, model.truth, strict=True):
        assert before.lower <= after.lower <= true <= after.upper <= before.upper
        assert after.lower <= after.inner_lower
        assert after.inner_upper <= after.upper
        assert after.gap <= 1e-3 * after.width
