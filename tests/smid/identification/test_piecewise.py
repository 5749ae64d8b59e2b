"""Models with Max, Min, Abs and sign: certified intervals of their thresholds."""

import numpy as np
import pytest
import sympy
from scipy.optimize import linprog, minimize_scalar

from benchmarks.soundness.cases import empty_case
from benchmarks.soundness.piecewise_problems import KINDS, piecewise_problem
from relaxations.algebra.polynomial import Polynomials
from smid import (
    Dataset,
    EmptyFeasibleSetError,
    FeasibleSet,
    Hammerstein,
    Model,
    ModelError,
    OutputError,
    Parameter,
    error_bound,
    identify,
)
from smid.feasible.assemble import CONSTANT
from smid.feasible.piecewise_functions import Kind, unfold
from smid.feasible.piecewise_hull import box, hull
from smid.feasible.regimes import Ranges, Side, ranges
from smid.identification.estimate import CentreStatus
from smid.models.symbols import signal, t

PROBLEMS = [(kind, seed) for seed in (1, 4, 5, 6) for kind in KINDS]  # an input that is held: 6


@pytest.mark.parametrize(("kind", "seed"), PROBLEMS)
def test_truth_lies_inside_every_interval(kind: str, seed: int) -> None:
    """With odd seeds the noise sits on its bound, so that the truth lies on the edge of the set."""
    problem = piecewise_problem(kind, seed, 12, on_bound=seed % 2 == 1)
    estimate = identify(problem.model, problem.data, problem.noise_bound, tolerance=0.5, order=1)
    for interval in estimate.intervals:
        assert interval.lower <= problem.truth[interval.name] <= interval.upper
        if not np.isnan(interval.inner_lower):
            assert interval.lower <= interval.inner_lower <= interval.inner_upper <= interval.upper


@pytest.mark.parametrize("kind", KINDS)
def test_the_truth_satisfies_the_relaxation(kind: str) -> None:
    """Parameters, noises and the kinks' own values, put into every constraint."""
    problem = piecewise_problem(kind, 2, 40, share=0.2)
    feasible = FeasibleSet(problem.model, problem.data, problem.noise_bound)
    assert feasible.openings
    noise = problem.data.values("y") - problem.clean
    point = np.zeros(feasible.n_variables)
    for k, name in enumerate(feasible.problem.names):
        if name in problem.truth:
            point[k] = problem.truth[name]
        elif name.startswith("eta"):
            point[k] = noise[int(name[4:-1])]
    for opening in feasible.openings:
        argument = opening.arguments.evaluate(point)
        positive = opening.hinge.kink.kind is Kind.POSITIVE_PART
        point[opening.variables] = np.maximum(argument, 0) if positive else np.sign(argument)
    assert np.abs(feasible.problem.equalities.evaluate(point)).max() < 1e-12
    assert feasible.problem.inequalities.evaluate(point).min() > -1e-12
    assert (point >= feasible.problem.lower - 1e-12).all()
    assert (point <= feasible.problem.upper + 1e-12).all()


def dead_zone(n: int, seed: int, d: float, noise_bound: float, upper: float = 1.0) -> tuple[Model, Dataset]:
    """Return a first-order model with a two-sided dead zone of one threshold, its gain without bounds."""
    rng = np.random.default_rng(seed)
    u = rng.uniform(-1, 1, n)
    v = np.sign(u) * np.maximum(np.abs(u) - d, 0)
    w = np.zeros(n)
    w[0] = 0.3
    for k in range(1, n):
        w[k] = 0.7 * w[k - 1] + 1.2 * v[k - 1]
    y = w + rng.uniform(-noise_bound, noise_bound, n)
    threshold = Parameter("d", 0, upper, null=0.0)
    model = OutputError(1, 0, stable=True).insert_before(
        "u", lambda x: sympy.Max(0, x - threshold.symbol) - sympy.Max(0, -x - threshold.symbol), parameters=[threshold]
    )
    return model, Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)


def least_noise(data: Dataset, pole: float, d: float) -> float:
    """Return the least noise bound at a fixed pole and threshold: a linear program in the gain and the start."""
    u, y = data.values("u"), data.values("y")
    v = np.where(u > d, u - d, np.where(u < -d, u + d, 0.0))
    g = np.zeros((len(u), 2))
    g[0, 1] = 1.0
    for k in range(1, len(u)):
        g[k] = -pole * g[k - 1]
        g[k, 0] += v[k - 1]
    one = np.ones((len(u), 1))
    found = linprog(
        [0, 0, 1],
        A_ub=np.block([[g, -one], [-g, -one]]),
        b_ub=np.r_[y, -y],
        bounds=[(None, None), (None, None), (0, None)],
    )
    return float(found.fun)


def least_over_poles(data: Dataset, d: float) -> float:
    """A grid of poles, then a line search."""
    poles = np.linspace(-0.95, 0.2, 12)
    values = [least_noise(data, p, d) for p in poles]
    best = int(np.argmin(values))
    bracket = poles[max(best - 1, 0)], poles[min(best + 1, len(poles) - 1)]
    polished = minimize_scalar(
        lambda p: least_noise(data, p, d), bounds=bracket, method="bounded", options={"xatol": 1e-6}
    )
    return min(float(polished.fun), min(values))


def test_a_threshold_agrees_with_the_oracle_to_a_percent() -> None:
    noise_bound = 0.05
    model, data = dead_zone(80, 0, 0.3, noise_bound)
    estimate = identify(model, data, noise_bound)
    d = estimate["d"]
    assert estimate.derived == ("b0",)
    assert d.gap < 2e-3 * d.width
    assert least_over_poles(data, d.lower + 0.01 * d.width) <= noise_bound
    assert least_over_poles(data, d.upper - 0.01 * d.width) <= noise_bound
    outside = [d.lower - 0.01 * d.width, d.upper + 0.01 * d.width, *np.linspace(0, d.lower - d.width, 5)]
    for value in [*outside, *np.linspace(d.upper + d.width, 0.95, 5)]:
        assert least_over_poles(data, float(value)) > noise_bound


def test_a_pole_beside_a_threshold_agrees_with_the_oracle() -> None:
    noise_bound = 0.05
    model, data = dead_zone(60, 1, 0.3, noise_bound)
    estimate = identify(model, data, noise_bound)
    pole, d = estimate["a1"], estimate["d"]

    def least(value: float) -> float:
        grid = np.linspace(d.lower - d.width, d.upper + d.width, 31)
        values = [least_noise(data, value, x) for x in grid]
        best = int(np.argmin(values))
        polished = minimize_scalar(
            lambda x: least_noise(data, value, x),
            bounds=(grid[max(best - 1, 0)], grid[min(best + 1, 30)]),
            method="bounded",
            options={"xatol": 1e-7},
        )
        return min(float(polished.fun), min(values))

    for end, inwards in ((pole.lower, 1), (pole.upper, -1)):
        assert least(end + inwards * 0.01 * pole.width) <= noise_bound
        assert least(end - inwards * 0.01 * pole.width) > noise_bound


def test_a_dead_zone_that_is_there_excludes_zero_and_one_that_is_not_does_not() -> None:
    model, data = dead_zone(60, 3, 0.2, 0.05)
    assert identify(model, data, 0.05)["d"].lower > 0.1
    model, data = dead_zone(60, 3, 0.0, 0.05)
    found = identify(model, data, 0.05)
    assert found["d"].lower == 0.0
    assert found["d"].inner_lower < 1e-9
    assert found["d"].upper < 0.1


def test_the_centre_is_decided_and_the_result_simulates() -> None:
    model, data = dead_zone(40, 4, 0.3, 0.05)
    estimate = identify(model, data, 0.05)
    assert estimate.centre_status is not CentreStatus.UNDECIDED
    assert (estimate.nearest is None) == (estimate.centre_status is CentreStatus.FEASIBLE)
    assert all(i.lower <= estimate.parameters[i.name] <= i.upper for i in estimate.intervals)
    assert estimate.model.simulate(data).outputs[0]["y"].shape == (40,)
    assert "parametric lift in a1" in str(estimate)
    assert set(estimate.to_dict()["derived_boxes"]) == {"b0"}


def test_an_empty_set_is_proven() -> None:
    model, data = dead_zone(40, 5, 0.6, 0.02, upper=0.3)
    with pytest.raises(EmptyFeasibleSetError, match=r"proven: no parameters explain.*Raise the bound") as caught:
        identify(model, data, 0.02)
    assert caught.value.least_bound is None
    assert caught.value.samples


def test_a_last_sub_box_that_is_proven_empty_when_it_is_finished_ends_the_search() -> None:
    case = empty_case(95003)
    with pytest.raises(EmptyFeasibleSetError):
        identify(case.model, case.data, case.noise_bound, order=1, rounds=2, tolerance=0.5)


def test_two_experiments_share_a_threshold() -> None:
    records = []
    for number in (0, 1):
        problem = piecewise_problem("dead zone", 2, 16)
        half = slice(0, 9) if number == 0 else slice(6, 16)
        values = {name: problem.data.values(name)[half] for name in ("u", "y")}
        records.append(
            Dataset.from_arrays(
                input={"u": values["u"]}, output={"y": values["y"]}, sampling_time=1.0, name=f"run{number}"
            )
        )
    estimate = identify(problem.model, Dataset.merge(records), problem.noise_bound, tolerance=0.5)
    for interval in estimate.intervals:
        assert interval.lower <= problem.truth[interval.name] <= interval.upper


def test_kinks_are_shared_between_shifts_and_signs() -> None:
    d, u, w = Parameter("d", 0, 1), signal("u"), signal("w")
    base = OutputError(1, 0)
    model = base.insert_before("u", lambda x: sympy.Abs(x - d.symbol), parameters=[d])
    model = model.add_term("w", sympy.Max(0, d.symbol - u[t - 3]))
    (kink,) = unfold(model).kinks
    assert sympy.expand(kink.argument - (u[t] - d.symbol)) in (0, 2 * d.symbol - 2 * u[t])
    assert not kink.constant
    assert unfold(base).kinks == ()
    delayed = base.insert_before("u", lambda x: sympy.Max(0, 1 - sympy.Abs(d.symbol - 1)) * x, parameters=[d])
    assert [k.constant for k in unfold(delayed).kinks] == [True, True]
    assert w[t] not in kink.argument.atoms(sympy.Indexed)


def test_a_range_that_ends_at_zero_is_decided_exactly() -> None:
    tenth = 0.1
    family = Polynomials.from_terms([{(0,): -1.0, (): tenth}, {(0,): 3.0, (): -3 * tenth}, {(0, 1): 1.0}])
    found = ranges(family, np.array([0.0, -np.inf]), np.array([tenth, np.inf]))
    assert found.low[0] == 0.0
    assert found.high[0] >= tenth
    assert found.low[2] == -np.inf
    assert found.sides(Kind.POSITIVE_PART)[0] == Side.POSITIVE
    assert found.sides(Kind.SIGN)[0] == Side.OPEN  # zero has no sign


@pytest.mark.parametrize("kind", Kind)
def test_every_pair_of_a_kink_lies_in_its_hull(kind: Kind) -> None:
    rng = np.random.default_rng(0)
    count = 50
    low, high = -rng.uniform(0, 2, count), rng.uniform(0, 2, count)
    low[:3], high[3:6] = 0.0, np.inf if kind is Kind.SIGN else 1.0
    x = np.clip(rng.uniform(-2, 2, (20, count)), low, high)
    x[0] = 0.0
    value = np.maximum(x, 0) if kind is Kind.POSITIVE_PART else np.sign(x)
    arguments = Polynomials.variables(np.arange(count))
    within = Ranges(low, high)
    family = hull(kind, arguments, np.arange(count, 2 * count), within)
    ends = box(kind, within)
    for row, values in zip(x, value, strict=True):
        assert family.evaluate(np.concatenate([row, values])).min() >= -1e-12
        assert ((values >= ends[0]) & (values <= ends[1])).all()


def test_what_cannot_be_bounded_says_why() -> None:
    model, data = dead_zone(30, 8, 0.3, 0.05)
    with pytest.raises(ModelError, match="the least noise bound of a model with Max"):
        error_bound(model, data)
    with pytest.raises(ModelError, match="method='sparse' does not apply"):
        identify(model, data, 0.05, method="sparse")
    s = Parameter("s", 0, 1)
    bent = Hammerstein(1, (3, 1), stable=True).insert_before("u", lambda x: sympy.Max(0, x - s.symbol), parameters=[s])
    with pytest.raises(ModelError, match="raised to a power"):
        identify(bent, data, 0.05)
    limited = OutputError(1, 0).replace_line("w", sympy.Min(s.symbol, OutputError(1, 0).lines[0].expression), [s])
    with pytest.raises(ModelError, match=r"inside Max, Min or Abs and may be arbitrarily large.*give bounds to"):
        identify(limited, data, 0.05)


def test_a_constant_kink_is_one_variable() -> None:
    problem = piecewise_problem("delay", 0, 30)
    feasible = FeasibleSet(problem.model, problem.data, problem.noise_bound)
    assert {o.experiment for o in feasible.openings} == {CONSTANT}
    assert all(len(o.variables) == 1 for o in feasible.openings)
    lower, upper = feasible.problem.lower[:3].copy(), feasible.problem.upper[:3].copy()
    lower[2], upper[2] = 1.0, 2.0
    assert not feasible.on_box(lower, upper).openings  # between two whole delays the interpolation is linear
