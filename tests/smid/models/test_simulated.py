"""A model around a recorded simulation: the simulator itself, and a plant that an effect changes."""

import numpy as np
import pytest
import sympy

from smid import ModelError, OutputError, Parameter
from smid.models import simulate
from smid.models.simulated import Simulated

VALUES = {"a1": -1.5, "a2": 0.7, "b0": 0.1, "b1": 0.1}
MODEL = Simulated(OutputError(2, 1).with_values(VALUES), "y_sim")


def plant(u: np.ndarray) -> np.ndarray:
    """The difference equation, from rest, by hand."""
    w = np.zeros(u.size)
    for k in range(3, u.size):
        w[k] = 1.5 * w[k - 1] - 0.7 * w[k - 2] + 0.1 * u[k - 1] + 0.1 * u[k - 2]
    return w


def record(seed: int) -> np.ndarray:
    u = np.random.default_rng(seed).uniform(-1, 1, 200)
    u[:3] = 0.0
    return u


def run(model, u, simulated, **values):
    return simulate(model, {"u": u, "y_sim": simulated}, {**VALUES, **values})["y"][4:]


def test_it_is_the_simulator_whatever_that_is():
    u = record(0)
    simulated = np.tanh(plant(u)) + np.sin(0.1 * np.arange(200))
    initial = {"w": simulated}
    y = simulate(MODEL, {"u": u, "y_sim": simulated}, VALUES, initial)["y"]
    assert np.abs(y - simulated)[4:].max() < 1e-12


def test_a_limit_at_the_input_is_the_plants_and_not_the_simulators():
    u = record(1)
    limit = Parameter("limit", 0, 1)
    limited = MODEL.insert_before("u", lambda v: sympy.Min(v, limit.symbol), [limit])
    assert np.abs(run(limited, u, plant(u), limit=0.3) - plant(np.minimum(u, 0.3))[4:]).max() < 1e-12
    assert np.abs(plant(np.minimum(u, 0.3)) - plant(u)).max() > 0.1


def test_what_the_simulator_gives_is_no_part_of_the_plant():
    assert set(MODEL.origins) == {"simulation", "remainder", "u_simulated", *VALUES}
    assert set(MODEL.channels) == {"y_sim", "u", "y"}
    assert all(p.lower == p.upper == VALUES[p.name] for p in MODEL.parameters)


def test_channels_may_have_the_names_of_its_own_signals():
    follower = OutputError(input="remainder", output="w").with_values({"a1": -0.5, "b0": 1.0})
    assert set(Simulated(follower, "simulation").channels) == {"simulation", "remainder", "w"}


def test_a_follower_that_is_not_fitted_is_refused():
    with pytest.raises(ModelError, match="a value for each parameter: fit it first"):
        Simulated(OutputError(), "y_sim")
