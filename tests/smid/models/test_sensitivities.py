"""Sensitivities are derivatives of the free run: central differences must agree, and the run be the simulator's."""

from __future__ import annotations

import numpy as np
import pytest
import sympy

from smid.models import Hammerstein, Line, Measurement, Model, OutputError, Parameter, signal, simulate, t
from smid.models.sensitivities import compile_free_run

N = 80
U = np.random.default_rng(3).uniform(-1, 1, N)


def _backlash() -> Model:
    gap = Parameter("gap", 0, 1)
    play = signal("u_new")
    return OutputError(2, 1).insert_before(
        "u", lambda u: sympy.Max(u - gap.symbol, sympy.Min(u + gap.symbol, play[t - 1])), [gap], new_name="u_new"
    )


def _pendulum() -> Model:
    """Two rate lines: a damped swing, with a helper line between them."""
    k, d = Parameter("k", 0, 10), Parameter("d", 0, 10)
    x, v, f, u = (signal(name) for name in ("x", "v", "f", "u"))
    lines = (
        Line(f[t], -k.symbol * sympy.sin(x[t])),
        Line(x[t], v[t], rate=True),
        Line(v[t], f[t] - d.symbol * v[t] + u[t], rate=True),
    )
    return Model("pendulum", (k, d), lines, (Measurement("y", "x", "eta"),), sampling_time=0.1)


def _clocked() -> Model:
    slope = Parameter("slope", -1, 1)
    model = OutputError().with_line("time", signal("time")[t - 1] + sympy.Float(0.1))
    return model.add_term("w", slope.symbol * signal("time")[t] * signal("w")[t - 1], [slope])


CASES = {
    "output error": (OutputError(2, 1), {"a1": -1.4, "a2": 0.5, "b0": 0.3, "b1": 0.1}),
    "hammerstein": (Hammerstein(powers=(3, 1)), {"alpha": -0.6, "gamma1": 0.7, "gamma2": 1.2}),
    "backlash": (_backlash(), {"a1": -1.4, "a2": 0.5, "b0": 0.3, "b1": 0.1, "gap": 0.21}),
    "pendulum": (_pendulum(), {"k": 4.0, "d": 0.4}),
    "clock": (_clocked(), {"a1": -0.6, "b0": 1.0, "slope": -0.02}),
}


@pytest.mark.parametrize("name", CASES)
def test_derivatives_agree_with_central_differences(name: str) -> None:
    model, values = CASES[name]
    run = compile_free_run(model)
    initial = {state: 0.1 * (k + 1) for k, state in enumerate(run.states)}
    signals, slopes = run.run({"u": U}, values, initial)
    step = 1e-6
    for k, parameter in enumerate((*run.parameters, *run.states)):

        def moved(sign: float, parameter=parameter) -> np.ndarray:  # type: ignore[no-untyped-def,type-arg]
            change = {parameter: sign * step}
            moved_values = {n: v + change.get(n, 0) for n, v in values.items()}
            moved_initial = {s: v + change.get(s, 0) for s, v in initial.items()}
            return run.run({"u": U}, moved_values, moved_initial, jacobian=False)[0][model.measurements[0].signal]

        difference = (moved(1) - moved(-1)) / (2 * step)
        analytic = slopes[model.measurements[0].signal][:, k]
        assert analytic == pytest.approx(difference, abs=1e-6 * (1 + np.abs(difference).max()))
    assert np.isfinite(signals[model.measurements[0].signal]).all()


def test_free_run_is_the_simulators() -> None:
    model, values = CASES["output error"]
    u = np.concatenate([[0.0, 0.0], U])  # at rest, so that both begin alike
    run = compile_free_run(model)
    signals, _ = run.run({"u": u}, values, dict.fromkeys(run.states, 0.0))
    assert signals["w"] == pytest.approx(simulate(model, {"u": u}, values)["w"], abs=1e-12)


@pytest.mark.parametrize("count", [3, 25])
@pytest.mark.parametrize("name", CASES)
def test_runs_in_lockstep_are_those_of_each_alone(name: str, count: int) -> None:
    model, values = CASES[name]
    run = compile_free_run(model)
    initial = {state: 0.1 * (k + 1) for k, state in enumerate(run.states)}
    factors = np.linspace(0.9, 1.1, count)
    many = {parameter: value * factors for parameter, value in values.items()}
    known = run.trajectory({"u": U}, many, initial)
    shown = model.measurements[0].signal
    slopes = run.cut(run.slopes(known, many), time=1)[shown]
    for k in range(0, count, 2):
        one, steep = run.run({"u": U}, {parameter: value[k] for parameter, value in many.items()}, initial)
        assert run.cut({shown: known[shown]}, time=1)[shown][k] == pytest.approx(one[shown], rel=1e-10, abs=1e-12)
        assert slopes[k] == pytest.approx(steep[shown], rel=1e-8, abs=1e-9)


def test_of_runs_in_lockstep_those_that_run_away_are_named() -> None:
    run = compile_free_run(OutputError())
    values = {"a1": np.array([-0.5, -3.0]), "b0": np.ones(2)}
    known = run.trajectory({"u": np.ones(3000)}, values, {("w", 1): 0.0})
    assert run.finite(known).tolist() == [True, False]
    assert run.slopes(known, values) == {}


def test_clock_shows_zero_at_the_first_sample_and_is_no_state() -> None:
    model, values = CASES["clock"]
    run = compile_free_run(model)
    signals, _ = run.run({"u": U}, values, dict.fromkeys(run.states, 0.0))
    assert run.states == (("w", 1),)
    assert signals["time"] == pytest.approx(0.1 * np.arange(N))


def test_fixed_parameters_are_no_columns() -> None:
    run = compile_free_run(OutputError(fixed={"a1": -0.5}))
    assert run.parameters == ("b0",)


def test_runaway_simulation_gives_no_derivatives() -> None:
    run = compile_free_run(OutputError())
    signals, slopes = run.run({"u": np.ones(3000)}, {"a1": -3.0, "b0": 1.0}, {("w", 1): 0.0})
    assert not np.isfinite(signals["w"]).all()
    assert slopes == {}
