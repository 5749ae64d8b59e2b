"""The stamped constraints against residuals written out by hand, and what a feasible set tells of itself."""

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
import pytest
import sympy

from smid import Dataset, ErrorsInVariables, FeasibleSet, Hammerstein, Model, ModelError, OutputError, Wiener, identify

N = 14
Noises = dict[str, np.ndarray]
Residual = Callable[[dict[str, float], Noises, np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Case:
    """A model, a member of it, and its equations as one would write them down without the package.

    ``residual(parameters, noises, u, y)`` is what has to vanish; ``respond(parameters, u, start)`` simulates.
    """

    model: Model
    truth: dict[str, float]
    residual: Residual
    respond: Callable[[dict[str, float], np.ndarray], np.ndarray]
    noisy: tuple[str, ...] = ("eta",)
    latent: Residual | None = None  # gives the signal "x" where it stays latent


def _output_error(p, noise, u, y):
    w = y - noise["eta"]
    return w[3:] + p["a1"] * w[2:-1] + p["a2"] * w[1:-2] - p["b0"] * u[1:-2] - p["b1"] * u[:-3]


def _errors_in_variables(p, noise, u, y):
    w, v = y - noise["eta"], u - noise["zeta"]
    return w[1:] + p["a1"] * w[:-1] - p["b0"] * v[1:]


def _hammerstein(p, noise, u, y):
    w, v = y - noise["eta"], 0.5 * u
    x = p["gamma1"] * v**3 + p["gamma2"] * v
    return w[1:] + p["alpha"] * w[:-1] - (1 + p["alpha"]) * x[:-1]


def _bent_input(p, noise, u, y):
    """A bent noisy input is a latent signal: the equality that gives it comes first."""
    w, x = y - noise["eta"], noise["x"]
    return np.concatenate([x - _curve(p, noise, u, y), w[1:] + p["alpha"] * w[:-1] - (1 + p["alpha"]) * x[:-1]])


def _curve(p, noise, u, _y):
    v = 0.5 * (u - noise["zeta"])
    return p["gamma1"] * v**3 + p["gamma2"] * v


def _wiener(p, noise, u, y):
    """So is the signal behind a curved sensor: its dynamics come first, then the sensor."""
    x = noise["x"]
    return np.concatenate([x[1:] + p["alpha"] * x[:-1] - p["beta"] * u[:-1], x - _behind(p, noise, u, y)])


def _behind(p, noise, _u, y):
    z = y - noise["eta"]
    return z + p["s2"] * z**2 + p["s3"] * z**3


def _with_offset(p, noise, u, y):
    w = y - noise["eta"]
    return w[1:] + p["a1"] * w[:-1] - p["b0"] * u[:-1] - p["offset"]


def _recursion(count, start, step):
    w = np.zeros(count)
    w[: len(start)] = start
    for t in range(len(start), count):
        w[t] = step(w, t)
    return w


def _wiener_output(p, u):
    x = _recursion(len(u), [0.1], lambda w, t: -p["alpha"] * w[t - 1] + p["beta"] * u[t - 1])
    roots = [np.roots([p["s3"], p["s2"], 1.0, -value]) for value in x]
    return np.array([min(r[np.abs(r.imag) < 1e-9].real, key=abs) for r in roots])


CASES = {
    "output error, two poles, delay 2": Case(
        OutputError(2, 1, 2, stable=True),
        {"a1": -1.1, "a2": 0.4, "b0": 1.5, "b1": -0.3},
        _output_error,
        lambda p, u: _recursion(
            len(u),
            [0.1, -0.2, 0.3],
            lambda w, t: -p["a1"] * w[t - 1] - p["a2"] * w[t - 2] + p["b0"] * u[t - 2] + p["b1"] * u[t - 3],
        ),
    ),
    "output error with offset": Case(
        OutputError(offset=True),
        {"a1": -0.7, "b0": 0.8, "offset": 2.5},
        _with_offset,
        lambda p, u: _recursion(len(u), [7.0], lambda w, t: -p["a1"] * w[t - 1] + p["b0"] * u[t - 1] + p["offset"]),
    ),
    "errors in variables": Case(
        ErrorsInVariables(1, 0),
        {"a1": -0.6, "b0": 0.9},
        _errors_in_variables,
        lambda p, u: _recursion(len(u), [0.4], lambda w, t: -p["a1"] * w[t - 1] + p["b0"] * u[t]),
        ("eta", "zeta"),
    ),
    "hammerstein": Case(
        Hammerstein(1, (3, 1), input_scale=0.5, stable=True),
        {"alpha": -0.65, "gamma1": 0.7, "gamma2": -1.2},
        _hammerstein,
        lambda p, u: _recursion(
            len(u),
            [0.2],
            lambda w, t: (
                -p["alpha"] * w[t - 1]
                + (1 + p["alpha"]) * (p["gamma1"] * (0.5 * u[t - 1]) ** 3 + p["gamma2"] * 0.5 * u[t - 1])
            ),
        ),
    ),
    "wiener": Case(
        Wiener(1, (2, 3)),
        {"alpha": -0.5, "beta": 0.8, "s2": 0.1, "s3": 0.2},
        _wiener,
        _wiener_output,
        latent=_behind,
    ),
}
CASES["hammerstein with input noise"] = Case(
    Hammerstein(1, (3, 1), input_scale=0.5, stable=True, input_noise=True),
    CASES["hammerstein"].truth,
    _bent_input,
    CASES["hammerstein"].respond,
    ("eta", "zeta"),
    _curve,
)


def record(case: Case, seed: int, n: int = N) -> tuple[Dataset, Noises]:
    """Return measured data of the case's member and the noises in them."""
    rng = np.random.default_rng(seed)
    u = rng.uniform(-1, 1, n)
    noises = {name: rng.uniform(-0.1, 0.1, n) for name in case.noisy}
    y = case.respond(case.truth, u) + noises["eta"]
    measured = u + noises.get("zeta", 0.0)
    if case.latent is not None:
        noises["x"] = case.latent(case.truth, noises, measured, y)
    return Dataset.from_arrays(input={"u": measured}, output={"y": y}, sampling_time=1.0, name=f"run{seed}"), noises


def point_of(feasible: FeasibleSet, parameters: dict[str, float], noises: dict[str, np.ndarray]) -> np.ndarray:
    """Put parameters and noises, named as in the problem, into the order of its variables."""
    table = dict(parameters)
    several = len(feasible.data.experiments) > 1
    for key, values in noises.items():
        latent, _, run = key.partition(",")
        for k, value in enumerate(values):
            table[f"{latent}[{k},{run}]" if several else f"{latent}[{k}]"] = float(value)
    return np.array([table[name] for name in feasible.problem.names])


@pytest.mark.parametrize("name", CASES)
def test_constraints_are_the_residuals_written_by_hand(name: str) -> None:
    case = CASES[name]
    data, noises = record(case, 1)
    feasible = FeasibleSet(case.model, data, 0.1)
    u, y = data.values("u"), data.values("y")
    truth = point_of(feasible, case.truth, noises)
    assert np.abs(feasible.problem.equalities.evaluate(truth)).max() < 1e-13
    assert (truth >= feasible.problem.lower).all()
    assert (truth <= feasible.problem.upper).all()
    assert (feasible.problem.inequalities.evaluate(truth) >= 0).all()
    rng = np.random.default_rng(2)
    for _ in range(5):  # and they are the same polynomials everywhere, not only where both vanish
        parameters = {k: float(rng.normal()) for k in case.truth}
        others = {k: rng.normal(size=N) for k in noises}
        found = feasible.problem.equalities.evaluate(point_of(feasible, parameters, others))
        np.testing.assert_allclose(found, case.residual(parameters, others, u, y), rtol=0, atol=1e-12)


def test_two_experiments_share_the_parameters_only() -> None:
    case = CASES["hammerstein"]
    first, noise = record(case, 1)
    second, other = record(case, 2, n=9)
    feasible = FeasibleSet(case.model, Dataset.merge([first, second]), 0.1)
    noises = {"eta,run1": noise["eta"], "eta,run2": other["eta"]}
    point = point_of(feasible, case.truth, noises)
    assert np.abs(feasible.problem.equalities.evaluate(point)).max() < 1e-13
    assert feasible.n_variables == 3 + 14 + 9
    assert feasible.n_equalities == 13 + 8
    assert feasible.samples.tolist() == [[0, k] for k in range(1, 14)] + [[1, k] for k in range(1, 9)]
    shared = {name for name in feasible.problem.names if "run" not in name}
    assert shared == set(case.truth)
    for clique in feasible.cliques():
        assert not any("run1" in name for name in clique) or not any("run2" in name for name in clique)


def test_the_noises_are_in_their_own_channels_bounds() -> None:
    case = CASES["errors in variables"]
    feasible = FeasibleSet(case.model, record(case, 1)[0], {"y": 0.2, "u": 0.3})
    limits = dict(zip(feasible.problem.names, feasible.problem.upper, strict=True))
    assert {v for k, v in limits.items() if k.startswith("eta")} == {0.2}
    assert {v for k, v in limits.items() if k.startswith("zeta")} == {0.3}
    assert feasible.bounds == {"y": 0.2, "u": 0.3}
    assert "|noise of y| <= 0.2, |noise of u| <= 0.3" in str(feasible)


def test_counts_cliques_and_words() -> None:
    data, _ = record(CASES["output error, two poles, delay 2"], 1)
    feasible = FeasibleSet(OutputError(2, 1, 2, stable=True), data, 0.1)
    # Sample t needs the noises of t, t - 1 and t - 2; the input reaches three samples back.
    assert (feasible.n_variables, feasible.n_equalities, feasible.degree) == (4 + 13, 11, 2)
    assert feasible.n_inequalities == 2  # the triangle of two stable poles, beside its box
    assert feasible.complicating == ("a1", "a2")
    cliques = feasible.cliques()
    assert len(cliques) == 11
    assert all(set(c) >= {"a1", "a2", "b0", "b1"} for c in cliques)
    assert sorted({n for c in cliques for n in c}) == sorted(feasible.problem.names)
    words = str(feasible)
    assert "17 variables (4 parameters), 11 equalities, 2 inequalities, degree 2" in words
    assert "complicating: a1, a2" in words


@pytest.mark.parametrize("name", CASES)
def test_the_sympy_form_says_the_same(name: str) -> None:
    case = CASES[name]
    data, _ = record(case, 3, n=10)
    feasible = FeasibleSet(case.model, data, 0.1)
    written = feasible.to_sympy()
    symbols = [sympy.Symbol(n, real=True) for n in feasible.problem.names]
    rng = np.random.default_rng(4)
    for _ in range(3):
        point = rng.normal(size=len(symbols))
        for kind, polynomials in (
            ("equalities", feasible.problem.equalities),
            ("inequalities", feasible.problem.inequalities),
        ):
            # The box follows the inequalities.
            found = sympy.lambdify([symbols], written[kind][: polynomials.n_rows])(point)
            np.testing.assert_allclose(np.array(found, dtype=float), polynomials.evaluate(point), atol=1e-11)
    box = written["inequalities"][feasible.n_inequalities :]
    problem = feasible.problem
    assert len(box) == np.isfinite(problem.lower).sum() + np.isfinite(problem.upper).sum()


def test_too_many_equalities_to_write_out() -> None:
    data, _ = record(CASES["hammerstein"], 1)
    with pytest.raises(ModelError, match="13 equalities are too many to write out: crop the data below 5"):
        FeasibleSet(CASES["hammerstein"].model, data, 0.1).to_sympy(most=5)


def test_an_open_noise_bound_is_the_last_variable() -> None:
    case = CASES["errors in variables"]
    data, noises = record(case, 1)
    feasible = FeasibleSet(case.model, data, {"u": 0.1}, free_channel="y")
    assert feasible.problem.names[-1] == "noise_bound"
    point = point_of(feasible, {**case.truth, "noise_bound": float(np.abs(noises["eta"]).max())}, noises)
    assert feasible.problem.inequalities.evaluate(point).min() == pytest.approx(0.0, abs=1e-15)
    point[-1] *= 0.99
    assert feasible.problem.inequalities.evaluate(point).min() < 0


def test_a_ramp_and_a_step_excite_and_experiments_excite_together() -> None:
    n = 12
    y = np.linspace(0.0, 1.0, n)
    ramp, step = np.linspace(0.0, 900.0, n), np.r_[np.zeros(6), np.ones(6)]
    for u in (ramp, step):
        data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
        assert FeasibleSet(Hammerstein(1, (5, 4, 3), stable=True), data, 0.1).n_equalities == n - 1
    low, high = (
        Dataset.from_arrays(input={"u": np.full(n, level)}, output={"y": y}, sampling_time=1.0, name=name)
        for level, name in ((1.0, "low"), (2.0, "high"))
    )
    assert FeasibleSet(OutputError(), Dataset.merge([low, high]), 0.1).n_equalities == 2 * (n - 1)


def test_only_the_inputs_that_the_model_reads_must_excite() -> None:
    rng = np.random.default_rng(0)
    data = Dataset.from_arrays(
        input={"u": rng.normal(size=12), "idle": np.zeros(12)}, output={"y": rng.normal(size=12)}, sampling_time=1.0
    )
    assert FeasibleSet(OutputError(), data, 0.1).n_equalities == 11


def test_the_offset_is_a_parameter_of_its_own() -> None:
    model = OutputError(2, 1, offset=True, stable=True, dc_gain=2.0)
    assert [p.name for p in model.parameters] == ["a1", "a2", "b0", "offset"]
    noisy = ErrorsInVariables(1, 0, offset=True, bounds={"offset": (-1, 1)})
    assert (noisy.parameter("offset").lower, noisy.parameter("offset").upper) == (-1, 1)
    u = np.random.default_rng(0).normal(size=30)
    values = {"a1": -0.5, "b0": 1.0, "offset": 3.0}
    data = Dataset.from_arrays(input={"u": u}, output={"y": np.full(30, 6.0)}, sampling_time=1.0)
    shifted = OutputError(offset=True).simulate(data, values).outputs[0]["y"]
    centred = OutputError().simulate(data, {"a1": -0.5, "b0": 1.0}, "rest").outputs[0]["y"]
    np.testing.assert_allclose(shifted, centred + 6.0)  # 3 / (1 - 0.5), where it starts


def test_the_exact_equalities_add_up_to_the_exact_coefficients() -> None:
    data, _ = record(CASES["hammerstein"], 5, n=6)
    feasible = FeasibleSet(Hammerstein(1, (5, 3), input_scale=0.01, stable=True), data, 0.1)
    problem = feasible.problem
    assert problem.exact is not None
    exact = problem.exact()
    assert (exact.coefficients.rad == 0).all()
    sums: dict[tuple[int, ...], Fraction] = {}
    for row, factor, value in zip(exact.rows, exact.factors, exact.coefficients.mid, strict=True):
        key = (int(row), *(int(v) for v in factor if v >= 0))
        sums[key] = sums.get(key, Fraction(0)) + Fraction(float(value))
    u = [Fraction(x) for x in data.values("u").tolist()]
    place = {name: k for k, name in enumerate(problem.names)}
    for row in range(feasible.n_equalities):
        for name, power in (("gamma1", 5), ("gamma2", 3)):
            assert sums[row, place[name]] == -((Fraction(0.01) * u[row]) ** power)


def test_two_poles_and_a_scaled_input_are_witnessed() -> None:
    """The radii of rounded coefficients would pile up along the recursion of two poles."""
    rng = np.random.default_rng(1)
    u = rng.uniform(-10, 10, 60)
    v = 0.1 * u
    w = _recursion(
        60, [0.0, 0.0], lambda w, t: 1.2 * w[t - 1] - 0.5 * w[t - 2] + 0.3 * (0.5 * v[t - 1] ** 3 + v[t - 1])
    )
    data = Dataset.from_arrays(input={"u": u}, output={"y": w + rng.uniform(-0.05, 0.05, 60)}, sampling_time=1.0)
    found = identify(Hammerstein(2, (3, 1), input_scale=0.1, stable=True), data, 0.05, tolerance=1e-3)
    for interval in found.intervals:
        assert interval.gap <= 1e-3 * interval.width
