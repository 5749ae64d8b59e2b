"""Certified intervals of the reactor's differential equation hold the plant that made the data, from a wide prior."""

import numpy as np
import pytest

from smid import Dataset, EmptyFeasibleSetError, identify
from smid.models import Reactor
from smid.signals import qprts
from smid.theses.hybrid import MISMATCHES, simulate_reactor


def _record(name, n, noise_bound, seed):
    u = qprts(n, seed=seed)
    noise = np.random.default_rng(seed).uniform(-noise_bound, noise_bound, n)
    return Dataset.from_arrays(input=u, output=simulate_reactor(name, u, 1.0) + noise, sampling_time=1.0)


@pytest.mark.parametrize(("name", "widest"), [("time_constant", 0.01), ("factor", 0.03), ("power", 0.03)])
def test_intervals_hold_the_plants_of_table_2(name, widest):
    plant = MISMATCHES[name]
    model = Reactor(None, None, plant.x, scheme="enclosed", substeps=1 if plant.x == 1 else 5)
    for seed in range(2):
        found = identify(model, _record(name, 100, 0.003, seed), 0.003, tolerance=0.5)
        assert found["tau"].lower <= plant.tau <= found["tau"].upper
        assert found["a"].lower <= plant.a <= found["a"].upper
        assert found["tau"].width < widest * plant.tau


def test_the_wrong_power_is_proven_wrong():
    with pytest.raises(EmptyFeasibleSetError, match="proven: no parameters"):
        identify(Reactor(None, None, scheme="enclosed"), _record("power", 150, 0.002, 1), 0.002)
