"""Certified intervals of what a diagnosis added."""

import numpy as np
import pytest

from smid.data import Dataset
from smid.diagnosis import diagnose, prove_parameters
from smid.models import OutputError

BOUND = 0.03


@pytest.fixture(scope="module")
def found():
    """A lag behind an actuator that does not move below 0.4, to either side; the formula is written out here."""
    rng = np.random.default_rng(5)
    u = np.repeat(rng.uniform(-1, 1, 100), 4)
    w = np.zeros(400)
    for k in range(1, 400):
        acts = np.sign(u[k - 1]) * max(abs(u[k - 1]) - 0.4, 0.0)
        w[k] = 0.6 * w[k - 1] + acts
    y = w + rng.uniform(-BOUND, BOUND, 400)
    data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    return diagnose(OutputError(stable=True), data, BOUND, effects=["input_dead_zone", "sensor_bias"], workers=1)


def test_the_truth_lies_in_the_certified_interval_of_the_dead_zone(found):
    (cause,) = prove_parameters(found, BOUND, 40).causes
    ends = {p.name: p for p in cause.parameters}
    assert all(p.proven for p in cause.parameters)
    (threshold,) = ends.values()
    assert threshold.lower <= 0.4 <= threshold.upper
    assert threshold.upper - threshold.lower < 0.02  # the null value is far out: that there is a dead zone is proven
    assert "(proven)" in str(threshold)
