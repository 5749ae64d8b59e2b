"""The topologies run as they are drawn, and their estimates come to what is known."""

import numpy as np
import pytest

from smid.data import DataError, Dataset
from smid.hybrid import (
    EXTRA,
    SIMPLE,
    BackCouplings,
    estimate,
    learned_response,
    network_of,
    parallel,
    series,
    simultaneous,
    with_network,
)
from smid.models import Line, Measurement, Model, ModelError, Parameter, Reactor, predict, signal, simulate, t
from smid.networks import TanhNetwork, gauss_newton, gradient_descent, weight_count
from smid.theses.hybrid.reactor import reactor_record, white_reactor
from smid.theses.hybrid.reactor.time_constant import balance_with_network

TAU = 3.0


def white_samples(u, first):
    """The white reactor's samples by hand, exactly."""
    w, decay, gain = [first], np.exp(-1.0 / TAU), 1.0 - 0.12 * TAU
    for held in u[:-1]:
        w.append(decay * w[-1] + (1 - decay) * gain * held)
    return np.array(w)


def drawn(join, seed):
    hybrid = join(Reactor(TAU, sampling_time=1.0, substeps=8), EXTRA, (2,))
    generator = np.random.default_rng(seed)
    network = TanhNetwork(hybrid.term.sizes, 0.5 * generator.normal(size=weight_count(hybrid.term.sizes)))
    return with_network(hybrid.model, hybrid.term, network), network, generator.uniform(0.1, 0.9, 40)


@pytest.mark.parametrize("measured", [False, True], ids=["simulator", "predictor"])
@pytest.mark.parametrize("seed", [1, 2])
def test_series_is_the_loop_that_is_drawn(seed, measured):
    model, network, u = drawn(series, seed)
    w, y = white_samples(u, 0.0 if measured else u[0]), np.random.default_rng(9).uniform(0.1, 0.9, 40)
    z = [y[0]]
    for k in range(1, 40):
        z.append(float(network([[w[k], w[k - 1], y[k - 1] if measured else z[-1]]])[0]))
    found = run(model, u, w[0], y, measured)
    np.testing.assert_allclose(found[2:], z[2:], atol=1e-6)


@pytest.mark.parametrize("measured", [False, True], ids=["simulator", "predictor"])
@pytest.mark.parametrize("seed", [1, 2])
def test_parallel_is_the_loop_that_is_drawn(seed, measured):
    model, network, u = drawn(parallel, seed)
    w, y = white_samples(u, 0.0 if measured else u[0]), np.random.default_rng(9).uniform(0.1, 0.9, 40)
    z = [y[0]]
    for k in range(1, 40):
        before = (y[k - 1] if measured else z[-1]) - w[k - 1]
        z.append(w[k] + float(network([[u[k], u[k - 1], before]])[0]))
    found = run(model, u, w[0], y, measured)
    np.testing.assert_allclose(found[2:], z[2:], atol=1e-6)


def run(model: Model, u, first, y, measured):
    if measured:  # what is not measured starts at rest
        return predict(model, {"u": u, "y": y})["y"]
    return simulate(model, {"u": u}, initial={"w": [first], "hybrid": y[:1]})["y"]


def test_tau_goes_from_four_to_two_with_a_static_network_in_the_balance():
    base = white_reactor("time_constant_and_factor")
    hybrid = balance_with_network(base.bound(tau=(0.5, 8.0)).with_values({"tau": 4.0}))
    found = estimate(hybrid, reactor_record("time_constant_and_factor"), starts=1, iterations=40, seed=1)
    assert found.model.values["tau"] == pytest.approx(2.0, rel=0.01)
    # The network gives the y that the model lacks.
    y = np.linspace(0.1, 0.3, 5)
    np.testing.assert_allclose(network_of(found.model, found.hybrid.term)(y[:, None]), y, atol=0.01)
    assert "tau = " in str(found)


def test_a_series_network_with_enough_back_couplings_learns_the_dynamics():
    data = reactor_record("time_constant")
    errors = {}
    for couplings in (SIMPLE, EXTRA):
        hybrid = series(white_reactor("time_constant"), couplings)
        found = estimate(hybrid, data, error="prediction", starts=1, iterations=100, seed=1)
        errors[couplings] = np.sqrt(found.search.descents[0].best)
    assert errors[EXTRA] < 0.05 * errors[SIMPLE]
    response = learned_response(found.hybrid, [0.8769, 0.7044], 30, 0.3)
    assert response[-1] == pytest.approx(0.3 * 0.76 / 0.52, abs=0.01)


def test_gauss_newton_finds_the_affine_network_in_a_step():
    data = reactor_record("factor")
    hybrid = series(white_reactor("factor"), EXTRA, ())
    found = estimate(hybrid, data, error="prediction", method=gauss_newton, starts=1, iterations=3, seed=1)
    assert found.search.descents[0].best < 1e-15
    assert found.fit.cost < 1e-9


def test_gradient_descent_lowers_the_error():
    data = reactor_record("factor")
    hybrid = parallel(white_reactor("factor"), SIMPLE)
    found = estimate(hybrid, data, error="prediction", method=gradient_descent, starts=1, iterations=30, seed=1)
    training = found.search.descents[0].training
    assert training[-1] < 0.5 * training[0]


def test_a_free_run_begins_where_the_prediction_led():
    data = reactor_record("time_constant")
    hybrid = parallel(white_reactor("time_constant"), BackCouplings(2, 2))
    ahead, free = (
        estimate(hybrid, data, error=error, starts=1, iterations=20, seed=1) for error in ("prediction", "simulation")
    )
    assert free.fit.cost < ahead.fit.cost


def test_names_of_the_data_are_taken_over():
    data = reactor_record("time_constant").crop(0, 80).rename({"u": "inflow", "y": "outflow"})
    found = estimate(parallel(white_reactor("time_constant"), SIMPLE), data, starts=1, iterations=2, seed=1)
    assert found.model.channels == ("inflow", "outflow")
    assert "inflow[t]" in str(found.hybrid.term.expression)


def data_of(n):
    u = np.linspace(0.1, 0.9, n)
    return Dataset.from_arrays(input={"u": u}, output={"y": u}, sampling_time=1.0)


def test_more_numbers_than_samples_are_refused():
    with pytest.raises(DataError, match="13 parameters, weights and initial states but 9 samples"):
        estimate(series(Reactor(2.0), EXTRA, (2,)), data_of(9), seed=1)


@pytest.mark.parametrize(
    ("options", "message"),
    [({"error": "both"}, "error"), ({"starts": 0}, "starts = 0"), ({"iterations": 0}, "iterations = 0")],
)
def test_settings_that_mean_nothing_are_refused(options, message):
    with pytest.raises(ModelError, match=message):
        estimate(series(Reactor(2.0), EXTRA), data_of(60), **{"seed": 1, **options})


def test_units_of_channels_do_not_matter():
    u = np.repeat(np.random.default_rng(1).uniform(0.1, 0.9, 12), 10)
    y = white_samples(u, 0.3) ** 2
    errors = []
    for gain, zero, unit in ((1.0, 0.0, 1.0), (1e6, 1e7, 1e-5)):
        w = Parameter("gain", 0.01 / gain, 100.0 / gain)
        line = Line(
            signal("w")[t], (w.symbol * (signal("u")[t] - zero) - signal("w")[t] / unit) * unit / TAU, rate=True
        )
        white = Model("lag", (w,), (line,), (Measurement("y", "w", "eta"),))
        data = Dataset.from_arrays(input={"u": gain * u + zero}, output={"y": unit * y}, sampling_time=1.0)
        hybrid = parallel(white, EXTRA, (2,))
        found = estimate(hybrid, data, starts=1, iterations=60, seed=1)
        errors.append(found.rmse["y"] / np.std(unit * y))
    assert max(errors) < 0.05
    assert errors[1] == pytest.approx(errors[0], rel=1e-4)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: series(Reactor(2.0), EXTRA, output="z"), "name one of y"),
        (lambda: BackCouplings(-1, 0), "inputs = -1"),
        (lambda: simultaneous(Reactor(2.0), {"k": (0, 1)}), "no parameter 'k'"),
        (lambda: balance_with_network(Reactor(2.0), (0,)), "at least one neuron"),
    ],
)
def test_what_cannot_be_joined_is_refused(make, message):
    with pytest.raises(ModelError, match=message):
        make()
