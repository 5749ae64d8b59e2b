"""The full balances and the cooled reactor, beside what is known of them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from smid.data import DataError, Dataset
from smid.models import ModelError, simulate
from smid.theses.hybrid import (
    FULL_REACTOR,
    Mismatch,
    full_reactor,
    reactor_plant,
    simulate_full_reactor,
    simulate_reactor,
)
from smid.theses.hybrid.cooled_reactor import arrhenius, cooled_reactor
from smid.theses.hybrid.plants import MISMATCHES

FLOW = FULL_REACTOR["F0"][0]
RECORD = Path(__file__).resolve().parents[5] / "shared" / "data" / "daisy_cstr" / "cstr.dat"


@pytest.mark.parametrize("mismatch", [name for name in MISMATCHES if name != "sine"])
def test_a_plant_as_a_model_runs_as_the_plant(mismatch):
    u = np.random.default_rng(1).uniform(0.2, 0.9, 30)
    model = replace(reactor_plant(mismatch), sampling_time=1.0, substeps=10)
    states = [line.signal for line in model.lines if line.rate]
    run = simulate(model, {"u": u}, initial={name: u[:1] for name in states})
    np.testing.assert_allclose(run["y"], simulate_reactor(mismatch, u, 1.0), atol=1e-5)


def test_the_full_balances_run_as_their_model():
    generator = np.random.default_rng(2)
    u, flow = generator.uniform(0.1, 0.9, 40), generator.uniform(0.3, 0.5, 40)
    model = replace(full_reactor(), sampling_time=1.0, substeps=4)
    run = simulate(model, {"u": u, "F": flow}, initial={"V": [1.0], "c": u[:1], "T": [300.0]})
    np.testing.assert_allclose(run["y"], simulate_full_reactor(u, 1.0, flow), atol=1e-6)


def test_at_rest_no_mass_is_lost():
    u = simulate_full_reactor(np.full(3, 0.6), 500.0)[-1]
    v0, f0, r0, t0, e, h, k = (value for value, _ in FULL_REACTOR.values())
    reacting = f0 * (0.6 - u)  # what comes in and does not leave
    temperature = t0 + h * reacting / (f0 + k)
    assert reacting == pytest.approx(r0 * np.exp(-e * (1 / temperature - 1 / t0)) * u * v0, rel=1e-6)


def test_cold_it_is_the_reactor_of_the_thesis():
    # So little that it does not warm up: then the first order model with tau = 2 holds.
    u = 1e-4 * np.random.default_rng(3).uniform(0.2, 0.9, 30)
    np.testing.assert_allclose(simulate_full_reactor(u, 1.0), simulate_reactor(Mismatch(), u, 1.0), rtol=1e-3)


@pytest.mark.parametrize(
    ("u", "sampling_time", "flow", "message"),
    [
        ([-0.1, 0.2], 1.0, None, "the input"),
        ([0.1, np.nan], 1.0, None, "the input"),
        ([0.1, 0.2], 1.0, [0.0, 0.1], "the flow"),
        ([0.1, 0.2], 0.0, None, "sampling_time = 0"),
    ],
)
def test_what_cannot_be_simulated_is_refused(u, sampling_time, flow, message):
    with pytest.raises(DataError, match=message):
        simulate_full_reactor(u, sampling_time, flow)


def test_an_unknown_plant_is_refused():
    with pytest.raises(ModelError, match="mismatch"):
        reactor_plant("nothing")


def test_the_cooled_reactor_rests_where_its_balances_say():
    model = replace(cooled_reactor(known_rate=True), sampling_time=6.0)
    run = simulate(model, {"q": np.full(3000, 100.0)}, initial={"c": [0.1], "theta": [438.5]})
    c, theta = run["c"][-1], run["theta"][-1]
    assert c == pytest.approx(1.0 / (1.0 + 60.0 * float(arrhenius(theta))), rel=1e-6)
    cooling = 0.01 * 100.0 * (1.0 - np.exp(-7.0)) * (350.0 - theta)
    assert 350.0 - theta + 200.0 * (1.0 - c) + cooling == pytest.approx(0.0, abs=1e-4)


@pytest.mark.skipif(not RECORD.is_file(), reason="no measured record at ../shared/data/daisy_cstr/cstr.dat")
def test_the_cooled_reactor_is_the_record_of_daisy():
    columns = np.loadtxt(RECORD)[:1500]
    data = Dataset.from_arrays(
        input={"q": columns[:, 1]}, output={"Ca": columns[:, 2], "T": columns[:, 3]}, sampling_time=6.0
    )
    first = {"c": columns[:1, 2], "theta": columns[:1, 3]}
    run = cooled_reactor(known_rate=True).simulate(data, initial=first).outputs[0]
    assert np.std(run["Ca"] - columns[:, 2]) < 0.05 * np.std(columns[:, 2])
    assert np.std(run["T"] - columns[:, 3]) < 0.05 * np.std(columns[:, 3])
