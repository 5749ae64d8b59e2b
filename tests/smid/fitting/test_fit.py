"""Output-error least squares finds what made the data, through kinks, several experiments and bad starts."""

from __future__ import annotations

import numpy as np
import pytest
import sympy

from relaxations.algebra.arrays import Array
from smid import DataError, Dataset, Hammerstein, OutputError, Parameter
from smid.diagnosis.effects.effect import Site
from smid.diagnosis.effects.input_backlash import extend
from smid.fitting.fit import fit
from smid.fitting.problem import Fitting
from smid.models import VALUE, Line, Measurement, Model, signal, simulate, t

RNG = np.random.default_rng(5)
U = np.repeat(RNG.uniform(-1, 1, 60), 5)


def _data(model: Model, values: dict[str, float], noise: float = 0.0, seed: int = 0) -> Dataset:
    y = simulate(model, {"u": U}, values)["y"] + noise * np.random.default_rng(seed).uniform(-1, 1, len(U))
    return Dataset.from_arrays(input={"u": U}, output={"y": y}, sampling_time=0.1)


@pytest.mark.parametrize(
    ("model", "values"),
    [
        (OutputError(2, 1), {"a1": -1.6, "a2": 0.68, "b0": 0.05, "b1": 0.03}),
        (Hammerstein(powers=(3, 1)), {"alpha": -0.7, "gamma1": 0.4, "gamma2": 1.0}),
        (
            OutputError().insert_before("u", lambda u: sympy.Max(0, u - sympy.Symbol("d")), [Parameter("d", 0, 1)]),
            {"a1": -0.8, "b0": 0.5, "d": 0.3},
        ),
    ],
)
def test_noise_free_data_give_back_the_parameters(model: Model, values: dict[str, float]) -> None:
    found = fit(model, _data(model, values)).model.values
    assert found == pytest.approx(values, abs=1e-5)


@pytest.mark.parametrize(
    ("resonance", "damping", "step"), [(430.0, 0.05, 1 / 610), (3.0, 0.2, 0.05), (0.01, 0.7, 10.0), (50.0, 0.01, 0.005)]
)
@pytest.mark.parametrize("seed", range(3))
def test_a_law_of_physics_is_fitted_whatever_the_size_of_its_parameters(
    resonance: float, damping: float, step: float, seed: int
) -> None:
    """Mass, spring and damper in boxes that say nothing. Most values in these diverge, or the mass hardly moves."""
    gain, drag, stiffness = Parameter("gain", 0, 1e8), Parameter("drag", 0, 1e4), Parameter("stiffness", 0, 1e8)
    x, v, u = signal("x"), signal("v"), signal("u")
    force = gain.symbol * u[t] - drag.symbol * v[t] - stiffness.symbol * x[t]
    lines = (Line(x[t], v[t], rate=True), Line(v[t], force, rate=True))
    plant = Model("oscillator", (gain, drag, stiffness), lines, (Measurement("y", "x", "eta"),), sampling_time=step)
    true = {"gain": resonance**2, "drag": 2 * damping * resonance, "stiffness": resonance**2}
    y = simulate(plant, {"u": U}, true)["y"]
    noisy = y + 0.02 * y.std() * np.random.default_rng(seed).normal(size=len(y))
    data = Dataset.from_arrays(input={"u": U}, output={"y": noisy}, sampling_time=step)
    assert fit(plant, data, seed=seed).model.values == pytest.approx(true, rel=0.05)


def test_which_start_is_the_best_does_not_matter() -> None:
    """Several lead to the optimum, and the last digits of their costs depend on the processor."""
    data = _data(OutputError(2, 1), {"a1": -1.9, "a2": 0.91, "b0": 0.05, "b1": -0.04}, 0.2)
    found = [list(fit(OutputError(1, 1), data, seed=seed).model.values.values()) for seed in range(4)]
    assert np.allclose(found, found[0], rtol=1e-5, atol=0)


def test_error_is_the_noise() -> None:
    model, values = OutputError(2, 1), {"a1": -1.6, "a2": 0.68, "b0": 0.05, "b1": 0.03}
    data = _data(model, values, 0.02)
    residual = fit(model, data).residual(data, "y")[0]
    assert np.sqrt(np.mean(residual**2)) == pytest.approx(0.02 / np.sqrt(3), rel=0.1)


def test_only_the_used_samples_count() -> None:
    model, values = OutputError(), {"a1": -0.8, "b0": 0.5}
    data = _data(model, values)
    spoilt = Dataset.from_arrays(
        input={"u": U},
        output={"y": np.where(np.arange(len(U)) < 200, data.experiments[0].values["y"], 7.0)},
        sampling_time=0.1,
    )
    found = fit(model, spoilt, [np.arange(len(U)) < 200])
    assert found.model.values == pytest.approx(values, abs=1e-5)
    assert len(found.simulated[0]["y"]) == len(U)


def test_experiments_share_parameters_and_have_their_own_start() -> None:
    model, values = OutputError(), {"a1": -0.9, "b0": 0.5}
    runs = [
        Dataset.from_arrays(
            input={"u": U},
            output={"y": simulate(model, {"u": U}, values, {"w": np.array([start])})["y"]},
            sampling_time=0.1,
            name=name,
        )
        for name, start in (("low", -2.0), ("high", 3.0))
    ]
    data = Dataset.merge(runs)
    found = fit(model, data)
    assert found.model.values == pytest.approx(values, abs=1e-5)
    assert found.cost < 1e-8


def test_each_of_many_experiments_begins_in_the_swing_it_was_cut_from() -> None:
    model, values = OutputError(2, 1), {"a1": -1.5, "a2": 0.95, "b0": 0.05, "b1": 0.03}
    whole = _data(model, values).experiments[0].values
    # As the windows of a long record: between two samples of the swing there is a speed.
    windows = [
        Dataset.from_arrays(
            input={"u": whole["u"][k : k + 50]}, output={"y": whole["y"][k : k + 50]}, sampling_time=0.1, name=f"{k}"
        )
        for k in range(20, 250, 55)
    ]
    assert fit(model, Dataset.merge(windows)).model.values == pytest.approx(values, abs=1e-6)


def test_curved_sensor_is_differentiated_through_its_inverse() -> None:
    plain = OutputError()
    model = Model("curved", plain.parameters, plain.lines, (Measurement("y", "w", "eta", VALUE + VALUE**3),))
    values = {"a1": -0.8, "b0": 0.5}
    data = _data(model, values)
    assert fit(model, data).model.values == pytest.approx(values, abs=1e-5)


def test_a_model_that_always_runs_away_is_refused() -> None:
    model = OutputError(fixed={"a1": -3.0})
    with pytest.raises(DataError, match="cannot be simulated"):
        fit(model, _data(OutputError(), {"a1": -0.5, "b0": 1.0}))


def test_a_fit_prints_its_model_and_its_cost() -> None:
    u = np.sin(np.arange(2000.0) ** 1.2)
    y = simulate(OutputError(), {"u": u}, {"a1": -0.5, "b0": 1.0})["y"]
    data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    found = fit(OutputError(), data)
    model, cost = repr(found).rsplit("\n", 1)
    assert model == str(found.model)
    assert cost.startswith(f"{found.n_free} fitted numbers")
    assert len(found.to_dict()["simulated"][0]["y"]) == 2000


@pytest.mark.parametrize(("seed", "gap"), [(25, 0.3), (25, 1.5), (26, 0.3), (28, 0.75)])
def test_a_state_that_ran_off_beyond_its_stop_comes_back(seed: int, gap: float) -> None:
    rng = np.random.default_rng(seed)
    command = np.repeat(rng.uniform(-1.5, 1.5, 25), 10)
    stop = next(extend(OutputError(), Site(_record(command, command), "u", "y", (command,)))).model
    y = simulate(stop, {"u": command}, {"a1": -0.78, "b0": -0.38, "backlash_gap": 0.9})["y"][53:]
    noise = 0.01 * rng.normal(size=y.size)
    problem = Fitting(stop, _record(command[53:], y + noise), [np.ones(y.size, bool)])
    _, cost = problem.solve(problem.start({"a1": -0.9, "b0": -0.2, "backlash_gap": gap}), 200)
    assert cost * problem.scale["y"] ** 2 < np.sum(noise**2)


def _record(u: Array, y: Array) -> Dataset:
    return Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
