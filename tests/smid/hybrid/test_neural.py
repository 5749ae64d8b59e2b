"""A network in a model's lines is the network."""

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from smid.data import Dataset
from smid.fitting.problem import Fitting
from smid.hybrid import EXTRA, NeuralTerm, network_of, series, with_network
from smid.hybrid.neural import network_output
from smid.models import ModelError, OutputError, Reactor, signal, simulate, t
from smid.networks import TanhNetwork, weight_count

U = signal("u")


@settings(max_examples=15, deadline=None)
@given(inputs=st.integers(1, 3), hidden=st.lists(st.integers(1, 3), min_size=1, max_size=2), seed=st.integers(0, 10**6))
def test_the_expression_is_the_network(inputs, hidden, seed):
    term = NeuralTerm("N", tuple(U[t - k] for k in range(inputs)), tuple(hidden))
    generator = np.random.default_rng(seed)
    network = TanhNetwork(term.sizes, generator.normal(size=weight_count(term.sizes)))
    values = generator.normal(size=inputs)
    numbers = dict(zip([p.symbol for p in term.parameters], network.weights.tolist(), strict=True))
    numbers |= dict(zip(term.inputs, values.tolist(), strict=True))
    assert float(term.expression.xreplace(numbers)) == pytest.approx(network([values])[0], rel=1e-12, abs=1e-12)


def test_without_hidden_layers_it_is_affine():
    term = NeuralTerm("N", (U[t], U[t - 1]), ())
    w1, w2, b = (p.symbol for p in term.parameters)
    assert sympy.expand(term.expression - (w1 * U[t] + w2 * U[t - 1] + b)) == 0


def test_a_network_comes_back_from_its_model():
    term = NeuralTerm("N", (U[t],), (2,))
    model = OutputError().with_parameter(*term.parameters).add_term("w", term.expression)
    network = TanhNetwork(term.sizes, np.arange(7.0))
    assert network_of(with_network(model, term, network), term).weights.tolist() == list(range(7))


def test_sensitivities_through_a_fed_back_network_agree_with_differences():
    hybrid = series(Reactor(2.0, sampling_time=1.0), EXTRA, (2,))
    generator = np.random.default_rng(3)
    u = generator.uniform(0.1, 0.9, 60)
    data = Dataset.from_arrays(input={"u": u}, output={"y": u}, sampling_time=1.0)
    fitting = Fitting(hybrid.model, data, [np.ones(60, bool)])
    values = {p.name: float(generator.normal(0, 0.5)) for p in hybrid.term.parameters}
    vector = fitting.start(values)
    step = 1e-6
    differences = [
        (fitting.residual(vector + step * e) - fitting.residual(vector - step * e)) / (2 * step)
        for e in np.eye(vector.size)
    ]
    assert vector.size == 13  # eleven weights, and what both signals were before
    np.testing.assert_allclose(fitting.jacobian(vector), np.transpose(differences), atol=1e-6)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: NeuralTerm("N", (), (1,)), "give at least one input"),
        (lambda: NeuralTerm("N", (U[t],), (0,)), "at least one neuron"),
        (lambda: NeuralTerm("N", (U[t],), (1,), limit=0.0), "limit = 0"),
    ],
)
def test_what_is_no_network_is_refused(make, message):
    with pytest.raises(ModelError, match=message):
        make()


def test_weights_that_do_not_fit_are_refused():
    term = NeuralTerm("N", (U[t],), (1,), limit=10.0)
    model = OutputError().with_parameter(*term.parameters).add_term("w", term.expression)
    with pytest.raises(ModelError, match="no value for N_w1_1_1"):
        network_of(model, term)
    with pytest.raises(ModelError, match="give one network of these sizes"):
        with_network(model, term, TanhNetwork((2, 1), np.zeros(5)))
    with pytest.raises(ModelError, match="beyond the limit 10"):
        with_network(model, term, TanhNetwork((1, 1), np.array([11.0, 0, 0, 0])))


def test_a_run_that_leaves_the_finite_range_names_the_sample():
    hybrid = series(Reactor(2.0, sampling_time=1.0), EXTRA, ())
    model = hybrid.model.with_values(
        dict(zip((p.name for p in hybrid.term.parameters), (1.0, 0.0, 99.0, 0.0), strict=True))
    )
    with pytest.raises(ModelError, match="sample"):
        simulate(model, {"u": np.ones(400)}, initial={"w": [1.0], "hybrid": [1.0]})


@pytest.mark.parametrize(
    ("kind", "expected"),
    [
        ("linear", lambda z: z),
        ("relu", lambda z: np.maximum(z, 0.0)),
        ("softplus", lambda z: np.logaddexp(0.0, z)),
        ("logistic", lambda z: 0.5 * (1.0 + np.tanh(0.5 * z))),
    ],
)
def test_activations_of_the_clutch_thesis(kind, expected):
    term = NeuralTerm("N", (U[t],), (1,), neuron=kind)
    model = OutputError().with_parameter(*term.parameters).add_term("w", term.expression)
    values = {"N_w1_1_1": 2.0, "N_b1_1": -1.0, "N_w2_1_1": 1.0, "N_b2_1": 0.0}
    u = np.array([-1e3, -2.0, 0.5, 0.7, 1e3])
    found = network_output(model.with_values(values), term, u[:, None])
    np.testing.assert_allclose(found, expected(2.0 * u - 1.0), rtol=1e-14, atol=1e-15)


@pytest.mark.parametrize(("kind", "smooth"), [("step", "logistic"), ("bipolar", "tanh")])
def test_neurons_without_slope_are_refused(kind, smooth):
    with pytest.raises(ModelError, match=f"{kind} neurons have slope zero.*take {smooth}"):
        NeuralTerm("N", (U[t],), (1,), neuron=kind)
