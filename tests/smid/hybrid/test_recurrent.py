"""A recurrent network: single neurons are fed back, and learn a plant with a nonlinear input and one state."""

import numpy as np
import pytest

from smid.data import Dataset
from smid.hybrid import estimate, recurrent
from smid.models import ModelError, Reactor, simulate
from smid.validation import validate

WHITE = Reactor(2.0, sampling_time=1.0)


def record(seed):
    u, y = np.repeat(np.random.default_rng(seed).uniform(0.1, 0.9, 60), 5), np.zeros(300)
    for k in range(1, 300):
        y[k] = 0.8 * y[k - 1] + 0.2 * np.tanh(2 * u[k])
    return Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)


def test_the_model_is_the_network_by_hand():
    model = recurrent(WHITE, 2).model
    values = dict(zip((p.name for p in model.parameters), np.linspace(-0.9, 0.8, 11).tolist(), strict=True))
    u = record(0).values("u")
    found = simulate(model.with_values(values), {"u": u}, n=300)["hybrid"]
    weights = list(values.values())
    rows, state, expected = np.reshape(weights[:8], (2, 4)), np.zeros(2), []
    for sample in u:
        state = np.tanh(rows[:, 0] * sample + rows[:, 1:3] @ state + rows[:, 3])
        expected.append(np.dot(weights[8:10], state) + weights[10])
    np.testing.assert_allclose(found[200:], expected[200:], atol=1e-12)


def test_two_neurons_learn_a_plant_and_hold_on_another_record():
    found = estimate(recurrent(WHITE, 2), record(0), starts=4, iterations=60, seed=1)
    (score,) = validate(found.model, record(5)).scores
    assert score.fit_percent > 99


@pytest.mark.parametrize(("neurons", "kind"), [(0, "tanh"), (2, "radial")])
def test_what_is_no_recurrent_network_is_refused(neurons, kind):
    with pytest.raises(ModelError, match="give one or more neurons of a kind that reads a weighted sum"):
        recurrent(WHITE, neurons, neuron=kind)
