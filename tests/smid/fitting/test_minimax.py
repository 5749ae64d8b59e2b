"""A descent to the least largest error: linear programs agree where the model is linear, certified ends everywhere."""

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from smid import Dataset, Model, OutputError, error_bound
from smid.fitting.binding import bind
from smid.fitting.fit import fit
from smid.fitting.minimax import minimax
from smid.fitting.problem import Fitting
from smid.models import Line, Measurement, Parameter, signal, t


def recorded(seed: int, n: int, pole: float, bound: float = 0.1) -> Dataset:
    rng = np.random.default_rng(seed)
    u, w = rng.choice([-1.0, 1.0], n), np.zeros(n)
    for k in range(1, n):
        w[k] = pole * w[k - 1] + u[k - 1]
    return Dataset.from_arrays(input={"u": u}, output={"y": w + bound * rng.uniform(-1, 1, n)}, sampling_time=1.0)


def descend(model: OutputError, data: Dataset) -> tuple[float, float]:
    """Return the largest errors of least squares and of the descent, in the output's unit."""
    fitted = fit(model, data, starts=2)
    problem = Fitting(model, data, [np.ones(run.n_samples, bool) for run in data.experiments], fitted.initial)
    start = problem.start(fitted.model.values)
    vector, largest = minimax(problem, start)
    assert largest == np.abs(problem.residual(vector)).max()
    return float(np.abs(problem.residual(start)).max()) * problem.scale["y"], largest * problem.scale["y"]


@given(st.integers(0, 1000))
@settings(max_examples=10, deadline=None)
def test_a_linear_model_meets_its_linear_program(seed):
    data = recorded(seed, 40, 0.0)
    u, y = (data.experiments[0].values[name] for name in "uy")
    before = np.concatenate([[u[0]], u[:-1]])
    phi = np.column_stack([before, np.ones_like(u)])
    plan = np.column_stack([np.vstack([phi, -phi]), -np.ones(2 * len(y))])
    program = linprog([0, 0, 1], A_ub=plan, b_ub=np.r_[y, -y], bounds=[(None, None)] * 2 + [(0, None)])
    squares, least = descend(OutputError(na=0, offset=True), data)
    assert least == pytest.approx(program.fun, rel=2e-3)
    assert least <= squares


def test_it_lies_in_the_certified_enclosure_and_below_least_squares():
    data = recorded(3, 40, 0.6)
    squares, least = descend(OutputError(), data)
    enclosure = error_bound(OutputError(stable=True), data)
    assert enclosure.lower <= least <= 1.01 * enclosure.upper
    assert least < squares
    assert least < 0.1


def test_a_sensitivity_that_does_not_exist_holds_nothing_up():
    """The slope of a root at rest is infinite: the fit of the other samples goes on."""
    gain, u = Parameter("b", 0.1, 4.0), np.array([0.0, 1.0, 4.0, 0.0, 9.0, 1.0])
    root = sympy.sqrt(gain.symbol * signal("u")[t])
    model = Model("a root", (gain,), (Line(signal("w")[t], root),), (Measurement("y", "w", "eta"),))
    data = Dataset.from_arrays(input={"u": u}, output={"y": 1.5 * np.sqrt(u)}, sampling_time=1.0)
    problem = Fitting(bind(model, data), data, [np.ones(6, bool)])
    with np.errstate(all="ignore"):
        vector, largest = minimax(problem, problem.start({"b": 1.0}))
    assert vector[0] == pytest.approx(1.5**2, rel=1e-2)
    assert largest < 0.05


def test_a_start_that_runs_away_is_told_by_an_infinite_error():
    data = recorded(0, 600, 0.5)
    problem = Fitting(OutputError(), data, [np.ones(600, bool)])
    _, largest = minimax(problem, problem.start({"a1": -9.0, "b0": 1.0}))
    assert largest == np.inf
