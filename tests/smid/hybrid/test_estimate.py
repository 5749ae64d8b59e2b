"""Estimates keep the boxes, scale by themselves, tell what limits them, and take networks in several places."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from smid.data import Dataset
from smid.hybrid import (
    EXTRA,
    STATIC,
    BackCouplings,
    StalledFitWarning,
    embedded,
    estimate,
    network_of,
    network_only,
    network_output,
    parallel,
    prune,
    series,
    upstream,
    with_network,
)
from smid.models import ModelError, OwnModel, Reactor, signal, simulate, t
from smid.networks import Iterate, TanhNetwork, gauss_newton, gradient_descent, levenberg_marquardt, weight_count
from tests.smid.hybrid.unknown_laws import LAWS, SHOWN, tank_model, tank_record

N = 160


def steps(seed=1, n=N, low=0.1, high=0.9):
    return np.repeat(np.random.default_rng(seed).uniform(low, high, n // 8), 8)


def record(y, u, noise=1e-3, **channels):
    noisy = y + noise * np.random.default_rng(9).standard_normal(len(y))
    return Dataset.from_arrays(input={"u": u, **channels}, output={"y": noisy}, sampling_time=1.0)


def lag(tau, u, first=0.3, outflow=lambda w: w, into=lambda u: u):
    """Return a lag by fine Euler steps, which is no integrator of smid."""
    w, found = first, [first]
    for held in u[:-1]:
        for _ in range(200):
            w += (into(held) - outflow(w)) / tau / 200
        found.append(w)
    return np.array(found)


def first_order(**box):
    return OwnModel(["d/dt w = (u - w) / tau"], {"y": "w"}, ["u"], {"tau": (0.5, 20.0), **box})


@pytest.mark.parametrize("method", [levenberg_marquardt, gauss_newton, gradient_descent])
def test_a_parameter_at_an_end_of_its_box_stops_no_descent(method):
    u = steps()
    data = record(lag(3.0, u, outflow=lambda w: w + w**2), u)
    found, held = (
        estimate(
            embedded(first_order(tau=box), {"w": -1}, [signal("w")[t]], (2,)), data, method=method, starts=1, seed=1
        )
        for box in ((4.0, 20.0), (4.0, 4.0))
    )
    assert found.model.values["tau"] == pytest.approx(4.0, rel=1e-6)
    assert any("tau = 4 lies at an end of its box" in note for note in found.notes)
    assert found.rmse["y"] < 1.05 * held.rmse["y"]
    for p in found.model.parameters:
        assert p.lower <= found.model.values.get(p.name, p.lower) <= p.upper


def test_a_descent_that_stalls_is_told():
    def stubborn(problem, start):
        yield Iterate(start, problem.error(start))

    u = steps()
    data = record(lag(3.0, u), u)
    hybrid = embedded(first_order(), {"w": 1}, [signal("w")[t]], (1,))
    with pytest.warns(StalledFitWarning, match="stalled"):
        found = estimate(hybrid, data, method=stubborn, starts=1, seed=1)
    assert "stalled" in str(found)


def test_a_law_that_undoes_the_error_of_long_steps_is_told():
    u = steps()
    data = record(lag(0.9, u, outflow=lambda w: w + w**2), u)
    plant = first_order(tau=(0.9, 0.9))
    coarse, fine = (
        estimate(
            embedded(replace(plant, scheme="euler", substeps=n), {"w": -1}, [signal("w")[t]], (2,)),
            data,
            starts=2,
            seed=1,
        )
        for n in (1, 30)
    )
    (note,) = coarse.notes
    assert note.startswith("With half the step of the integration the free run of y moves by 0.0")
    assert coarse.rmse["y"] > 10 * fine.rmse["y"]
    assert fine.notes == ()
    finer = replace(fine.model, substeps=60).simulate(data).outputs[0]["y"]
    moved = np.sqrt(np.mean((finer - fine.model.simulate(data).outputs[0]["y"]) ** 2))
    assert fine.integration["y"] == pytest.approx(moved, rel=0.2)  # the start of the run is another


def test_two_networks_learn_two_laws():
    def loss(x):
        return 180.0 * x

    data = tank_record(loss, 3, n=200)
    hybrid = embedded(tank_model(hidden=(2,)), {"h": -1e-4}, [signal("h")[t]], (2,), name="M")
    free = hybrid.white.bound(k=(0.0, 0.0))  # all of the outflow is to be learned
    hybrid = type(hybrid)(hybrid.model.bound(k=(0.0, 0.0)), free, hybrid.networks)
    found = estimate(hybrid, data, starts=2, seed=1)
    for name, low, high, law in (("N", 12, 45, loss), ("M", 0.25, 0.33, lambda h: 4 * np.sqrt(h))):
        x = np.linspace(low, high, 20)
        term = found.hybrid.network(name)
        np.testing.assert_allclose(network_output(found.model, term, x[:, None]), law(x), rtol=0.1)
    with pytest.raises(ModelError, match="networks N, M"):
        _ = found.hybrid.term


@pytest.mark.parametrize("neuron", ["tanh", "logistic", "radial"])
def test_a_network_before_the_model_learns_the_curve_of_the_input(neuron):
    u = steps()
    data = record(lag(3.0, u, into=lambda u: u**2), u)
    hybrid = upstream(first_order(tau=3.0), STATIC, (4,), neuron=neuron)
    found = estimate(hybrid, data, starts=2, seed=1)
    assert found.rmse["y"] < 0.002
    x = np.linspace(0.2, 0.85, 20)
    learned = x + network_output(found.model, found.hybrid.term, x[:, None])
    np.testing.assert_allclose(learned, x**2, atol=0.02)


def test_a_network_alone_is_a_baseline():
    u = steps()
    data = record(lag(3.0, u, outflow=lambda w: w + w**2), u)
    used = [np.arange(N) < 80]
    alone = estimate(network_only(first_order(), BackCouplings(1, 1), (2,)), data, used, starts=2, seed=1)
    inside = estimate(embedded(first_order(), {"w": -1}, [signal("w")[t]], (2,)), data, used, starts=2, seed=1)
    later = [float(np.std(one.fit.residual(data, "y")[0][80:])) for one in (alone, inside)]
    assert later[1] < later[0] < 0.1


def test_networks_correct_two_outputs():
    data = tank_record(LAWS["proportional + quadratic_drag"], 3, n=200)
    tank = tank_model().white.bound(k=(3e-5, 3e-5))
    both = parallel(parallel(tank, EXTRA, output="level"), EXTRA, output="temp", name="M")
    found = estimate(both, data, starts=1, iterations=30, seed=1)
    assert [placed.topology for placed in both.networks] == ["parallel", "parallel"]
    for channel, share in zip(SHOWN, (0.5, 0.5), strict=True):
        assert found.rmse[channel] < share * np.std(data.values(channel))
    stacked = series(both, STATIC, (), output="temp", name="S")
    assert stacked.model.output_channels == ("level", "temp")


def test_early_stopping_judges_on_the_last_samples():
    u = steps()
    data = record(lag(3.0, u, outflow=lambda w: w + w**2), u, noise=0.02)
    hybrid = embedded(first_order(), {"w": -1}, [signal("w")[t]], (4,))
    found = estimate(hybrid, data, starts=1, validation=0.25, seed=1)
    best = found.search.descents[found.search.winner]
    assert best.validation.shape == best.training.shape
    assert not np.allclose(best.validation, best.training)
    assert best.best == best.validation.min()


def test_the_penalty_from_the_data_keeps_noise_out_of_the_law():
    loss, x, errors = LAWS["power_law"], np.linspace(12.0, 45.0, 40), {None: [], 0.0: []}
    for seed, penalty in itertools.product((3, 4, 5), errors):
        data = tank_record(loss, seed, n=240, noise=(3e-3, 0.2), outputs=("temp",))
        found = estimate(tank_model(("temp",), (6,)), data, starts=1, regularisation=penalty, seed=1)
        learned = network_output(found.model, found.hybrid.term, x[:, None])
        errors[penalty].append(float(np.sqrt(np.mean((learned / loss(x) - 1.0) ** 2))))
    assert max(errors[None]) < 0.04
    assert max(errors[None]) < 0.5 * max(errors[0.0])


def test_neurons_that_are_not_needed_are_taken_away():
    u = steps()
    data = record(lag(3.0, u, outflow=lambda w: w + w**2), u)
    large = estimate(embedded(first_order(tau=3.0), {"w": -1 / 3.0}, [signal("w")[t]], (3,)), data, starts=1, seed=1)
    small = prune(large, starts=1, seed=1)
    assert 1 <= sum(small.hybrid.term.hidden) <= 2
    assert small.rmse["y"] < 1.1 * large.rmse["y"]


def test_a_scaled_network_is_the_network_in_the_units_of_the_channels():
    u = steps()
    hybrid = parallel(Reactor(3.0, sampling_time=1.0), EXTRA, (2,))
    found = estimate(hybrid, record(lag(3.0, u) + 5.0, u), starts=1, iterations=3, seed=1)
    term = found.hybrid.term
    assert term.unit != 1.0
    assert max(term.half_range) < 1.0
    generator = np.random.default_rng(2)
    network = TanhNetwork(term.sizes, 0.1 * generator.normal(size=weight_count(term.sizes)))
    runs = [
        simulate(with_network(model, one, network), {"u": u}, initial={"w": [0.3], "hybrid": [0.3]})["y"]
        for model, one in ((found.model, term), (hybrid.model, hybrid.term))
    ]
    np.testing.assert_allclose(*runs, rtol=1e-9, atol=1e-12)
    back = network_of(with_network(found.model, term, network), term)
    np.testing.assert_allclose(back.weights, network.weights, atol=1e-12)


@pytest.mark.parametrize(
    ("options", "message"),
    [({"regularisation": -1.0}, "regularisation = -1"), ({"validation": 0.9}, "validation = 0.9")],
)
def test_options_that_mean_nothing_are_refused(options, message):
    hybrid = embedded(first_order(), {"w": 1}, [signal("w")[t]], (1,))
    with pytest.raises(ModelError, match=message):
        estimate(hybrid, record(steps(), steps()), seed=1, **options)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: upstream(first_order(), input="v"), "name one of u"),
        (lambda: embedded(first_order(), {"w": 1}, [signal("w")[t]], (1,), neuron="sine"), "sine"),
        (lambda: embedded(first_order(), {"w": 1}, [signal("w")[t]], (2, 2), neuron="radial"), "give one layer"),
    ],
)
def test_networks_that_cannot_be_built_are_refused(make, message):
    with pytest.raises(ModelError, match=message):
        make()


def test_the_scale_of_an_output_is_its_weight():
    """Two outputs show lags of 2 s and 4 s: the one of the smaller scale decides."""
    u = steps()
    data = Dataset.from_arrays(input={"u": u}, output={"a": lag(2.0, u), "b": lag(4.0, u)}, sampling_time=1.0)
    white = OwnModel(["d/dt w = (u - w) / tau"], {"a": "w", "b": "w"}, ["u"], {"tau": (0.5, 20.0)}, values={"tau": 3.0})
    hybrid = embedded(white, {"w": 0.01}, [signal("w")[t]], ())
    for channel, other, tau in (("a", "b", 2.0), ("b", "a", 4.0)):
        found = estimate(hybrid, data, starts=1, scale={channel: 1e-3, other: 1.0}, seed=1)
        assert found.model.values["tau"] == pytest.approx(tau, rel=0.05)
        assert found.rmse[channel] < 0.05 * found.rmse[other]
    with pytest.raises(ModelError, match="give a positive number for each of a, b"):
        estimate(hybrid, data, scale={"a": 1.0}, seed=1)


def test_a_known_function_constrains_the_output_of_a_network():
    """The network has a line of its own; the outflow is its exponential, so it cannot turn negative."""
    u = steps()
    data = record(lag(3.0, u, outflow=lambda w: w * (1 + 0.5 * w)), u)
    white = OwnModel(["z = 0*u", "d/dt w = (u - exp(z)*w) / 3"], {"y": "w"}, ["u"])
    found = estimate(embedded(white, {"z": 1}, [signal("w")[t]], (2,)), data, starts=1, seed=1)
    w = np.linspace(found.trained[0].lower, found.trained[0].upper, 20)
    np.testing.assert_allclose(
        np.exp(network_output(found.model, found.hybrid.term, w[:, None])), 1 + 0.5 * w, rtol=0.03
    )
