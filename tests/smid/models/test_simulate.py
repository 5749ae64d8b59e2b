"""Simulation against plain loops written by hand, and functions against NumPy's."""

import time
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import sympy
from scipy.signal import lfilter, lfiltic

from smid.models import (
    VALUE,
    ErrorsInVariables,
    Hammerstein,
    Line,
    Measurement,
    Model,
    ModelError,
    OutputError,
    Parameter,
    Wiener,
    predict,
    signal,
    simulate,
    t,
)

U = sympy.Symbol("U", real=True)
CLUTCH = {"alpha": -0.65, "gamma1": -0.0027, "gamma2": 0.03, "gamma3": -0.05}


def clutch_by_hand(u, first, scale=0.01):
    v = scale * u
    x = CLUTCH["gamma1"] * v**5 + CLUTCH["gamma2"] * v**4 + CLUTCH["gamma3"] * v**3
    w = [first]
    for k in range(1, len(u)):
        w.append(-CLUTCH["alpha"] * w[k - 1] + (1 + CLUTCH["alpha"]) * x[k - 1])
    return np.array(w)


@pytest.fixture
def rng():
    return np.random.default_rng(5)


def test_hammerstein_equals_loop_by_hand(rng):
    u = rng.uniform(0, 900, 200)
    model = Hammerstein(input_scale=0.01, stable=True)
    run = simulate(model, {"u": u}, CLUTCH, {"w": [3.5]})
    np.testing.assert_allclose(run["y"], clutch_by_hand(u, 3.5), rtol=1e-12)
    np.testing.assert_allclose(run["v"], 0.01 * u)


def test_output_error_of_higher_order_equals_loop_by_hand(rng):
    u = rng.normal(size=60)
    values = {"a1": -1.2, "a2": 0.5, "b0": 0.3, "b1": -0.2}
    w = np.zeros(60)
    w[:4] = [1.0, -1.0, 0.5, 2.0]
    for k in range(4, 60):
        w[k] = 1.2 * w[k - 1] - 0.5 * w[k - 2] + 0.3 * u[k - 3] - 0.2 * u[k - 4]
    model = OutputError(2, 1, delay=3)
    assert model.max_lag == 4
    run = simulate(model, {"u": u}, values, {"w": w})
    np.testing.assert_allclose(run["y"], w, rtol=1e-12, atol=1e-12)


def test_a_batch_is_its_runs_one_by_one_and_a_linear_filter(rng):
    model = OutputError(2, 1)
    u = rng.normal(size=300)
    batch = {"a1": rng.uniform(-1, 0, 4), "a2": rng.uniform(0, 0.5, 4), "b0": rng.normal(size=4), "b1": 0.7}
    runs = simulate(model, {"u": u}, batch, {"w": [0.4, -0.3]})["y"]
    assert runs.shape == (4, 300)
    for row in range(4):
        one = {name: np.broadcast_to(value, 4)[row] for name, value in batch.items()}
        np.testing.assert_array_equal(simulate(model, {"u": u}, one, {"w": [0.4, -0.3]})["y"], runs[row])
        top, bottom = [0.0, one["b0"], one["b1"]], [1.0, one["a1"], one["a2"]]
        state = lfiltic(top, bottom, y=[-0.3, 0.4], x=[u[1], u[0]])
        filtered = lfilter(top, bottom, u[2:], zi=state)[0]
        np.testing.assert_allclose(runs[row, 2:], filtered, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        (sympy.Piecewise((1, U > 0.5), (sympy.floor(U), True)), lambda u: np.where(u > 0.5, 1.0, np.floor(u))),
        (sympy.Piecewise((U**3, sympy.And(U >= -0.5, U < 0.5)), (0, True)), lambda u: np.where(abs(u) < 0.5, u**3, 0)),
        (sympy.atan2(U, 2) + sympy.tanh(U) / U, lambda u: np.arctan2(u, 2) + np.tanh(u) / u),
        (sympy.sign(U) * sympy.Abs(U) ** sympy.Float(1.7), lambda u: np.sign(u) * abs(u) ** 1.7),
        (2 / (1 + U**2) ** 3 + sympy.exp(-U), lambda u: 2 / (1 + u**2) ** 3 + np.exp(-u)),
        (sympy.Max(U, -U, sympy.Rational(1, 4)), lambda u: np.maximum(abs(u), 0.25)),
        (1 / sympy.sqrt(U**2) + sympy.pi, lambda u: 1 / abs(u) + np.pi),
    ],
)
def test_functions_equal_those_of_numpy(line, expected, rng):
    u = rng.normal(size=60)
    model = Model(
        "curve", (), (Line(signal("w")[t], line.xreplace({U: signal("u")[t]})),), (Measurement("y", "w", "eta"),)
    )
    np.testing.assert_allclose(simulate(model, {"u": u})["y"], expected(u), rtol=1e-13)


def test_extremes_pass_nan_on():
    root = sympy.sqrt(signal("u")[t])
    for line in (sympy.Max(root, 0), sympy.Max(0, root), sympy.Min(root, 3), sympy.sign(root)):
        model = Model("nan", (), (Line(signal("w")[t], line),), (Measurement("y", "w", "eta"),))
        with pytest.raises(ModelError, match="finite range at sample 1"):
            simulate(model, {"u": np.array([1.0, -1.0, 1.0])})


def test_an_unknown_function_is_refused_by_name():
    line = Line(signal("w")[t], sympy.zeta(signal("u")[t]))
    model = Model("zeta", (), (line,), (Measurement("y", "w", "eta"),))
    with pytest.raises(ModelError, match="zeta: the functions known are Abs, Max"):
        simulate(model, {"u": np.ones(3)})


def test_batch_may_leave_the_recursion_scalar(rng):
    u = rng.normal(size=50)
    model = OutputError(1, 0)
    runs = simulate(model, {"u": u}, {"a1": -0.5, "b0": np.array([1.0, 2.0])})["y"]
    np.testing.assert_allclose(runs[1], 2 * runs[0])


def test_coupled_nonlinear_lines_equal_loop_by_hand(rng):
    a, u, p, q = Parameter("a"), signal("u"), signal("p"), signal("q")
    model = Model(
        "coupled",
        (a,),
        (
            Line(p[t], p[t - 1] + a.symbol * (q[t - 1] - sympy.Max(0, p[t - 1]))),
            Line(q[t], 0.9 * q[t - 2] - a.symbol * sympy.sign(p[t]) * sympy.Abs(u[t])),
        ),
        (Measurement("y", "q", "eta"),),
    )
    assert set(model.states) == {"p", "q"}
    assert model.max_lag == 2
    u_ = rng.normal(size=80)
    p_, q_ = np.zeros(80), np.zeros(80)
    p_[:2], q_[:2] = [0.5, 0.2], [1.0, -1.0]
    for k in range(2, 80):
        p_[k] = p_[k - 1] + 0.1 * (q_[k - 1] - max(0, p_[k - 1]))
        q_[k] = 0.9 * q_[k - 2] - 0.1 * np.sign(p_[k]) * abs(u_[k])
    first = {"p": p_[:2], "q": q_[:2]}
    np.testing.assert_allclose(simulate(model, {"u": u_}, {"a": 0.1}, first)["y"], q_, rtol=1e-12)
    batch = simulate(model, {"u": u_}, {"a": np.array([0.1, 0.2])}, first)["y"]
    np.testing.assert_allclose(batch[0], q_, rtol=1e-12)


def test_magnitude_and_sign_of_what_holds_a_maximum(rng):
    a, (w, u) = Parameter("a", 0.1, 0.9), (signal("w"), signal("u"))
    move = sympy.Max(0, u[t]) ** a.symbol - w[t - 1]
    expression = w[t - 1] + a.symbol * sympy.Abs(move, evaluate=False) * sympy.sign(move - 1)
    model = Model("both", (a,), (Line(w[t], expression),), (Measurement("y", "w", "eta"),))
    u_, w_ = rng.normal(size=60), np.zeros(60)
    for k in range(1, 60):
        step = max(0.0, u_[k]) ** 0.4 - w_[k - 1]
        w_[k] = w_[k - 1] + 0.4 * abs(step) * np.sign(step - 1)
    for values in (0.4, np.array([0.4, 0.5])):
        run = simulate(model, {"u": u_}, {"a": values}, {"w": w_[:1]})["y"]
        np.testing.assert_allclose(np.atleast_2d(run)[0], w_, rtol=1e-12)


def test_errors_in_variables_runs_on_the_measured_input():
    model = ErrorsInVariables(1, 0)
    u = np.array([1.0, 2.0, 3.0])
    run = simulate(model, {"u": u}, {"a1": 0.0, "b0": 2.0})
    np.testing.assert_allclose(run["y"][1:], 2 * u[1:])
    np.testing.assert_allclose(run["u"], u)
    true = simulate(model, {"u_true": u + 1, "u": u}, {"a1": 0.0, "b0": 2.0})
    np.testing.assert_allclose(true["y"][1:], 2 * (u[1:] + 1))


def test_wiener_output_solves_its_inverse(rng):
    u = rng.uniform(-2, 2, 400)
    values = {"alpha": -0.6, "beta": 0.8, "s2": 0.1, "s3": 0.3}
    run = simulate(Wiener(), {"u": u}, values, {"x": [0.3]})
    y = run["y"]
    np.testing.assert_allclose(y + 0.1 * y**2 + 0.3 * y**3, run["x"], rtol=1e-12, atol=1e-12)
    batch = simulate(Wiener(), {"u": u}, {**values, "s3": np.array([0.3, 0.2])}, {"x": [0.3]})
    np.testing.assert_allclose(batch["y"][0], y, rtol=1e-12, atol=1e-12)


def test_wiener_that_is_not_invertible_says_so():
    values = {"alpha": -0.5, "beta": 1.0, "s2": 0.0, "s3": -1.0}
    with pytest.raises(ModelError, match=r"'y' is not invertible at sample 1, .*narrow"):
        simulate(Wiener(), {"u": np.full(5, 3.0)}, values)


def test_wiener_with_a_flat_point_is_invertible():
    model = Wiener(inverse_powers=(3,)).fix(s3=1.0)
    flat = replace(model, measurements=(replace(model.measurements[0], inverse=VALUE**3),))
    run = simulate(flat, {"u": [8.0, 8.0]}, {"alpha": 0.0, "beta": 1.0})
    np.testing.assert_allclose(run["y"], [0.0, 2.0], atol=1e-5)


def test_dataset_simulation_starts_from_the_measured_output(rng):
    model = Wiener().with_values({"alpha": -0.6, "beta": 0.8, "s2": 0.1, "s3": 0.3})
    truth = simulate(model, {"u": rng.uniform(-1, 1, 30)}, initial={"x": [0.7]})
    record = SimpleNamespace(values={"u": truth["u"], "y": truth["y"]})
    data = SimpleNamespace(experiments=(record, record))
    result = model.simulate(data)
    assert len(result.outputs) == 2
    assert result.skip == 1
    np.testing.assert_allclose(result.outputs[1]["y"], truth["y"], rtol=1e-10)
    assert model.simulate(data, initial="rest").signals[0]["x"][0] == 0
    with pytest.raises(ModelError, match="'measured', 'rest'"):
        model.simulate(data, initial="zero")


def test_prediction_equals_one_step_by_hand(rng):
    u, y = rng.uniform(0, 900, 40), rng.normal(size=40)
    model = Hammerstein(input_scale=0.01).with_values(CLUTCH)
    data = SimpleNamespace(experiments=(SimpleNamespace(values={"u": u, "y": y}),))
    expected = [clutch_by_hand(u[k - 1 : k + 1], y[k - 1])[1] for k in range(1, 40)]
    predicted = model.predict(data).outputs[0]["y"]
    np.testing.assert_allclose(predicted[1:], expected, rtol=1e-12)
    assert predicted[0] == y[0]


def test_prediction_passes_the_measurement_through_inserted_lines(rng):
    u, y = rng.normal(size=40), rng.normal(size=40)
    model = OutputError(1, 0).insert_before("w", lambda w: sympy.Max(0, w))
    predicted = predict(model, {"u": u, "y": y}, {"a1": -0.5, "b0": 2.0})["y"]
    np.testing.assert_allclose(predicted[1:], 0.5 * np.maximum(0, y[:-1]) + 2 * u[:-1])


def test_prediction_equals_simulation_on_noise_free_data(rng):
    u = rng.normal(size=60)
    model = OutputError(2, 1).insert_after("w", lambda w: sympy.Min(w, sympy.Rational(1, 2)))
    values = {"a1": -0.9, "a2": 0.2, "b0": 1.0, "b1": 0.3}
    free = simulate(model, {"u": u}, values)
    np.testing.assert_allclose(predict(model, {"u": u, "y": free["y"]}, values)["y"], free["y"], atol=1e-12)


def test_leaving_the_finite_range_names_the_first_sample():
    u = np.ones(3000)
    with pytest.raises(ModelError, match=r"simulation of w leaves the finite range at sample 1\d\d\d.*stable"):
        simulate(OutputError(1, 0), {"u": u}, {"a1": -2.0, "b0": 1.0})
    square = OutputError(1, 0).add_term("w", signal("w")[t - 1] ** 2)
    with pytest.raises(ModelError, match="finite range at sample"):
        simulate(square, {"u": u}, {"a1": -2.0, "b0": 1.0})
    with pytest.raises(ModelError, match="finite range at sample"):
        simulate(square, {"u": u}, {"a1": np.array([-2.0, 0.0]), "b0": 1.0})
    unchecked = simulate(square, {"u": u}, {"a1": np.array([-2.0, 0.0]), "b0": 0.1}, check=False)
    assert not np.isfinite(unchecked["y"][0]).all()
    assert np.isfinite(unchecked["y"][1]).all()


@pytest.mark.parametrize(
    ("channels", "values", "initial", "message"),
    [
        ({}, {"a1": 0.0, "b0": 1.0}, None, "lack the channel 'u'"),
        ({"u": [1.0, np.nan]}, {"a1": 0.0, "b0": 1.0}, None, "not a finite series"),
        ({"u": [1.0, 2.0]}, {"a1": 0.0}, None, "no value for b0"),
        ({"u": [1.0, 2.0]}, {"a1": 0.0, "b0": 1.0, "c": 2.0}, None, "no parameter c"),
        ({"u": [1.0, 2.0]}, {"a1": [0.0, 1.0], "b0": [1.0, 2.0, 3.0]}, None, "common shape"),
        ({"u": [1.0, 2.0]}, {"a1": 0.0, "b0": 1.0}, {"w": []}, "too few"),
        ({"u": [1.0, 2.0]}, {"a1": 0.0, "b0": 1.0}, {"z": [1.0]}, "no line defines"),
    ],
)
def test_what_is_missing_is_named(channels, values, initial, message):
    with pytest.raises(ModelError, match=message):
        simulate(OutputError(1, 0), channels, values, initial)


def test_lengths_and_autonomous_models():
    w = signal("w")
    decay = Model("decay", (), (Line(w[t], w[t - 1] / 2),), (Measurement("y", "w", None),))
    np.testing.assert_allclose(simulate(decay, {}, initial={"w": [4.0]}, n=3)["y"], [4.0, 2.0, 1.0])
    with pytest.raises(ModelError, match="give n"):
        simulate(decay, {})
    with pytest.raises(ModelError, match="long enough"):
        simulate(OutputError(), {"u": [1.0]}, {"a1": 0.0, "b0": 1.0}, n=5)
    assert simulate(OutputError(3, 0), {"u": [1.0]}, {"a1": 0, "a2": 0, "a3": 0, "b0": 1.0})["y"].shape == (1,)


def test_a_long_hammerstein_record_is_fast():
    u = np.abs(900 * np.sin(np.arange(25_000) / 300))
    model = Hammerstein(input_scale=0.01)
    simulate(model, {"u": u[:10]}, CLUTCH)
    times = []
    for _ in range(3):
        start = time.perf_counter()
        simulate(model, {"u": u}, CLUTCH)
        times.append(time.perf_counter() - start)
    assert min(times) < 0.05
