"""Without hidden states: every run fulfils the lines that are left, and intervals need no box of the states."""

from pathlib import Path
from time import process_time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from relaxations.search.enclosure import Reason
from smid import Dataset, Model, OutputError, OwnModel, identify, verify
from smid.feasible.feasible_set import FeasibleSet
from smid.feasible.template import Templates, is_polynomial
from smid.identification.windows.whole_record import suits
from smid.models.hidden_states import without_hidden_states
from smid.models.simulate import predict, simulate
from smid.models.structure import first_samples


def motion(scheme: str = "euler", force: str = "-k*x - c*v") -> Model:
    box = {name: [0, 20] for name in ("k", "c", "b") if name in force or name == "b"}
    equations = ["d/dt x = v", f"d/dt v = b*u + {force}"]
    return OwnModel(equations, ["x"], ["u"], box, scheme=scheme, sampling_time=0.1)


MODELS = {
    "euler": motion(),
    "trapezoidal": motion("trapezoidal"),
    "rk4": motion("rk4"),
    "drag on a hidden speed": motion(force="-c*v*Abs(v) - k*x**3"),
    "sensor beside the states": OwnModel(
        [
            "x1[t] = a*x1[t-1] + x2[t-1]",
            "x2[t] = -0.2*x1[t-1] + c*x2[t-1] + b*u[t-1]",
            "x[t] = x1[t] + d*x2[t] + u[t-3]",
        ],
        ["x"],
        ["u"],
        {name: [-1, 1] for name in "abcd"},
    ),
    "a third state behind the second": OwnModel(
        [
            "x[t] = a*x[t-1] + p[t-1]",
            "p[t] = c*p[t-1] + f[t]",
            "f[t] = q[t]/2 + u[t]**2",
            "q[t] = d*q[t-2] + b*u[t-1]*x[t-1]",
        ],
        ["x"],
        ["u"],
        {name: [-0.5, 0.5] for name in "abcd"},
    ),
    "two outputs": OwnModel(
        ["x[t] = a*x[t-1] + h[t-1]", "h[t] = b*h[t-1] + c*u[t-1] + x[t-1]/5", "z[t] = d*z[t-1] + 2*h[t-1]"],
        ["x", "z"],
        ["u"],
        {name: [-0.5, 0.5] for name in "abcd"},
    ),
}


LATE = {
    "seen a sample later": OwnModel(["h[t] = a*h[t-1] + u[t]", "x[t] = h[t-1]"], ["x"], ["u"], {"a": [-0.9, 0.9]}),
    "seen two samples later, beside the input": OwnModel(
        ["h[t] = a*h[t-1] + b*u[t-1]", "x[t] = h[t-2] + u[t]"], ["x"], ["u"], {"a": [-0.9, 0.9], "b": [-1, 1]}
    ),
}


@pytest.mark.parametrize("name", [*(name for name in MODELS if not Templates.of(MODELS[name]).hinges), *LATE])
@given(seed=st.integers(0, 2**31))
@settings(max_examples=10, deadline=None)
def test_every_equation_holds_whatever_was_before_the_record(name, seed):
    """What the lines do not compute of the first samples is anything."""
    model, rng = (MODELS | LATE)[name], np.random.default_rng(seed)
    values = {p.name: float(rng.uniform(p.lower, p.upper) / 4) for p in model.parameters}
    first = {state: rng.normal(size=model.max_lag) / 4 for state in model.states}
    u = rng.normal(size=30)
    run = simulate(model, {"u": u}, values, first)
    begins = first_samples(model.discretised().lines)
    outputs = {}
    for m in model.measurements:
        outputs[m.channel] = run[m.signal][10:].copy()
        if m.signal not in model.states:
            outputs[m.channel][: begins[m.signal]] = rng.normal(size=begins[m.signal])
    data = Dataset.from_arrays(input={"u": u[10:]}, output=outputs, sampling_time=0.1)
    feasible = FeasibleSet(model, data, 0.1)
    truth = np.zeros(feasible.n_variables)
    truth[: len(values)] = list(values.values())
    assert feasible.n_equalities > 0
    assert feasible.problem.equalities.evaluate(truth) == pytest.approx(0.0, abs=1e-8)


@pytest.mark.parametrize("name", MODELS)
@given(seed=st.integers(0, 2**31))
@settings(max_examples=10, deadline=None)
def test_a_run_of_the_model_fulfils_the_lines_that_are_left(name, seed):
    model, rng = MODELS[name], np.random.default_rng(seed)
    left = without_hidden_states(model)
    shown = {m.signal: m.channel for m in model.measurements}
    assert {line.signal for line in left.lines} == set(shown)
    values = {p.name: float(rng.uniform(p.lower, p.upper) / 4) for p in model.parameters}
    first = {state: rng.normal(size=4) / 4 for state in model.states}
    u = rng.normal(size=30)
    run = simulate(model, {"u": u}, values, first)
    again = predict(left, {"u": u} | {channel: np.nan_to_num(run[signal]) for signal, channel in shown.items()}, values)
    for signal, channel in shown.items():
        # From the first sample whose past is a run.
        settled = slice(4 + left.max_lag, None)
        assert again[channel][settled] == pytest.approx(run[signal][settled], rel=1e-8, abs=1e-8)


def test_what_cannot_be_eliminated_stays():
    kept = OwnModel(["x[t] = a*x[t-1] + h[t-1]**2", "h[t] = a*h[t-1] + u[t-1]"], ["x"], ["u"], {"a": [0, 1]})
    assert without_hidden_states(kept) == kept
    assert without_hidden_states(OutputError()) == OutputError()


def position(n: int, seed: int = 0) -> Dataset:
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-1, 1, n // 10 + 1), 10)[:n]
    x = simulate(motion(), {"u": u}, {"k": 4.0, "c": 1.0, "b": 3.0})["x_true"]
    return Dataset.from_arrays(input={"u": u}, output={"x": x + rng.uniform(-0.01, 0.01, n)}, sampling_time=0.1)


def test_mass_spring_and_damper_from_the_position_alone(tmp_path: Path):
    data, file = position(50), tmp_path / "proof.json"
    estimate = identify(motion(), data, 0.01, tolerance=0.05, certificate=file)
    assert estimate.reason is Reason.TIGHT
    assert all(estimate[name].lower <= true <= estimate[name].upper for name, true in (("k", 4), ("c", 1), ("b", 3)))
    assert all(interval.width < 0.1 for interval in estimate)
    assert verify(file, data, motion(), 0.01).intervals["k"] == (estimate["k"].lower, estimate["k"].upper)


def test_the_same_as_a_model_of_the_position_with_two_lags():
    """Two statements of one set: x[t] = (2 - c h) x[t-1] - (1 - c h + k h^2) x[t-2] + b h^2 u[t-2]."""
    data = position(60)
    plain = OwnModel(
        ["x[t] = (2 - c/10)*x[t-1] - (1 - c/10 + k/100)*x[t-2] + b/100*u[t-2]"],
        ["x"],
        ["u"],
        {name: [0, 20] for name in "kcb"},
    )
    one, other = (identify(model, data, 0.01, tolerance=0.01) for model in (motion(), plain))
    for a, b in zip(one, (other[i.name] for i in one), strict=True):
        assert a.lower == pytest.approx(b.lower, abs=0.02 * b.width)
        assert a.upper == pytest.approx(b.upper, abs=0.02 * b.width)


def test_long_records_of_the_position_are_proven_on_windows():
    assert suits(Templates.of(motion()))


def test_coulomb_friction_of_a_hidden_speed():
    model = OwnModel(
        ["d/dt x = v", "d/dt v = b*u - F*sign(v)"],
        ["x"],
        ["u"],
        {"b": [0, 9], "F": [0, 1]},
        scheme="euler",
        sampling_time=0.1,
    )
    rng = np.random.default_rng(1)
    u = np.repeat(rng.uniform(-1, 1, 4), 10)
    x = simulate(model, {"u": u}, {"b": 3.0, "F": 0.2})["x_true"]
    data = Dataset.from_arrays(input={"u": u}, output={"x": x + rng.uniform(-1e-3, 1e-3, 40)}, sampling_time=0.1)
    estimate = identify(model, data, 1e-3)
    assert not estimate.unbounded
    assert estimate["b"].lower <= 3.0 <= estimate["b"].upper
    assert estimate["F"].lower <= 0.2 <= estimate["F"].upper


def masses(seen: str) -> Model:
    """Two masses with a spring and a damper between them, by the trapezoidal rule: coefficients are quotients."""
    equations = [
        "push[t] = b*u[t-1]",
        "coasting[t] = (push[t] - (1 - 2*z*T)*force[t-1])/(1 - r)",
        "force[t] = (twist[t-1] + slip[t-1] + coasting[t]/2)/(T**2 + (1 + 2*z*T)/(1 - r)/2)",
        "slip[t] = slip[t-1] + coasting[t] - (1 + 2*z*T)*force[t]/(1 - r)",
        "twist[t] = twist[t-1] + (slip[t-1] + slip[t])/2",
        f"w[t] = 0.9*w[t-1] + push[t] + {seen}",
    ]
    box = {"b": [0, 2], "r": [0.02, 0.95], "z": [0, 1], "T": [0.1, 5]}
    return OwnModel(equations, {"y": "w"}, ["u"], box)


@pytest.mark.parametrize("seen", ["r*(slip[t] - slip[t-1])", "r*slip[t] - twist[t]/3"])
def test_quotients_are_eliminated_in_seconds_and_refused_as_no_polynomial(seen):
    model = masses(seen)
    began = process_time()
    plain = without_hidden_states(model)
    assert not plain.discretised().states or "slip" not in plain.states
    assert not is_polynomial(model)
    assert process_time() - began < 10
    values = {"b": 0.7, "r": 0.3, "z": 0.1, "T": 1.3}
    u = np.random.default_rng(0).uniform(-1, 1, 40)
    run = simulate(model, {"u": u}, values)["y"]
    # The line that is left predicts the run from its own past.
    left = predict(plain, {"u": u, "y": run}, values)["y"]
    np.testing.assert_allclose(left[8:], run[8:], atol=1e-9)


def test_a_quotient_that_cancels_is_a_polynomial():
    scaled = OwnModel(["h[t] = a*h[t-1] + u[t-1]/c", "w[t] = c*h[t]"], {"y": "w"}, ["u"], {"a": [-1, 1], "c": [1, 2]})
    assert is_polynomial(scaled)
    assert [str(line) for line in without_hidden_states(scaled).lines] == ["w[t] = a*w[t - 1] + u[t - 1]"]


def test_other_functions_of_parameters_are_coefficients_like_any_other():
    model = OwnModel(
        ["h[t] = exp(-a)*h[t-1] + sqrt(2)*u[t-1]", "w[t] = w[t-1]/2 + h[t-1]"], {"y": "w"}, ["u"], {"a": [0, 1]}
    )
    u = np.random.default_rng(1).uniform(-1, 1, 30)
    run = simulate(model, {"u": u}, {"a": 0.4})["y"]
    plain = without_hidden_states(model)
    assert plain.states == ("w",)
    np.testing.assert_allclose(predict(plain, {"u": u, "y": run}, {"a": 0.4})["y"][4:], run[4:], atol=1e-12)


def test_kinks_of_kinks_are_told_line_by_line():
    # Put into each other, they would take minutes.
    equations = ["h0[t] = a*h0[t-1] + u[t-1]"]
    for k in range(1, 9):
        equations.append(f"h{k}[t] = h{k - 1}[t] - Max(-c, Min(c, h{k - 1}[t] + a*h{k - 1}[t-1]))/(1 + a)")
    model = OwnModel([*equations, "w[t] = a*w[t-1] + h8[t]"], {"y": "w"}, ["u"], {"a": [0, 0.5], "c": [0, 1]})
    began = process_time()
    assert without_hidden_states(model) == model
    assert process_time() - began < 2
