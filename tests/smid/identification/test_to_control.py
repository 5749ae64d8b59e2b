"""The central model as a transfer function: its step response is the model's own, from rest."""

import sys
import warnings
from dataclasses import replace

import numpy as np
import pytest

from smid import (
    Dataset,
    ErrorsInVariables,
    Hammerstein,
    Model,
    ModelError,
    OutputError,
    ParameterInterval,
    Reactor,
    Wiener,
    identify,
)
from smid.identification.estimate import CentreStatus, Estimate, Proof, Reason
from smid.models import Line, Measurement, signal, simulate, t
from smid.models.linear_block import linear_block

control = pytest.importorskip("control", reason="control is an extra")
RECORD = Dataset.from_arrays(input={"u": [1.0, 0, 1, 1]}, output={"y": [0.0, 1, 1, 2]}, sampling_time=0.25)
STEP = np.ones(12)


def estimate(
    model: Model, values: dict[str, float], data: Dataset = RECORD, unbounded: tuple[str, ...] = ()
) -> Estimate:
    """An estimate whose central model has these values."""
    names = [p.name for p in model.parameters]
    intervals = tuple(
        ParameterInterval(n, "", values[n], values[n], values[n], values[n], Proof.PROVEN, Proof.PROVEN) for n in names
    )
    status = CentreStatus.FEASIBLE
    return Estimate(
        model.with_values(values), data, {"y": 0.1}, intervals, status, None, (), unbounded, Reason.TIGHT, None
    )


def response(system, count: int = len(STEP)) -> np.ndarray:
    return np.asarray(control.forced_response(system, T=system.dt * np.arange(count), U=np.ones(count)).outputs)


CASES = {
    "one pole": (OutputError(1, 0), {"a1": -0.5, "b0": 1.5}),
    "no pole": (OutputError(0, 1, 0), {"b0": 2.0, "b1": -1.0}),
    "oscillation, delay of three": (OutputError(2, 1, 3), {"a1": -1.2, "a2": 0.72, "b0": 0.5, "b1": 0.25}),
    "more zeros than poles": (OutputError(1, 3, 0), {"a1": 0.3, "b0": 1.0, "b1": -2.0, "b2": 0.5, "b3": 0.125}),
    "integrator": (OutputError(1, 0, integrator=True), {"b0": 0.1}),
    "known gain": (OutputError(1, 0, dc_gain=2.0, stable=True), {"a1": -0.7}),
}


@pytest.mark.parametrize("case", CASES)
def test_the_step_response_is_the_simulation_from_rest(case):
    model, values = CASES[case]
    values = {p.name: values.get(p.name, p.lower) for p in model.parameters}
    system = estimate(model, values).to_control()
    own = simulate(model.with_values(values), {"u": np.r_[np.zeros(9), STEP]})["y"][9:]
    np.testing.assert_allclose(response(system), own, rtol=1e-12, atol=1e-12)
    assert (system.dt, system.input_labels, system.output_labels) == (0.25, ["u"], ["y"])


def test_of_errors_in_variables_it_is_of_the_true_input():
    system = estimate(ErrorsInVariables(1, 0, 1), {"a1": -0.5, "b0": 1.0}).to_control()
    assert (system.input_labels, system.output_labels) == (["u"], ["y"])
    np.testing.assert_allclose(response(system, 4), [0, 1, 1.5, 1.75])


def test_of_a_hammerstein_model_it_begins_behind_the_curve():
    model = Hammerstein(2, (3, 1), zeros=1, input_scale=0.5, unit_dc_gain=False, fixed={"gamma1": 1.0})
    values = {"alpha1": -0.9, "alpha2": 0.2, "gamma2": 0.5, "beta0": 0.4, "beta1": 0.1}
    values = {p.name: values.get(p.name, p.lower) for p in model.parameters}
    system = estimate(model, values).to_control()
    assert (system.input_labels, system.output_labels) == (["x"], ["y"])
    own = simulate(model.with_values(values), {"u": np.r_[np.zeros(9), STEP]})
    np.testing.assert_allclose(response(system), own["y"][9:] / own["x"][-1], atol=1e-12)
    # A curve that is a straight line belongs to the linear block.
    assert estimate(Hammerstein(1, (1,)), {"alpha": -0.5, "gamma1": 2.0}).to_control().input_labels == ["u"]


def test_of_a_wiener_model_it_ends_before_the_curve():
    values = {"alpha": -0.5, "beta": 1.0, "s3": 0.1}
    system = estimate(Wiener(1, (3,)), values).to_control()
    assert (system.input_labels, system.output_labels) == (["u"], ["x"])
    np.testing.assert_allclose(response(system, 4), [0, 1, 1.5, 1.75])


@pytest.mark.parametrize("scheme", ["euler", "rk4"])
def test_of_a_model_in_derivatives_it_is_what_the_scheme_makes_of_it(scheme):
    model = replace(Reactor(2.0), scheme=scheme, sampling_time=0.25)
    values = {p.name: p.lower for p in model.parameters}
    own = simulate(model, {"u": STEP}, initial={"w": np.zeros(1)})["y"]
    np.testing.assert_allclose(response(estimate(model, values).to_control()), own, atol=1e-12)


def test_an_offset_is_left_out_and_told():
    values = {"a1": -0.5, "b0": 1.0, "offset": 3.0}
    with pytest.warns(UserWarning, match="the constant in the line of w is no part of a transfer function"):
        system = estimate(OutputError(1, 0, offset=True), values).to_control()
    np.testing.assert_allclose(response(system, 4), [0, 1, 1.5, 1.75])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        estimate(OutputError(1, 0, offset=True), {**values, "offset": 0.0}).to_control()


def test_several_experiments_share_one():
    rng = np.random.default_rng(1)
    runs = []
    for name in ("first", "second"):
        u, w = rng.choice([-1.0, 1.0], 12), np.zeros(12)
        w[0] = rng.normal()
        for k in range(1, 12):
            w[k] = 0.7 * w[k - 1] + u[k - 1]
        y = w + rng.uniform(-0.02, 0.02, 12)
        runs.append(Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=0.5, name=name))
    found = identify(OutputError(1, stable=True), Dataset.merge(runs), 0.02)
    system = found.to_control()
    assert system.poles()[0] == pytest.approx(-found.parameters["a1"])
    assert system.dcgain() == pytest.approx(found.parameters["b0"] / (1 + found.parameters["a1"]))
    # What each run begins with is no part of it: beside the free run there is only a decaying difference.
    free = found.model.simulate(found.data).outputs[1]["y"]
    u = found.data.values("u", 1)
    from_rest = np.asarray(control.forced_response(system, T=0.5 * np.arange(12), U=u).outputs)
    decay = (-found.parameters["a1"]) ** np.arange(12)
    np.testing.assert_allclose(free - from_rest, free[0] * decay, atol=1e-12)


def with_lines(*lines: Line, outputs: tuple[str, ...] = ("w",)) -> Model:
    measured = tuple(Measurement(f"y{k or ''}", name, f"eta{k or ''}") for k, name in enumerate(outputs))
    return Model("own", (), lines, measured)


u, v, w, x = (signal(name)[t] for name in ("u", "v", "w", "x"))
W, V = signal("w")[t - 1], signal("v")[t - 1]


@pytest.mark.parametrize(
    ("model", "why"),
    [
        (with_lines(Line(w, 0.5 * W + W**2 + u)), "the line of 'w' in 'own' is not linear.*simulate the model instead"),
        (with_lines(Line(w, W / 2 + u + signal("v")[t])), "'y' follows from u, v in 'own'"),
        (with_lines(Line(w, W / 2)), "'y' follows from nothing"),
        (with_lines(Line(w, W / 2 + u), Line(x, 2 * w), outputs=("w", "x")), "has the outputs y, y1"),
        (with_lines(Line(x, W**2), Line(w, W / 2 + u - x)), "'y' follows from u, x"),
    ],
)
def test_what_has_no_transfer_function_says_why(model, why):
    with pytest.raises(ModelError, match=why):
        linear_block(model)


def test_lines_in_a_row_and_in_a_loop_are_solved_together():
    model = with_lines(Line(v, 0.5 * V + u), Line(x, v - 0.2 * W), Line(w, 0.9 * W + 0.1 * x))
    own = simulate(model, {"u": np.r_[np.zeros(9), STEP]})["y"][9:]
    np.testing.assert_allclose(response(estimate(model, {}).to_control()), own, atol=1e-12)


def test_without_a_central_model_there_is_none():
    with pytest.raises(ModelError, match="there is no central model"):
        estimate(OutputError(1, 0), {"a1": -0.5, "b0": 1.0}, unbounded=("b0",)).to_control()


def test_a_missing_package_is_named_with_its_cure(monkeypatch):
    monkeypatch.setitem(sys.modules, "control", None)
    with pytest.raises(ImportError, match=r"to_control needs control; install it with: pip install smid\[control\]"):
        estimate(OutputError(1, 0), {"a1": -0.5, "b0": 1.0}).to_control()
