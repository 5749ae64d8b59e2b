"""A record and its certified intervals."""

import numpy as np
import pytest

from benchmarks.bands import simulate
from smid import Dataset, OutputError, identify
from tests.smid.responses.first_order_record import BOUND, U


@pytest.fixture(scope="package")
def record():
    """A record of w[t] = 0.7 w[t-1] + 0.5 u[t-1]."""
    w = simulate(np.array([[-0.7]]), np.array([[0.5]]), 1, U[None], np.zeros((1, 1)))[0]
    noise = np.random.default_rng(1).uniform(-BOUND, BOUND, len(U))
    return Dataset.from_arrays(input={"u": U}, output={"y": w + noise}, sampling_time=0.1, units={"u": "V", "y": "bar"})


@pytest.fixture(scope="package")
def estimate(record):
    return identify(OutputError(stable=True), record, BOUND)
