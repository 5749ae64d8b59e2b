"""Models in derivatives: against SciPy's integrator to the order of the scheme, by hand, and through every edit."""

import json
import pickle
from dataclasses import replace

import numpy as np
import pytest
import sympy
from scipy.integrate import solve_ivp

from smid import Dataset, FeasibleSet
from smid.fitting.binding import bind
from smid.models import (
    Line,
    Measurement,
    Model,
    ModelError,
    OutputError,
    Parameter,
    Reactor,
    RotatingArm,
    predict,
    signal,
    simulate,
    t,
)
from tests.smid.models.rates_by_scipy import integrate

U, X, Z, V = signal("u"), signal("x"), signal("z"), signal("v")
ORDERS = {"euler": 1, "trapezoidal": 2, "rk4": 4, "rosenbrock": 4}
INPUT = np.repeat(np.random.default_rng(1).uniform(0.2, 0.9, 10), 4)


def model(*lines, parameters=(), **more):
    return Model("test", parameters, lines, (Measurement("y", "x", "eta"),), **{"sampling_time": 0.1, **more})


def bent_pair(**more):
    """Two states, a plain line of one of them and of the input, and one of the input alone."""
    return model(
        Line(X[t], V[t] - X[t] ** 3, rate=True),
        Line(Z[t], X[t] - Z[t], rate=True),
        Line(V[t], sympy.sin(Z[t]) + signal("w")[t]),
        Line(signal("w")[t], U[t] ** 2),
        **more,
    )


def bent_rate(s, u):
    return [np.sin(s[1]) + u**2 - s[0] ** 3, s[0] - s[1]]


@pytest.mark.parametrize("scheme", ORDERS)
def test_each_scheme_has_its_order(scheme):
    exact = integrate(bent_rate, [0.5, -0.3], INPUT, 0.4)
    errors = []
    for substeps in (6, 12):
        got = bent_pair(scheme=scheme, substeps=substeps, sampling_time=0.4)
        run = simulate(got, {"u": INPUT}, initial={"x": [0.5], "z": [-0.3]})
        assert set(run) == {"u", "x", "z", "v", "w", "y"}
        errors.append(max(np.abs(run["x"] - exact[0]).max(), np.abs(run["z"] - exact[1]).max()))
    assert errors[1] < {"euler": 0.1, "trapezoidal": 2e-3, "rk4": 2e-6, "rosenbrock": 2e-6}[scheme]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(ORDERS[scheme], abs=0.35)


@pytest.mark.parametrize("scheme", ORDERS)
@pytest.mark.parametrize("substeps", [1, 3])
def test_linear_rates_become_one_line_that_equals_the_steps(scheme, substeps):
    k = Parameter("k", 0, 10)
    line = Line(X[t], k.symbol * (U[t] ** 2 - X[t]), rate=True)
    folded = model(line, parameters=(k,), scheme=scheme, substeps=substeps)
    # A term that vanishes over these data hides that the rate is linear.
    stepped = folded.add_term("x", X[t] ** 2 * sympy.Max(0, U[t] - 5))
    assert len(folded.discretised().lines) == 1
    assert (len(stepped.discretised().lines) > 1) == (scheme != "euler" or substeps > 1)
    one, other = (
        simulate(item, {"u": INPUT}, {"k": np.array([0.7, 3.0])}, {"x": [0.4]})["y"] for item in (folded, stepped)
    )
    np.testing.assert_allclose(one, other, rtol=1e-12)


def test_structure_and_order_of_rates():
    pair = bent_pair(sampling_time=None)
    assert pair.states == ("x", "z")
    assert pair.max_lag == 1
    assert pair.inputs == ("u",)
    assert pair.continuous
    assert OutputError().discretised() is not None
    assert not OutputError().continuous


def test_a_sampling_time_is_needed_and_comes_from_the_data():
    pair = bent_pair(sampling_time=None)
    with pytest.raises(ModelError, match=r"no sampling time: build it with Model\(\.\.\., sampling_time="):
        simulate(pair, {"u": INPUT})
    exact = simulate(bent_pair(sampling_time=0.2), {"u": INPUT}, initial={"x": [0.5], "z": [0.0]})["y"]
    data = Dataset.from_arrays(input={"u": INPUT}, output={"y": exact}, sampling_time=0.2)
    np.testing.assert_allclose(pair.simulate(data).outputs[0]["y"], exact)
    np.testing.assert_allclose(pair.predict(data).outputs[0]["y"][:2], exact[:2])
    assert bind(pair, data).sampling_time == 0.2
    assert bind(OutputError(), data) == OutputError()
    with pytest.raises(ModelError, match=r"every 0.1 s, the data have one every 0.2 s"):
        bind(bent_pair(), data)
    with pytest.raises(ModelError, match=r"every 0.1 s, the data"):
        bent_pair().simulate(data)


def test_a_further_channel_that_a_model_names_is_its_input():
    data = Dataset.from_arrays(input={"u1": np.ones(3)}, output={"y": np.ones(3)}, sampling_time=0.2, u2=np.ones(3))
    assert bind(OutputError(input="u2", output="level"), data).input_channels == ("u2",)
    assert bind(OutputError(), data).input_channels == ("u1",)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"scheme": "rk5"}, "unknown scheme 'rk5', did you mean 'rk4'"),
        ({"substeps": 0}, "substeps = 0 is not a number of steps"),
        ({"sampling_time": -1.0}, "give a positive number of seconds"),
    ],
)
def test_options_that_make_no_sense(options, message):
    with pytest.raises(ModelError, match=message):
        bent_pair(**options)


def test_helper_names_collide_with_nothing():
    named = bent_pair().add_term("x", signal("stage1")[t] + Parameter("stage2").symbol, [Parameter("stage2", 0, 0)])
    lines = [line.signal for line in named.discretised().lines]
    assert "stage1" not in lines
    assert "stage2" not in lines
    assert "stage3" in lines


def test_prediction_starts_each_step_from_the_measurement():
    u, y = INPUT, np.random.default_rng(2).uniform(0.2, 0.8, len(INPUT))
    cubic = Reactor(2.0, x=3.0, sampling_time=0.5)
    got = predict(cubic, {"u": u, "y": y})["y"]
    for k in (1, 7, 20):
        one = simulate(cubic, {"u": u[k - 1 : k + 1]}, initial={"w": [y[k - 1]]})["y"][1]
        assert got[k] == pytest.approx(one, rel=1e-12)


def by_hand(step, start=0.5):
    x = [start]
    for k in range(1, len(INPUT)):
        x.append(x[-1] + 0.1 * step(x[-1], INPUT[k - 1]))
    return np.array(x)


EDITED = model(Line(X[t], U[t] - X[t], rate=True), scheme="euler")


@pytest.mark.parametrize(
    ("edit", "expected"),
    [
        (lambda m: m.add_term("x", -(X[t] ** 2)), by_hand(lambda x, u: u - x - x**2)),
        (lambda m: m.replace_line("y", 2 * U[t]), by_hand(lambda _, u: 2 * u)),
        (lambda m: m.insert_before("u", lambda u: u**2), by_hand(lambda x, u: u**2 - x)),
        (lambda m: m.insert_before("x", lambda x: x**2), by_hand(lambda x, u: u - x**2)),
        (lambda m: m.insert_sensor("y", lambda x: x**2), by_hand(lambda x, u: u - x) ** 2),
        (
            lambda m: m.insert_after("x", lambda x: sympy.Min(x, 0.6)).replace_line("x_raw", 2 * U[t] - X[t]),
            np.minimum(by_hand(lambda x, u: 2 * u - min(x, 0.6)), 0.6),
        ),
        (
            lambda m: m.with_line("z", U[t] - Z[t], rate=True).replace_line("x", Z[t]),
            None,
        ),
    ],
    ids=["term", "replace", "before input", "before state", "sensor", "after", "new state"],
)
def test_edits_keep_the_rate(edit, expected):
    edited = edit(EDITED)
    state = "x_raw" if "x_raw" in edited.states else "x"
    first = {"x": [expected[0]], "x_raw": [0.5]} if state == "x_raw" else {"x": [0.5]}
    if edited.measurements[0].signal != "x":
        first[edited.measurements[0].signal] = [0.25]
    run = simulate(edited, {"u": INPUT}, initial=first)
    if expected is None:
        z = by_hand(lambda x, u: u - x, start=0.0)
        expected = 0.5 + 0.1 * np.concatenate([[0.0], np.cumsum(z)[:-1]])
    np.testing.assert_allclose(run["y"], expected, rtol=1e-12)
    assert any(line.rate for line in edited.lines)


def test_a_stage_sees_its_own_value_of_a_plain_line():
    """A saturation written as a plain line equals the same one written into the rate, at every stage."""
    limit = sympy.Min(X[t], sympy.Rational(1, 2))
    for scheme in ORDERS:
        inside = model(Line(X[t], U[t] - limit**2, rate=True), scheme=scheme, sampling_time=0.7)
        beside = model(
            Line(X[t], U[t] - signal("s")[t] ** 2, rate=True),
            Line(signal("s")[t], limit),
            scheme=scheme,
            sampling_time=0.7,
        )
        runs = [simulate(item, {"u": INPUT}, initial={"x": [0.3]})["y"] for item in (inside, beside)]
        np.testing.assert_allclose(runs[0], runs[1], rtol=1e-13)
        assert beside.states == ("x",)


def test_a_plain_line_with_memory_is_held():
    """A play operator on the state, and a delayed input."""
    play = signal("p")
    line = Line(play[t], sympy.Max(X[t] - 0.1, sympy.Min(X[t] + 0.1, play[t - 1])))
    got = model(Line(X[t], U[t - 2] - play[t], rate=True), line, scheme="rk4")
    run = simulate(got, {"u": INPUT})
    x, p = np.zeros(len(INPUT)), np.zeros(len(INPUT))
    lag = got.max_lag
    assert lag == 3
    for k in range(lag, len(INPUT)):
        x[k] = x[k - 1] + 0.1 * (INPUT[k - 3] - p[k - 1])
        p[k] = max(x[k] - 0.1, min(x[k] + 0.1, p[k - 1]))
    np.testing.assert_allclose(run["y"], x, atol=1e-14)


def test_fixed_parameters_need_no_value_and_refuse_another():
    held = OutputError().bound(a1=(-0.5, -0.5))
    got = simulate(held, {"u": INPUT}, {"b0": 1.0})["y"]
    np.testing.assert_array_equal(got, simulate(OutputError().fix(a1=-0.5), {"u": INPUT}, {"b0": 1.0})["y"])
    with pytest.raises(ModelError, match=r"a1 is fixed at -0\.5, not -0\.4: widen its box"):
        simulate(held, {"u": INPUT}, {"b0": 1.0, "a1": -0.4})
    cubic = Reactor(2.0, x=3.0, sampling_time=0.5)
    np.testing.assert_allclose(
        simulate(cubic, {"u": INPUT})["y"], simulate(cubic.fix(tau=2.0, a=1.0, x=3.0), {"u": INPUT})["y"]
    )
    freed = cubic.bound(tau=(1.0, 3.0))
    assert (simulate(freed, {"u": INPUT}, {"tau": 1.5})["y"] != simulate(cubic, {"u": INPUT})["y"]).any()


@pytest.mark.parametrize("item", [bent_pair(substeps=2), Reactor(), RotatingArm(friction=True, drag=True)])
def test_rates_are_stored_printed_and_hashed(item):
    for again in (Model.from_dict(json.loads(json.dumps(item.to_dict()))), pickle.loads(pickle.dumps(item))):
        assert again == item
        assert hash(again) == hash(item)
        assert str(again) == str(item)
    assert "d/dt" in str(item)
    assert r"\frac{d}{dt}" in item.equations().latex()
    assert replace(item, sampling_time=0.3) != item
    assert hash(replace(item, sampling_time=0.3)) != hash(item)
    assert "rates" not in OutputError().to_dict()


def test_the_truth_lies_in_the_feasible_set_of_an_euler_model():
    rng = np.random.default_rng(4)
    u = rng.uniform(0.2, 1.0, 25)
    k = Parameter("k", 0.05, 2, "1/s")
    cubic = Reactor(x=3.0, a=None, scheme="euler").substitute("tau", 1 / k.symbol, [k])
    truth = {"a": 1.3, "k": 0.5}
    clean = simulate(replace(cubic, sampling_time=0.5), {"u": u}, truth, {"w": [0.4]})["y"]
    noise = rng.uniform(-0.02, 0.02, len(u))
    data = Dataset.from_arrays(input={"u": u}, output={"y": clean + noise}, sampling_time=0.5)
    feasible = FeasibleSet(cubic, data, 0.02)
    assert feasible.n_equalities == len(u) - 1
    assert feasible.model.continuous
    values = {**truth, "x": 3.0} | {f"eta[{i}]": value for i, value in enumerate(noise)}
    point = np.array([values[name] for name in feasible.problem.names])
    residual = feasible.problem.equalities.evaluate(point)
    np.testing.assert_allclose(residual, 0, atol=1e-14)
    wrong = np.where(np.array(feasible.problem.names) == "k", 0.6, point)
    assert np.abs(feasible.problem.equalities.evaluate(wrong)).max() > 1e-3
    assert ((point >= feasible.problem.lower) & (point <= feasible.problem.upper)).all()
    assert feasible.problem.inequalities.n_rows == 2
    assert (feasible.problem.inequalities.evaluate(point) >= 0).all()


def test_the_linearly_implicit_scheme_holds_where_the_step_is_far_above_a_time_constant():
    """Robertson's reaction near its slow motion; its fastest time constant is about 0.4 ms, the step 50 ms."""

    def robertson(s):
        fast, slow = 3e7 * s[1] ** 2, 1e4 * s[1] * s[2]
        return [-0.04 * s[0] + slow, 0.04 * s[0] - slow - fast, fast]

    rates = robertson((X[t], Z[t], V[t]))
    lines = [Line(s[t], rate, rate=True) for s, rate in zip((X, Z, V), rates, strict=True)]
    stiff = model(*lines, scheme="rosenbrock", sampling_time=0.05)
    first = {"x": [1.0], "z": [3.65e-5], "v": [0.0]}
    got = simulate(stiff, {}, initial=first, n=200)
    times, start = 0.05 * np.arange(200), [1.0, 3.65e-5, 0.0]
    exact = solve_ivp(
        lambda _, s: robertson(s), (0, 10), start, "Radau", times, rtol=1e-9, atol=[1e-10, 1e-14, 1e-10]
    ).y
    for name, wanted in zip("xzv", exact, strict=True):
        np.testing.assert_allclose(got[name][1:], wanted[1:], rtol=1e-3)
    with pytest.raises(ModelError, match="finite range"):
        simulate(replace(stiff, scheme="rk4"), {}, initial=first, n=200)


def test_the_linearly_implicit_scheme_takes_kinks_and_jumps():
    def kinked(s, u):
        return [-50.0 * max(s[0], 0.3) + 20.0 * u, np.sign(s[0] - 0.35) - s[1] * abs(s[1])]

    u = np.repeat(INPUT, 20)
    rates = (-50 * sympy.Max(X[t], 0.3) + 20 * U[t], sympy.sign(X[t] - 0.35) - Z[t] * sympy.Abs(Z[t]))
    lines = [Line(s[t], rate, rate=True) for s, rate in zip((X, Z), rates, strict=True)]
    got = simulate(model(*lines, scheme="rosenbrock", sampling_time=0.0025), {"u": u}, initial={"x": [0.5], "z": [0.2]})
    exact = integrate(kinked, [0.5, 0.2], u, 0.0025)
    np.testing.assert_allclose(got["x"], exact[0], atol=1e-3)
    np.testing.assert_allclose(got["z"], exact[1], atol=5e-3)
