"""Extreme parameters with errors within a bound: one linear program agrees where the model is linear."""

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.signal import lfilter

from smid import Dataset, OutputError
from smid.fitting.binding import bind
from smid.fitting.constraints import Constraints
from smid.fitting.problem import Fitting
from smid.fitting.sequential import Descents

BOUND = 0.1


@pytest.mark.parametrize("n", [50, 5000])
@pytest.mark.parametrize("sign", [1, -1])
def test_the_extremes_of_a_linear_model_are_those_of_its_linear_program(n, sign):
    rng = np.random.default_rng(n)
    u = rng.normal(size=n)
    before = np.r_[u[0], u[:-1]]
    y = 2 * before + 0.5 + rng.uniform(-BOUND, BOUND, n)
    data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    problem = Fitting(bind(OutputError(na=0, offset=True), data), data, [np.ones(n, bool)], scale={"y": BOUND})
    phi = np.column_stack([before, np.ones(n)])
    start = problem.start({"b0": 2.0, "offset": 0.5})
    k = problem.run.parameters.index("b0")
    found = Descents(problem).descend(start, sign * np.eye(1, problem.n_free, k)[0], 1.0, 1e3, 1e-6)
    program = linprog([sign, 0], A_ub=np.r_[phi, -phi], b_ub=np.r_[y + BOUND, BOUND - y], bounds=(None, None))
    assert found.largest <= 1 + 1e-9
    assert found.vector[k] == pytest.approx(sign * program.fun, abs=1e-6 * BOUND)
    # As many errors as unknowns hold the solution.
    assert len(found.rows) == 2
    assert np.abs(problem.residual(found.vector)[found.rows]) == pytest.approx([1.0, 1.0], abs=1e-6)


def test_the_constraints_of_the_model_are_kept():
    """The least damping that the data allow is less than none: the prior of stability holds it."""
    n, rng = 40, np.random.default_rng(0)
    u = np.repeat(rng.uniform(-1, 1, n // 5), 5)
    y = lfilter([0, 0.1], [1, -1.9, 0.999], u) + rng.uniform(-BOUND, BOUND, n)
    data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    problem = Fitting(bind(OutputError(na=2, nb=0, stable=True), data), data, [np.ones(n, bool)], scale={"y": BOUND})
    start = problem.start({"a1": -1.9, "a2": 0.999, "b0": 0.1})
    k = problem.run.parameters.index("a2")
    found = Descents(problem).descend(start, -np.eye(1, problem.n_free, k)[0], 1.0, 1e3, 1e-6)
    assert found.largest <= 1 + 1e-6
    assert not Constraints.of(problem).violated(found.vector)
    assert found.vector[k] == pytest.approx(1.0, abs=1e-4)
