"""Training splits, scales, stops early, and refuses what cannot be trained on."""

import numpy as np
import pytest

from smid.data import DataError
from smid.models import ModelError
from smid.networks import Stop, TanhNetwork, gradient_descent, random_split, train


def samples(n=400, seed=1):
    generator = np.random.default_rng(seed)
    x = generator.uniform([-3.0, 100.0], [5.0, 900.0], (n, 2))
    return x, np.tanh(x[:, 0]) + 1e-3 * x[:, 1]


def test_a_network_learns_a_function_in_its_units():
    x, y = samples()
    result = train(x, y, hidden=(5,), seed=2, starts=2)
    assert result.test < 1e-6
    fresh_x, fresh_y = samples(seed=9)
    assert np.abs(result.network(fresh_x) - fresh_y).max() < 0.02
    assert "Network 2 - 5 - 1, 21 weights; start" in str(result)


def test_what_made_the_data_is_found_again():
    truth = TanhNetwork((1, 2), np.array([2.0, -1.0, 0.5, 1.0, 1.5, -0.7, 0.3]))
    x = np.linspace(-3, 3, 300)[:, None]
    result = train(x, truth(x), hidden=(2,), seed=5)
    assert result.training < 1e-12


def test_the_same_seed_gives_the_same_network():
    x, y = samples()
    first, again, other = (train(x, y, hidden=(3,), seed=s, starts=2).network.weights for s in (7, 7, 8))
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()


def test_noise_is_not_learned():
    # Eleven samples a weight: without early stopping forty neurons would fit the noise.
    generator = np.random.default_rng(3)
    x = generator.uniform(-1, 1, (240, 1))
    y = np.sin(3 * x[:, 0]) + generator.normal(0, 0.3, 240)
    result = train(x, y, hidden=(40,), seed=3)
    assert result.search.descents[result.search.winner].stop is Stop.VALIDATION
    assert result.test < 0.16
    grid = np.linspace(-0.9, 0.9, 50)
    assert np.sqrt(np.mean((result.network(grid[:, None]) - np.sin(3 * grid)) ** 2)) < 0.2


def test_the_split_is_a_partition():
    split = random_split(1001, seed=4)
    parts = np.concatenate([split.training, split.validation, split.test])
    np.testing.assert_array_equal(np.sort(parts), np.arange(1001))
    assert (split.validation.size, split.test.size) == (150, 150)


def test_progress_and_other_methods():
    x, y = samples(100)
    seen = []
    train(x, y, hidden=(2,), seed=1, starts=2, method=gradient_descent, iterations=5, progress=seen.append)
    assert [(p.start, p.iteration) for p in seen] == [(s, k) for s in range(2) for k in range(6)]


def test_an_interrupted_training_returns_a_network():
    x, y = samples()

    def interrupt(progress):
        if progress.iteration == 4:
            raise KeyboardInterrupt

    result = train(x, y, hidden=(5,), seed=2, progress=interrupt)
    assert [d.stop for d in result.search.descents] == [Stop.INTERRUPTED]
    assert result.training < np.var(y)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda x, y: (np.where(np.arange(len(x))[:, None] == 3, np.nan, x), y), "inputs of sample 3 are not finite"),
        (lambda x, y: (x, np.where(np.arange(len(y)) == 5, np.inf, y)), "targets of sample 5 are not finite"),
        (lambda x, y: (np.column_stack([x[:, 0], np.ones(len(x))]), y), "input 1 is 1 in every sample"),
        (lambda x, y: (x, np.zeros(len(y))), "the target is 0 in every sample"),
        (lambda x, y: (x[:30], y[:30]), "41 weights but 21 training samples of 30"),
        (lambda x, y: (x, y[1:]), "one row and one target a sample"),
    ],
)
def test_bad_data(change, message):
    with pytest.raises(DataError, match=message):
        train(*change(*samples()), seed=1)


@pytest.mark.parametrize("settings", [{"hidden": ()}, {"hidden": (3, 0)}, {"starts": 0}, {"iterations": 0}])
def test_bad_settings(settings):
    with pytest.raises(ModelError):
        train(*samples(), **{"seed": 1, **settings})
