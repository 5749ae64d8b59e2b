import time

import numpy as np
import pytest

from relaxations.errors import ProblemError
from relaxations.formats.expressions import minimise, variables
from relaxations.search.enclosure import Reason
from smid import Dataset, OutputError, diagnose, error_bound, identify
from smid.data import DataError
from smid.models import ModelError


def saturated(n: int = 400) -> Dataset:
    """Return a record of order 2 whose noises are all at their bound of 0.1."""
    rng = np.random.default_rng(0)
    u, x = rng.choice([-1.0, 1.0], n), np.zeros(n)
    for k in range(2, n):
        x[k] = 1.2 * x[k - 1] - 0.5 * x[k - 2] + 0.8 * u[k - 1]
    y = x + 0.1 * rng.choice([-1.0, 1.0], n)
    return Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)


@pytest.mark.parametrize("call", [error_bound, lambda *a, **k: identify(*a, 0.1, **k), diagnose])
@pytest.mark.parametrize("seconds", [0, -1.0, float("nan")])
def test_a_limit_that_is_no_positive_number_is_refused(call, seconds):
    with pytest.raises(ProblemError, match="give a positive number of seconds"):
        call(OutputError(2, stable=True), saturated(20), seconds=seconds)


@pytest.mark.parametrize("seconds", [0.01, 3.0])
def test_identify_returns_what_is_proven_by_then(seconds):
    began = time.thread_time()
    found = identify(OutputError(2, stable=True), saturated(), 0.1, seconds=seconds)
    assert time.thread_time() - began < 1.1 * seconds + 1
    assert found.reason is Reason.TIME
    for name, truth in (("a1", -1.2), ("a2", 0.5), ("b0", 0.8)):
        assert found[name].lower <= truth <= found[name].upper


@pytest.mark.parametrize("seconds", [0.01, 2.0])
def test_error_bound_returns_what_is_proven_by_then(seconds):
    began = time.thread_time()
    found = error_bound(OutputError(2, stable=True), saturated(), seconds=seconds)
    assert time.thread_time() - began < 1.1 * seconds + 1
    assert found.reason is Reason.TIME
    assert found.lower <= 0.1
    assert str(found)


def test_diagnose_returns_what_is_found_by_then_or_says_that_the_time_is_too_short():
    data = saturated(600)
    with pytest.raises(ModelError, match="too short to fit the base model"):
        diagnose(OutputError(1), data, workers=1, seconds=1e-6)
    began = time.thread_time()
    found = diagnose(OutputError(1), data, 0.1, workers=1, seconds=2.0)
    assert time.thread_time() - began < 3.2
    assert found.interrupted


def test_a_linear_program_of_bad_scale_ends_in_an_interval():
    x, y = variables("x y")
    found = minimise(y - 10**12 * x, [10**12 * x - y == 0, x >= 0, x <= 1, y >= 0, y <= 10**12])
    assert found.lower <= 0 <= found.upper


def test_a_value_beyond_floats_is_refused_with_a_cure():
    x, _ = variables("x y")
    with pytest.raises(ProblemError, match="largest float: state the variables in larger units"):
        minimise(x**2, [x >= 10**200, x <= 2 * 10**200])


def test_samples_whose_products_no_float_holds_are_refused():
    u = [1e200, -5e199, 2.5e199, 1e200]
    with pytest.raises(DataError, match="state the channel in a larger unit"):
        Dataset.from_arrays(input={"u": u}, output={"y": u}, sampling_time=1.0)
