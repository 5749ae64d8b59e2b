"""Boxes proven from the data: they hold the truth, and where nothing bounds a parameter that is said."""

from functools import cache

import numpy as np
import pytest
import sympy

from benchmarks.soundness.random_problems import RandomProblem, random_problem
from relaxations.search.enclosure import Proof
from smid import (
    CentreStatus,
    Dataset,
    ErrorsInVariables,
    FeasibleSet,
    Hammerstein,
    Model,
    ModelError,
    OutputError,
    identify,
    load_model,
    save_model,
    verify,
)
from smid.identification.finite_box import Boxed, with_finite_box
from smid.identification.products import products_needed
from smid.models import Line, Measurement, Parameter
from smid.models.edit_lines import rename_channels
from smid.models.symbols import signal, t

SEEDS = 16


@cache
def boxed_problem(seed: int) -> tuple[RandomProblem, FeasibleSet, Boxed]:
    problem = random_problem(seed)
    feasible = FeasibleSet(problem.model, problem.data, problem.noise_bound)
    return problem, feasible, with_finite_box(feasible)


@pytest.mark.parametrize("seed", range(SEEDS))
def test_a_derived_box_holds_the_truth(seed: int) -> None:
    problem, feasible, boxed = boxed_problem(seed)
    names = boxed.feasible.problem.names
    if boxed.unbounded:  # then nothing was invented either
        assert set(boxed.unbounded) <= set(feasible.problem.unbounded)
        return
    assert set(boxed.derived) == set(feasible.problem.unbounded)
    assert not boxed.feasible.problem.unbounded
    for name, true in problem.truth.items():
        k = names.index(name)
        assert boxed.feasible.problem.lower[k] <= true <= boxed.feasible.problem.upper[k]
    # A prior is kept, or tightened; it never grows.
    assert (boxed.feasible.problem.lower >= feasible.problem.lower).all()
    assert (boxed.feasible.problem.upper <= feasible.problem.upper).all()


def test_most_of_the_random_problems_get_a_box() -> None:
    """The test above would pass if no box were ever proven."""
    assert sum(not boxed_problem(seed)[2].unbounded for seed in range(SEEDS)) >= 0.75 * SEEDS


def test_a_finite_prior_is_left_alone() -> None:
    problem = random_problem(0)
    model = problem.model.bound(b0=(-10, 10))
    feasible = FeasibleSet(model, problem.data, problem.noise_bound)
    boxed = with_finite_box(feasible)
    assert boxed.feasible is feasible
    assert (boxed.derived, boxed.unbounded) == ((), ())


def test_products_are_taken_where_a_factor_may_vanish_or_two_parameters_have_no_box() -> None:
    a1, a2, alpha, g1, g2, b0 = sympy.symbols("alpha1 alpha2 alpha gamma1 gamma2 beta0", real=True)

    def expanded(products: dict[str, sympy.Expr]) -> set[sympy.Expr]:
        return {sympy.expand(own) for own in products.values()}

    one = Hammerstein(1, (3, 1), stable=True)
    assert expanded(products_needed(one, ("gamma1", "gamma2"))) == {g1 + alpha * g1, g2 + alpha * g2}
    two = products_needed(Hammerstein(2, (3,), stable=True), ("gamma1",))
    assert expanded(two) == {g1 + a1 * g1 + a2 * g1}
    zero = products_needed(Hammerstein(1, (3,), 1, stable=True), ("gamma1", "beta0"))
    assert expanded(zero) == {b0 * g1, g1 + alpha * g1}
    assert products_needed(OutputError(2, 1, stable=True), ("b0", "b1")) == {}


@pytest.mark.parametrize("stable", [True, False])
@pytest.mark.parametrize(("poles", "zeros", "fixed"), [(1, 1, "beta0"), (2, 1, "gamma2"), (1, 2, ""), (2, 0, "gamma2")])
def test_gains_and_zeros_of_a_hammerstein_model_get_a_box(poles: int, zeros: int, fixed: str, stable: bool) -> None:
    denominator = np.array([[1.0, -0.6], [1.0, -1.1, 0.4]][poles - 1])
    numerator, gains = np.array([1.0, 0.5, -0.2])[: zeros + 1], np.array([0.7, 1.0])
    if not fixed:  # unit DC gain
        numerator = numerator * denominator.sum() / numerator.sum()
    names = ["alpha"] if poles == 1 else ["alpha1", "alpha2"]
    names += ["gamma1", "gamma2", *(["beta"] if zeros == 0 else [f"beta{k}" for k in range(zeros + 1)])]
    truth = dict(zip(names, [*denominator[1:], *gains, *numerator], strict=True))
    rng = np.random.default_rng(poles + 10 * zeros)
    u = rng.uniform(-1, 1, 40)
    v, w = gains[0] * u**3 + gains[1] * u, np.zeros(40)
    for k in range(40):
        w[k] = -sum(denominator[i] * w[k - i] for i in range(1, poles + 1) if k >= i)
        w[k] += sum(numerator[j] * v[k - 1 - j] for j in range(zeros + 1) if k >= 1 + j)
    known = {"unit_dc_gain": False, "fixed": {fixed: truth[fixed]}} if fixed else {}
    model = Hammerstein(poles, (3, 1), zeros, stable=stable, **known)
    feasible = FeasibleSet(model, record(u, w + rng.uniform(-0.02, 0.02, 40)), 0.02)
    boxed = with_finite_box(feasible)
    assert boxed.unbounded == ()
    problem = boxed.feasible.problem
    for name, low, high in zip(problem.names, problem.lower, problem.upper, strict=True):
        if name in truth:
            assert -100 < low <= truth[name] <= high < 100, name


def record(u: np.ndarray, y: np.ndarray) -> Dataset:
    return Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)


def unbounded_problems() -> dict[str, tuple[Model, Dataset, float, tuple[str, ...]]]:
    rng = np.random.default_rng(0)
    n = 12
    late = np.r_[np.zeros(n - 1), 1.0]  # it excites, but only after the last sample that any equation reads
    decay = 0.9 ** np.arange(n) + rng.uniform(-0.01, 0.01, n)
    wave = record(rng.normal(size=n), np.sin(np.arange(n)))
    return {
        # b0 multiplies zeros only.
        "the input comes too late": (OutputError(stable=True), record(late, decay), 0.01, ("b0",)),
        # The noise explains the whole record, so w = 0, b0 = 0 and any pole do.
        "all noise": (OutputError(), wave, 2.0, ("a1", "b0")),
        # alpha = -1 cannot be excluded, and (1 + alpha) gamma vanishes there.
        "a vanishing product": (Hammerstein(1, (3, 1), stable=True), wave, 2.0, ("gamma1", "gamma2")),
    }


@pytest.mark.parametrize("name", unbounded_problems())
def test_what_the_data_do_not_bound_is_reported_unbounded(name: str) -> None:
    model, data, noise_bound, expected = unbounded_problems()[name]
    assert with_finite_box(FeasibleSet(model, data, noise_bound)).unbounded == expected
    estimate = identify(model, data, noise_bound)
    assert estimate.unbounded == expected
    assert estimate.enclosure is None
    assert estimate.centre_status is CentreStatus.UNDECIDED
    for interval, parameter in zip(estimate.intervals, model.parameters, strict=True):
        # The prior box, and nothing that looks like a result of the data.
        assert (interval.lower, interval.upper) == (parameter.lower, parameter.upper)
        assert (interval.proof_lower, interval.proof_upper) == (Proof.BOX, Proof.BOX)
        assert np.isnan(interval.inner_lower)
        assert np.isnan(interval.inner_upper)
    assert f"No box could be proven for {', '.join(expected)}: give it bounds, or richer data." in str(estimate)
    plain = {p["name"]: p for p in estimate.to_dict()["parameters"]}
    for parameter in expected:
        assert plain[parameter]["lower"] is None
        assert plain[parameter]["upper"] is None
    assert not dict(estimate.model.values)  # no central model is made up


def test_bounds_cure_an_unbounded_parameter() -> None:
    model, data, noise_bound, _ = unbounded_problems()["the input comes too late"]
    estimate = identify(model.bound(b0=(-2, 3)), data, noise_bound)
    assert estimate.unbounded == ()
    assert (estimate["b0"].lower, estimate["b0"].upper) == (-2, 3)
    assert (estimate["b0"].proof_lower, estimate["b0"].proof_upper) == (Proof.BOX, Proof.BOX)
    assert estimate["a1"].proof_lower is Proof.PROVEN
    assert estimate["a1"].lower <= -0.9 <= estimate["a1"].upper


def test_knowledge_that_is_curved_in_the_loose_parameters_is_no_obstacle():
    # b0^2 >= b1^2 (minimum phase) is left out where a box is derived for b0 and b1.
    case = random_problem(3, "errors in variables", 30)
    model = ErrorsInVariables(1, 1, stable=True, minimum_phase=True, dc_gain=(-100, 100))
    boxed = with_finite_box(FeasibleSet(model, case.data, case.noise_bound))
    assert boxed.unbounded == ()
    assert boxed.derived == ("b0", "b1")
    place = boxed.feasible.problem.names.index("b0")
    assert boxed.feasible.problem.lower[place] <= case.truth["b0"] <= boxed.feasible.problem.upper[place]


def hidden_state() -> tuple[Model, dict[str, np.ndarray], np.ndarray]:
    """Return a model whose state x is seen by its square alone, its input and its output."""
    a, b = Parameter("a", -0.9, 0.9), Parameter("b", 0.1, 2.0)
    u, x, z = signal("u"), signal("x"), signal("z")
    lines = (Line(x[t], a.symbol * x[t - 1] + u[t - 1]), Line(z[t], b.symbol * x[t] ** 2))
    rng = np.random.default_rng(0)
    inputs, state = rng.uniform(-1, 1, 12), np.zeros(12)
    for k in range(1, 12):
        state[k] = 0.5 * state[k - 1] + inputs[k - 1]
    model = Model("hidden", (a, b), lines, (Measurement("y", "z", "eta"),))
    return model, {"u": inputs}, 0.8 * state**2 + rng.uniform(-0.02, 0.02, 12)


def test_a_hidden_state_without_a_box_is_named_and_the_cure_that_is_told_works(tmp_path) -> None:
    model, inputs, y = hidden_state()
    data, file = Dataset.from_arrays(input=inputs, output={"y": y}, sampling_time=1.0), tmp_path / "proof.json"
    estimate = identify(model, data, 0.02)
    assert estimate.unbounded == ("x",)
    assert "No box could be proven for x: no channel measures x" in estimate.summary
    assert "model.bound(x=(lower, upper))" in estimate.summary

    known = model.bound(x=(-5, 5))
    cured = identify(known, data, 0.02, rounds=1, certificate=file)
    assert cured.unbounded == ()
    assert cured["a"].lower <= 0.5 <= cured["a"].upper
    assert cured["b"].lower <= 0.8 <= cured["b"].upper
    # The proof holds for these bounds alone.
    assert verify(file, data, known, 0.02).intervals["a"] == (cured["a"].lower, cured["a"].upper)
    for other in (model, model.bound(x=(-4, 5))):
        with pytest.raises(ModelError, match="the bounds of 'x' of the model is not that of the proof"):
            verify(file, data, other, 0.02)


def test_bounds_of_a_state_that_could_be_eliminated_narrow_the_set() -> None:
    a, h, x, u = Parameter("a", 0.1, 0.9), signal("h"), signal("x"), signal("u")
    lines = (Line(h[t], a.symbol * h[t - 1] + u[t - 1]), Line(x[t], h[t - 1]))
    model = Model("hidden", (a,), lines, (Measurement("y", "x", "eta"),))
    rng = np.random.default_rng(1)
    inputs, state = rng.uniform(0, 1, 15), np.zeros(15)
    for k in range(1, 15):
        state[k] = 0.5 * state[k - 1] + inputs[k - 1]
    seen = np.r_[0.0, state[:-1]] + rng.uniform(-0.3, 0.3, 15)
    data = Dataset.from_arrays(input={"u": inputs}, output={"y": seen}, sampling_time=1.0)
    free, bounded = (
        identify(own, data, 0.3, order=1)["a"] for own in (model, model.bound(h=(0.0, float(state.max()))))
    )
    assert free.lower <= bounded.lower + 1e-6
    assert bounded.upper <= free.upper + 1e-6
    assert bounded.width < 0.95 * free.width
    assert bounded.lower <= 0.5 <= bounded.upper


def test_bounds_of_signals_are_kept_and_bad_ones_are_refused(tmp_path) -> None:
    model, _, _ = hidden_state()
    known = model.bound(x=(-5, 5))
    assert "x[t] in [-5, 5]" in str(known)
    assert Model.from_dict(known.to_dict()) == known
    assert load_model(save_model(known, tmp_path / "model.toml")) == known
    assert rename_channels(known, {"u": "x"}).bounds == {"x2": (-5.0, 5.0)}
    for box, why in (
        ({"z": (0, 1)}, "'z' is not a hidden state"),
        ({"q": (0, 1)}, "no parameter 'q'"),
        ({"x": (1, 0)}, "the bounds of 'x' are"),
        ({"x": (0, np.inf)}, "give finite ones"),
    ):
        with pytest.raises(ModelError, match=why):
            model.bound(**box)


def test_stability_of_four_poles_does_not_delay_a_box() -> None:
    """The conditions of stability are of degree 3; they are left out where the least order does without."""
    poles, numerator = np.poly([0.6 + 0.5j, 0.6 - 0.5j, -0.3, 0.4]).real, [1.0, 0.4, -0.3, 0.2]
    rng = np.random.default_rng(0)
    u, w = rng.uniform(-1, 1, 60), np.zeros(60)
    for k in range(60):
        w[k] = -sum(poles[i] * w[k - i] for i in range(1, 5) if k >= i)
        w[k] += sum(numerator[j] * u[k - 1 - j] for j in range(4) if k >= 1 + j)
    feasible = FeasibleSet(OutputError(4, 3, stable=True), record(u, w + rng.uniform(-0.02, 0.02, 60)), 0.02)
    boxed = with_finite_box(feasible)
    assert boxed.derived == ("b0", "b1", "b2", "b3")
    ends = dict(
        zip(feasible.problem.names, np.c_[boxed.feasible.problem.lower, boxed.feasible.problem.upper], strict=True)
    )
    assert all(-20 < ends[f"b{k}"][0] <= true <= ends[f"b{k}"][1] < 20 for k, true in enumerate(numerator))


def test_products_beside_a_kink_that_only_the_sub_box_decides_are_boxed_or_left() -> None:
    u = np.random.default_rng(3).uniform(-1, 1, 40)
    u_new, w = np.where(u > 0.2, u + 2 * (u - 0.2), u), np.zeros(40)
    for k in range(1, 40):
        w[k] = 0.8 * w[k - 1] + 0.5 * u_new[k - 1]
    bend, start = Parameter("bend", -5, 5), Parameter("start", -0.9, 0.9)

    def bent(v: sympy.Indexed) -> sympy.Expr:
        return v + bend.symbol * (sympy.Max(0, v - start.symbol) - sympy.Max(0, -start.symbol))

    model = OutputError(stable=True).insert_before("u", bent, (bend, start))
    data = Dataset.from_arrays(input=u, output=w, sampling_time=1.0)
    feasible = FeasibleSet(model, data, 0.05)
    assert feasible.openings
    count = len(feasible.model.parameters)
    lower, upper = feasible.problem.lower[:count].copy(), feasible.problem.upper[:count].copy()
    # Beside every sample of the input no kink is open; on the whole box they are.
    place = feasible.problem.names.index("start")
    lower[place], upper[place] = 0.1999, 0.2001
    for stamped in (feasible, feasible.on_box(lower, upper)):
        boxed = with_finite_box(stamped)
        assert boxed.unbounded == ("b0",) or boxed.feasible.problem.lower[feasible.problem.names.index("b0")] <= 0.5
