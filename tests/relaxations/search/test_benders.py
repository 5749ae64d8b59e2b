"""Cuts: true at every feasible point whatever their multipliers, exact where signs are settled, tight in the end."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

from relaxations.errors import ProblemError
from relaxations.formats.expressions import problem_of, variables
from relaxations.moments.parametric_lift import complicating_variables
from relaxations.points.witness import verify
from relaxations.proof.proof_steps import Branches, Step
from relaxations.search.benders.cuts import Cuts
from relaxations.search.benders.master import contradiction, lower_bound, shrink
from relaxations.search.benders.program import ask
from relaxations.search.benders.search import Asker
from relaxations.search.benders.split import Split, frame
from relaxations.search.benders.tree import bound_end
from relaxations.search.enclosure import Reason
from relaxations.search.hierarchy import intervals
from relaxations.search.plan import LONG
from smid import Dataset, EmptyFeasibleSetError, ErrorsInVariables, FeasibleSet, Hammerstein, OutputError, identify

NOISE = 0.05


def record(n_samples, seed, poles=1):
    rng = np.random.default_rng(seed)
    a, b = ((-0.9,), (0.5, -0.1)) if poles == 1 else ((-1.2, 0.5), (0.8, 0.4))
    u = rng.uniform(-1, 1, n_samples)
    w = lfilter(b, [1.0, *a], u)
    noise = rng.uniform(-NOISE, NOISE, (2, n_samples))
    data = Dataset.from_arrays(input={"u": u + noise[0]}, output={"y": w + noise[1]}, sampling_time=1.0)
    return ErrorsInVariables(poles, 1, stable=True), data, np.array([*a, *b]), noise


def boxed(problem, radius=1.0):
    lower, upper = problem.lower.copy(), problem.upper.copy()
    loose = ~np.isfinite(upper - lower)
    lower[loose], upper[loose] = -radius, radius
    return problem.with_box(lower, upper)


def truth_of(problem, parameters, noise):
    """Return the point that made the record: parameters, then noises by their names, eta[k] and zeta[k]."""
    channel = {"zeta": noise[0], "eta": noise[1]}
    noises = [name.rstrip("]").split("[") for name in problem.names[len(parameters) :]]
    return np.array([*parameters, *(channel[own][int(k)] for own, k in noises)])


@settings(deadline=None, max_examples=40)
@given(st.integers(0, 10**6))
def test_no_cut_excludes_a_feasible_point_on_any_box(seed):
    rng = np.random.default_rng(seed)
    model, data, parameters, noise = record(12, seed, poles=1 + seed % 2)
    problem = boxed(FeasibleSet(model, data, NOISE).problem)
    point = truth_of(problem, parameters, noise)
    assert np.abs(problem.equalities.evaluate(point)).max() < 1e-12
    outer = complicating_variables(problem)
    split = Split.of(problem, outer)
    multipliers = rng.standard_normal((6, problem.equalities.n_rows + problem.inequalities.n_rows))
    multipliers[:, problem.equalities.n_rows :] = np.abs(multipliers[:, problem.equalities.n_rows :])
    cuts = Cuts.of(split, multipliers)
    p = point[outer]
    assert (cuts.tangents(p)[0] >= -1e-12).all()
    width = 10.0 ** rng.uniform(-12, 0, (2, len(outer)))
    lower, upper = p - width[0], p + width[1]
    centre, radius = frame(lower, upper)
    b, a = cuts.on_box(lower, upper)
    assert (b + a @ ((p - centre) / radius) >= -1e-12).all()


def test_on_a_box_without_width_a_cut_says_what_it_says_at_the_point():
    model, data, parameters, _ = record(15, 3)
    problem = boxed(FeasibleSet(model, data, NOISE).problem)
    split = Split.of(problem, complicating_variables(problem))
    answer = ask(split, parameters * 1.2)
    assert answer.excess > 0
    cuts = Cuts.of(split, answer.multipliers[None])
    b, a = cuts.on_box(parameters * 1.2, parameters * 1.2)
    assert b == pytest.approx(-answer.excess, abs=1e-7)
    assert not a.any()


def test_a_cut_of_curved_monomials_holds():
    a, g, x = variables("a g x")
    problem, _ = problem_of(x, [a * g * g * x == 0.3, a >= 0.5, a <= 2, g >= 0.2, g <= 1, x >= -1, x <= 1])
    split = Split.of(problem, np.array([0, 1]))
    cuts = Cuts.of(split, np.array([[1.0], [-1.0]]))
    rng = np.random.default_rng(0)
    for _ in range(300):
        p = np.array([rng.uniform(0.5, 2), rng.uniform(0.2, 1)])
        if abs(0.3 / (p[0] * p[1] ** 2)) > 1:
            continue
        lower, upper = p - rng.uniform(0, 0.3, 2), p + rng.uniform(0, 0.3, 2)
        centre, radius = frame(lower, upper)
        b, slope = cuts.on_box(lower, upper)
        assert (b + slope @ ((p - centre) / radius) >= -1e-12).all()


@settings(deadline=None, max_examples=100)
@given(st.integers(0, 10**6))
def test_rows_shrink_a_box_and_bound_a_cost_without_losing_a_point(seed):
    rng = np.random.default_rng(seed)
    n, rows = rng.integers(1, 5), rng.integers(1, 8)
    a = rng.standard_normal((rows, n)) * 10.0 ** rng.uniform(-3, 3, (rows, 1))
    s = rng.uniform(-1, 1, n)
    b = -a @ s + np.abs(rng.standard_normal(rows)) * rng.choice([0.0, 1.0], rows)
    kept = shrink(b, a)
    assert not kept.empty
    assert (kept.lower <= s + 1e-12).all()
    assert (s - 1e-12 <= kept.upper).all()
    assert contradiction(b + 1e-9 * np.abs(a).sum(axis=1), a) is None
    cost, weights = rng.standard_normal(n), rng.uniform(0, 1, rows)
    assert lower_bound(cost, b, a, weights) <= cost @ s + 1e-12


def test_the_excess_is_how_much_larger_the_noise_would_have_to_be():
    model, data, parameters, _ = record(20, 4)
    problem = boxed(FeasibleSet(model, data, NOISE).problem)
    split = Split.of(problem, complicating_variables(problem))
    inside = ask(split, parameters)
    assert inside.excess <= 1e-9  # the truth is feasible
    outside = ask(split, parameters * 1.1)
    scaled = Split.of(boxed(FeasibleSet(model, data, NOISE * (1 + outside.excess)).problem), split.outer)
    assert ask(scaled, parameters * 1.1).excess == pytest.approx(0, abs=1e-6)


def test_a_cut_that_rounding_blurs_is_asked_anew_not_split_for():
    a, x = variables("a x")
    problem, _ = problem_of(x, [a * x == 1, a >= 0.1, a <= 2, x >= 0, x <= 2])  # a >= 1/2
    split = Split.of(problem, np.array([0]))
    clear = Cuts.of(split, np.array([[1.0]]))
    blurred = replace(clear, errors=clear.errors + 1e-6)
    goal = 0.5 - 1e-7
    found = bound_end(
        Asker(blurred), 0, 1, problem.lower[:1], problem.upper[:1], goal, 30, lambda _: goal, lambda _: None
    )
    assert goal <= found.bound <= 0.5


@pytest.mark.parametrize("poles", [1, 2])
def test_cuts_agree_with_the_lift(poles):
    model, data, parameters, _ = record(40, 7, poles)
    by_cuts = identify(model, data, NOISE, method="benders", tolerance=1e-3)
    by_lift = identify(model, data, NOISE, method="lift", order=1, nodes=40, tolerance=1e-3)
    assert by_cuts.enclosure.method == "benders"
    for one, other, true in zip(by_cuts.intervals, by_lift.intervals, parameters, strict=True):
        assert one.lower <= true <= one.upper
        assert one.gap <= 1e-3 * one.width
        # Verified points of one lie within what the other proves, and both ends are close.
        assert one.lower <= other.inner_lower
        assert other.inner_upper <= one.upper
        assert other.lower <= one.inner_lower
        assert one.inner_upper <= other.upper
        assert one.lower == pytest.approx(other.lower, abs=5e-3 * other.width)
        assert one.upper == pytest.approx(other.upper, abs=5e-3 * other.width)


@pytest.mark.parametrize("seed", range(6))
def test_the_truth_lies_inside_whatever_the_record(seed):
    model, data, parameters, _ = record(12 + 4 * seed, 100 + seed)
    found = identify(model, data, NOISE, method="benders", tolerance=1e-2)
    for interval, true in zip(found.intervals, parameters, strict=True):
        assert interval.lower <= true <= interval.upper
        assert interval.lower <= interval.inner_lower <= interval.inner_upper <= interval.upper


def test_ends_of_variables_that_do_not_complicate_are_bounded_too():
    t = np.arange(40)
    u = np.concatenate([t[:20], t[20:0:-1]]) / 20.0
    w = lfilter([0.0, 0.4], [1.0, -0.6], 0.8 * u**2)
    y = w + np.random.default_rng(1).uniform(-0.02, 0.02, len(u))
    data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    model = Hammerstein(poles=1, powers=(2,), stable=True)
    by_cuts, by_lift = (identify(model, data, 0.02, method=method, tolerance=1e-2) for method in ("benders", "lift"))
    for one, other in zip(by_cuts.intervals, by_lift.intervals, strict=True):
        assert one.lower <= other.inner_lower
        assert other.inner_upper <= one.upper
        assert one.width <= 1.05 * other.width


def test_a_long_record_is_bounded_by_cuts_and_its_witnesses_are_feasible():
    model, data, parameters, _ = record(LONG, 11)
    found = identify(model, data, NOISE, tolerance=1e-2)
    assert found.enclosure.method == "benders"
    assert found.enclosure.reason is Reason.TIGHT
    problem = FeasibleSet(model, data, NOISE).problem
    for k, (interval, true) in enumerate(zip(found.intervals, parameters, strict=True)):
        assert interval.lower <= true <= interval.upper
        assert interval.gap <= 1e-2 * interval.width
        far = max(found.enclosure.witnesses, key=lambda w, k=k: w[k])
        assert verify(problem, problem.variable(k, -1), far) is not None


def test_noise_that_is_too_small_is_proven_so_by_cuts():
    model, data, _, _ = record(60, 5)
    problem = boxed(FeasibleSet(model, data, 0.2 * NOISE).problem)
    found = intervals(problem, [0, 1, 2], method="benders")
    assert found.reason is Reason.EMPTY
    assert found.empty.margin > 0
    assert found.empty.weights.sum() == pytest.approx(1)
    model, data, _, _ = record(14, 5)
    with pytest.raises(EmptyFeasibleSetError, match="proven"):
        identify(model, data, 0.1 * NOISE, method="benders")


def test_what_is_proven_before_an_interruption_is_kept():
    model, data, parameters, _ = record(60, 6)
    problem = boxed(FeasibleSet(model, data, NOISE).problem, 2.0)

    def interrupt(line):
        if line.startswith("b0: proven"):
            raise KeyboardInterrupt

    found = intervals(problem, [0, 1, 2], method="benders", progress=interrupt)
    assert found.reason is Reason.INTERRUPTED
    assert found.intervals[0].upper < problem.upper[0]
    for interval, true in zip(found.intervals, parameters, strict=True):
        assert interval.lower <= true <= interval.upper


def test_what_cuts_cannot_do_is_said_before_any_work():
    x = variables("a b c d e f g h i")
    unit = [end for v in x for end in (v >= -1, v <= 1)]
    problem, _ = problem_of(x[0], [*unit, sum(v**2 for v in x) <= 1])
    with pytest.raises(ProblemError, match="too many variables complicate"):
        intervals(problem, [0], method="benders")


def test_a_record_too_long_for_the_memory_is_refused(monkeypatch):
    model, data, _, _ = record(20, 8)
    problem = boxed(FeasibleSet(model, data, NOISE).problem)
    monkeypatch.setattr("relaxations.moments.conic.os.sysconf", lambda _: 100)
    with pytest.raises(ProblemError, match="a shorter record"):
        intervals(problem, [0], method="benders")


def test_an_empty_set_without_equalities_is_proven_so_by_cuts():
    x, y = variables("x y")
    problem, _ = problem_of(x, [x**2 + y**2 <= 1, x + y >= 2])
    found = intervals(problem, [0], method="benders")
    assert found.reason is Reason.EMPTY
    assert found.empty.weights.shape == (0,)


def test_an_interval_as_narrow_as_the_rounding_is_not_branched_for_ever():
    """What keeps a bound there is the solver's rounding, and a deep tree is a file that cannot be written."""
    rng, bound = np.random.default_rng(0), 1e-9
    u = rng.normal(size=12)
    y = np.r_[0, u[:-1]] + rng.uniform(-bound, bound, 12)
    data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    model = OutputError(na=1, nb=0, stable=True).bound(b0=(0.5, 2.0))
    steps: list[Step] = []
    found = intervals(
        FeasibleSet(model, data, bound).problem, [0], method="benders", tolerance=1e-3, record=steps.append
    )
    assert found.intervals[0].lower <= 0.0 <= found.intervals[0].upper

    def depth(step: Step) -> int:
        inside = [own for part in step.parts for own in part.steps] if isinstance(step, Branches) else []
        return 1 + max(map(depth, inside), default=0)

    assert max(map(depth, steps)) < 100
