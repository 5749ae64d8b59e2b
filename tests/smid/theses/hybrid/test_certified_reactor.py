"""Certified intervals of the reactor hold the plant that made the data, for every power and input."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from relaxations.algebra.intervals import Intervals
from smid.data import DataError, Dataset
from smid.models import ModelError
from smid.signals import qprs, qprts
from smid.theses.hybrid import MISMATCHES, Mismatch, simulate_reactor
from smid.theses.hybrid.certified import certify_reactor
from smid.theses.hybrid.certified.reactor import _phi, _problem

R = 0.12


def _record(mismatch, u, noise_bound, seed, h=1.0, start=None):
    y = simulate_reactor(mismatch, u, h, start)
    noise = np.random.default_rng(seed).uniform(-noise_bound, noise_bound, len(u))
    return Dataset.from_arrays(input=u, output=y + noise, sampling_time=h), noise


@settings(max_examples=25, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.floats(0.5, 6.0),
    st.floats(0.3, 4.0),
    st.sampled_from([1, 2, 3]),
    st.sampled_from([0.3, 1.0, 2.0]),
)
def test_the_true_reactor_satisfies_every_relation(seed, tau, a, power, h):
    u = qprs(25, seed=seed, levels=(0.2, 0.4, 0.9), sampling_time=h, periods=(h, 3 * h))
    data, noise = _record(Mismatch(tau=tau, a=a, x=float(power)), u, 0.001, seed, h)
    k, g = 1 / tau, a / tau
    random = np.random.default_rng(seed)
    low, high = random.uniform(0.3, 1.0, 2), random.uniform(1.0, 3.0, 2)
    for box in (
        Intervals(np.array([k, g]) * low, np.array([k, g]) * high),
        Intervals(np.array([k, g]) * 0.999, np.array([k, g]) * 1.001),
    ):
        problem = _problem(u, data.values(data.output), h, 0.001, power, R, box)
        # The plant is integrated with a tolerance of 1e-10.
        assert problem.inequalities.evaluate(np.concatenate([[k, g], noise])).min() >= -1e-8


@given(st.floats(-50, 50))
def test_phi_is_the_mean_of_an_exponential(z):
    times = (np.arange(4000) + 0.5) / 4000
    rate = np.exp(-z * times + min(z, 0))
    mean = float((rate * (1 - times)).sum() / rate.sum())
    low, high = _phi(np.array([z]), -1)[0], _phi(np.array([z]), 1)[0]
    assert low - 1e-4 <= mean <= high + 1e-4
    assert high - low < 1e-8


@pytest.mark.parametrize(("name", "widest"), [("time_constant", 0.02), ("factor", 0.05), ("power", 0.2)])
def test_intervals_hold_the_plants_of_table_2(name, widest):
    plant = MISMATCHES[name]
    for seed in range(3):
        data, _ = _record(plant, qprts(100, seed=seed), 0.003, seed)
        found = certify_reactor(data, 0.003, power=int(plant.x))
        assert found.holds({"tau": plant.tau, "a": plant.a})
        assert found.relative_width("tau") < widest
    assert found.to_dict()["intervals"]["tau"] == list(found.intervals["tau"])
    assert "tau" in str(found)


def test_the_wrong_power_is_proven_wrong():
    data, _ = _record("power", qprts(150, seed=1), 0.002, 1)
    with pytest.raises(DataError, match="no reactor of power 1"):
        certify_reactor(data, 0.002, power=1)


def test_bad_input_is_refused():
    data, _ = _record("factor", qprts(30, seed=1), 0.002, 1)
    with pytest.raises(ModelError, match="whole number"):
        certify_reactor(data, 0.002, power=0)
    with pytest.raises(ModelError, match="makes no sense"):
        certify_reactor(data, 0.002, prior={"tau": (3.0, 1.0)})
    with pytest.raises(ModelError, match="constant of the reactor"):
        certify_reactor(data, 0.002, prior={"volume": (1.0, 3.0)})
    with pytest.raises(DataError, match="positive number"):
        certify_reactor(data, -0.002)
    with pytest.raises(DataError, match="fewer than 5 samples"):
        certify_reactor(data.crop(stop=4), 0.002)
    with pytest.raises(DataError, match="cannot be told from zero"):
        certify_reactor(data, 0.3, power=2)
