"""A network is what its formula says, its derivatives are those of the formula, and scaling folds into the weights."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from smid.data import DataError
from smid.models import ModelError
from smid.networks import Scaling, TanhNetwork, delayed, fold, nguyen_widrow, scaling_of, weight_count

SIZES = st.lists(st.integers(1, 5), min_size=2, max_size=4).map(tuple)


def draw(sizes, seed, n=7, lead=()):
    generator = np.random.default_rng(seed)
    weights = generator.normal(size=(*lead, weight_count(sizes)))
    return TanhNetwork(sizes, weights), generator.normal(size=(n, sizes[0]))


def by_hand(network, sample):
    """Neuron by neuron, from the vector of weights, with neither matrices nor the network's own layout code."""
    weights, signal = iter(network.weights.tolist()), sample.tolist()
    for m in network.sizes[1:]:
        rows = [[next(weights) for _ in signal] for _ in range(m)]
        signal = [float(np.tanh(np.dot(row, signal) + next(weights))) for row in rows]
    return np.dot([next(weights) for _ in signal], signal) + next(weights)


@given(SIZES, st.integers(0, 10**6))
def test_the_network_is_its_formula(sizes, seed):
    network, inputs = draw(sizes, seed)
    expected = [by_hand(network, sample) for sample in inputs]
    np.testing.assert_allclose(network(inputs), expected, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(network.linearise(inputs).outputs, expected, rtol=1e-10, atol=1e-12)


@given(SIZES, st.integers(0, 10**6))
def test_jacobians_agree_with_finite_differences(sizes, seed):
    network, inputs = draw(sizes, seed)
    part, step = network.linearise(inputs), 1e-6
    for k, e in enumerate(step * np.eye(network.weights.size)):
        up, down = TanhNetwork(sizes, network.weights + e), TanhNetwork(sizes, network.weights - e)
        np.testing.assert_allclose(part.by_weights[:, k], (up(inputs) - down(inputs)) / (2 * step), atol=1e-7)
    for k, e in enumerate(step * np.eye(sizes[0])):
        slope = (network(inputs + e) - network(inputs - e)) / (2 * step)
        np.testing.assert_allclose(part.by_inputs[:, k], slope, atol=1e-7)


@given(st.integers(1, 4), st.integers(1, 6), st.integers(0, 10**6))
def test_one_layer_has_the_jacobian_of_the_thesis(k, m, seed):
    # (5.2)-(5.5) differentiated by hand: an independent formula.
    network, inputs = draw((k, m), seed)
    (matrix, bias), (output, _) = network.layers()
    part = network.linearise(inputs)
    for sample, row, slope in zip(inputs, part.by_weights, part.by_inputs, strict=True):
        y = np.tanh(matrix @ sample + bias)
        inner = output[0] * (1 - y**2)
        np.testing.assert_allclose(row, np.concatenate([np.outer(inner, sample).ravel(), inner, y, [1]]), atol=1e-12)
        np.testing.assert_allclose(slope, matrix.T @ inner, atol=1e-12)


@given(SIZES, st.integers(0, 10**6))
def test_leading_axes_are_networks_side_by_side(sizes, seed):
    networks, inputs = draw(sizes, seed, lead=(2, 3))
    part = networks.linearise(inputs)
    for i, j in itertools.product(range(2), range(3)):
        one = TanhNetwork(sizes, networks.weights[i, j])
        np.testing.assert_array_equal(networks(inputs)[i, j], one(inputs))
        np.testing.assert_allclose(part.by_weights[i, j], one.linearise(inputs).by_weights, atol=1e-12)
        np.testing.assert_allclose(part.by_inputs[i, j], one.linearise(inputs).by_inputs, atol=1e-12)


@settings(max_examples=20)
@given(SIZES, st.integers(0, 10**6), st.integers(1, 300))
def test_an_output_does_not_depend_on_its_neighbours(sizes, seed, n):
    network, inputs = draw(sizes, seed, n)
    one_by_one = [network(inputs[k : k + 1])[0] for k in range(n)]
    assert network(inputs).tolist() == one_by_one


def test_the_thesis_counts():
    assert weight_count((4, 10)) == 61
    assert weight_count((1, 10)) == 31
    assert weight_count((4, 10, 5)) == 50 + 55 + 6


@given(SIZES, st.integers(0, 10**6))
def test_scaling_folds_into_the_weights(sizes, seed):
    network, _ = draw(sizes, seed)
    generator = np.random.default_rng(seed)
    samples = generator.normal(5.0, 3.0, (20, sizes[0]))
    inputs, output = scaling_of(samples, ["x"] * sizes[0]), Scaling(np.array([4.0]), np.array([0.5]))
    np.testing.assert_allclose(np.abs(inputs.apply(samples)).max(axis=0), 1.0)
    folded = fold(network, inputs, output)(samples)
    np.testing.assert_allclose(folded, 4.0 + 0.5 * network(inputs.apply(samples)), rtol=1e-9, atol=1e-9)


def test_a_dictionary_makes_the_same_network():
    network, inputs = draw((3, 4, 2), 1)
    again = TanhNetwork.from_dict(network.to_dict())
    assert again.sizes == network.sizes
    np.testing.assert_array_equal(again(inputs), network(inputs))
    with pytest.raises(ValueError, match="read-only"):
        again.weights[0] = 1.0


def test_nguyen_widrow_spreads_the_neurons():
    network = nguyen_widrow((1, 40), seed=3)
    (matrix, bias), _ = network.layers()
    np.testing.assert_allclose(np.abs(matrix), 0.7 * 40)
    # Each neuron is steep where its argument is zero; these places cover the range of the inputs.
    places = np.sort((-bias / matrix[:, 0])[np.abs(bias / matrix[:, 0]) <= 1])
    assert places.size == 40
    assert np.diff(places).max() < 0.4
    np.testing.assert_array_equal(network.weights, nguyen_widrow((1, 40), seed=3).weights)


def test_delay_lines():
    signal = np.arange(5.0)
    np.testing.assert_array_equal(delayed([signal], [(0, 2)])[:, 1], [0, 0, 0, 1, 2])
    with pytest.raises(DataError, match="future samples"):
        delayed([signal], [(-1,)])
    with pytest.raises(DataError, match="same instants"):
        delayed([signal, signal[1:]], [(1,), (1,)])


@pytest.mark.parametrize(
    ("sizes", "count", "message"),
    [((3,), 4, "neurons of each hidden layer"), ((3, 0), 4, "neurons of each"), ((3, 2), 10, "give 11 along")],
)
def test_wrong_sizes(sizes, count, message):
    with pytest.raises(ModelError, match=message):
        TanhNetwork(sizes, np.zeros(count))


def test_wrong_inputs():
    network, _ = draw((3, 2), 1)
    with pytest.raises(ModelError, match="3 columns"):
        network(np.zeros((4, 2)))
    with pytest.raises(DataError, match="height is 2 in every sample"):
        scaling_of(np.full((4, 1), 2.0), ["height"])
