"""Parameters verified on every sample: exact simulation in fractions is the oracle."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from smid import Dataset, ErrorsInVariables, Hammerstein, Model, OutputError, Parameter, Wiener
from smid.feasible.template import Templates
from smid.fitting.binding import bind
from smid.fitting.problem import Fitting
from smid.identification.windows.whole_record import WholeRecord, suits
from smid.models import Line, Measurement
from smid.models.symbols import signal, t

N = 60


def second_order(seed: int, radius: float, angle: float) -> tuple[Model, Dataset, dict[str, float]]:
    rng = np.random.default_rng(seed)
    values = {"a1": -2 * radius * np.cos(angle), "a2": radius**2, "b0": float(rng.normal()), "b1": float(rng.normal())}
    u, y = rng.normal(size=N), rng.normal(size=N)
    data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    return bind(OutputError(na=2, nb=1, stable=True), data), data, {k: float(v) for k, v in values.items()}


@given(st.integers(0, 1000), st.floats(0.1, 0.97), st.floats(0.0, 3.1))
@settings(max_examples=25, deadline=None)
def test_the_exact_noises_are_within_what_is_told(seed, radius, angle):
    model, data, values = second_order(seed, radius, angle)
    problem = Fitting(model, data, [np.ones(N, bool)])
    simulated = problem.simulate(problem.start(values))
    whole = WholeRecord(Templates.of(model), data)
    told = whole.least_bounds(values, whole.noises(simulated))["y"]
    # The exact run from the first samples of the simulated one, whose noises are exact floats.
    a1, a2, b0, b1 = (Fraction(values[name]) for name in ("a1", "a2", "b0", "b1"))
    u, y = ([Fraction(x) for x in data.values(name)] for name in "uy")
    w = [yk - Fraction(float(yk) - float(s)) for yk, s in zip(y, simulated[0]["y"], strict=True)]
    lag = Templates.of(model).lines[0].max_lag
    for k in range(lag, N):
        w[k] = -a1 * w[k - 1] - a2 * w[k - 2] + b0 * u[k - 1] + b1 * u[k - 2]
    exact = max(abs(yk - wk) for yk, wk in zip(y, w, strict=True))
    assert exact <= Fraction(told)
    assert told <= float(exact) * (1 + 1e-9)


def test_a_point_outside_a_prior_is_not_verified():
    model, data, values = second_order(0, 0.9, 1.0)
    problem = Fitting(model, data, [np.ones(N, bool)])
    simulated = problem.simulate(problem.start(values))
    unstable = values | {"a2": 1.0 + 1e-9}
    whole = WholeRecord(Templates.of(model), data)
    assert whole.least_bounds(unstable, whole.noises(simulated))["y"] == np.inf


def test_a_run_that_is_not_the_models_is_not_verified_to_be_near():
    model, data, values = second_order(1, 0.8, 0.7)
    problem = Fitting(model, data, [np.ones(N, bool)])
    simulated = problem.simulate(problem.start(values))
    whole = WholeRecord(Templates.of(model), data)
    noises = whole.noises(simulated)
    moved = [{"y": noises[0]["y"] + 1e-3 * np.random.default_rng(0).normal(size=N)}]
    assert whole.least_bounds(values, moved)["y"] > whole.least_bounds(values, noises)["y"] + 1e-3


@given(st.integers(0, 1000), st.floats(-0.9, 0.9))
@settings(max_examples=25, deadline=None)
def test_with_noises_of_the_input_the_exact_noises_are_within_what_is_told(seed, pole):
    rng = np.random.default_rng(seed)
    values = {"a1": pole, "b0": float(rng.normal()), "b1": float(rng.normal())}
    u, y, zeta, eta = rng.normal(size=(4, N))
    data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    model = bind(ErrorsInVariables(1, 1, stable=True), data)
    # The output's noises in floats, and in fractions from the same first one.
    exact = [Fraction(float(eta[0]))]
    a1, b0, b1 = (Fraction(values[name]) for name in ("a1", "b0", "b1"))
    v, noise = u - zeta, [float(eta[0])]
    exactly = [Fraction(float(p)) - Fraction(float(q)) for p, q in zip(u, zeta, strict=True)]
    for k in range(1, N):
        noise.append(y[k] + pole * (y[k - 1] - noise[-1]) - values["b0"] * v[k] - values["b1"] * v[k - 1])
        past = Fraction(float(y[k - 1])) - exact[-1]
        exact.append(Fraction(float(y[k])) + a1 * past - b0 * exactly[k] - b1 * exactly[k - 1])
    told = WholeRecord(Templates.of(model), data).least_bounds(values, [{"y": np.array(noise), "u": zeta}])
    assert told["u"] == np.abs(zeta).max()
    largest = max(map(abs, exact))
    assert largest <= Fraction(told["y"])
    assert told["y"] <= float(largest) * (1 + 1e-9)


def scheduled() -> Model:
    """A pole that follows a channel."""
    w, u, p = (signal(name)[t - 1] for name in "wup")
    a, b = Parameter("a", -1, 1), Parameter("b", -5, 5)
    return Model(
        "scheduled", (a, b), (Line(signal("w")[t], a.symbol * p * w + b.symbol * u),), (Measurement("y", "w", "eta"),)
    )


@given(st.integers(0, 1000), st.floats(-0.9, 0.9))
@settings(max_examples=25, deadline=None)
def test_of_a_pole_that_follows_a_channel_the_exact_noises_are_within_what_is_told(seed, pole):
    rng, model = np.random.default_rng(seed), scheduled()
    values = {"a": pole, "b": float(rng.normal())}
    u, y, p = *rng.normal(size=(2, N)), rng.uniform(-1, 1, N)
    data = Dataset.from_arrays(input={"u": u, "p": p}, output={"y": y}, sampling_time=1.0)
    noise = [float(rng.normal())]
    exact, a, b = [Fraction(noise[0])], Fraction(pole), Fraction(values["b"])
    for k in range(1, N):
        noise.append(y[k] - pole * p[k - 1] * (y[k - 1] - noise[-1]) - values["b"] * u[k - 1])
        past = Fraction(float(y[k - 1])) - exact[-1]
        exact.append(Fraction(float(y[k])) - a * Fraction(float(p[k - 1])) * past - b * Fraction(float(u[k - 1])))
    told = WholeRecord(Templates.of(bind(model, data)), data).least_bounds(values, [{"y": np.array(noise)}])["y"]
    largest = max(map(abs, exact))
    assert largest <= Fraction(told)
    assert told <= float(largest) * (1 + 1e-9)


@pytest.mark.parametrize(
    ("model", "expected"),
    [
        (OutputError(na=2, nb=1, stable=True), True),
        (Hammerstein(poles=1, powers=(3, 1), stable=True), True),
        (ErrorsInVariables(), True),
        (Wiener(), False),
        (scheduled(), True),
    ],
)
def test_which_models_have_runs_that_can_be_verified(model, expected):
    assert suits(Templates.of(model.discretised())) is expected
