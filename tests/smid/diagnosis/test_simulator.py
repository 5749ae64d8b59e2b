"""Diagnosis of a recorded simulation: the simulator is nonlinear, so no follower is exact."""

import numpy as np
import pytest

from smid import DataError, Dataset, ModelError, OutputError
from smid.diagnosis import EFFECTS, Effect, Site, diagnose, prove_parameters
from smid.diagnosis.effects.check import Case, check_on
from smid.diagnosis.simulator import simulator
from smid.models import simulate
from smid.models.simulated import standalone
from tests.smid.diagnosis.lag_records import BOUND, dead_zone, lag, late, record, steps

EFFECTS_TRIED = ["gain", "input_dead_zone", "input_delay", "input_saturation", "missing_input", "sensor_bias"]


def tank(u: np.ndarray) -> np.ndarray:
    """A lag before a tank whose outflow grows with the cube of the level, from rest, by hand."""
    inflow, level = np.zeros(u.size), np.zeros(u.size)
    for k in range(1, u.size):
        inflow[k] = 0.6 * inflow[k - 1] + 0.4 * u[k - 1]
        level[k] = level[k - 1] + 0.1 * (inflow[k - 1] - level[k - 1] - 0.15 * level[k - 1] ** 3)
    return level


HIDDEN = {
    "sensor_bias": lambda u: tank(u) + 0.15,
    "input_delay": lambda u: tank(late(u, 3)),
    "input_saturation": lambda u: tank(np.clip(u, -1, 1)),
    "input_dead_zone": lambda u: tank(dead_zone(u, 0.6)),
    "gain": lambda u: tank(0.7 * u),
}


def tank_record(seed: int, measured=tank) -> Dataset:
    u = 2 * steps(seed, 400, 8)
    return record(u, measured(u), seed, y_sim=tank(u))


def ask(data: Dataset, effects=EFFECTS_TRIED, **options):
    return diagnose(None, data, BOUND, effects, workers=1, certify=False, **{"simulated": "y_sim", **options})


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("effect", HIDDEN)
def test_an_effect_that_the_simulator_lacks_is_named(effect, seed):
    diagnosis = ask(tank_record(seed, HIDDEN[effect]))
    assert [cause.effect for cause in diagnosis.causes] == [effect]
    assert diagnosis.gain.rmse_after < 0.2 * diagnosis.gain.rmse_before


@pytest.mark.parametrize("seed", range(2))
def test_a_simulation_that_is_right_is_judged_as_recorded(seed):
    data = tank_record(seed)
    diagnosis = ask(data)
    assert (diagnosis.verdict, diagnosis.unexplained) == ("none", False)
    (run,) = data.experiments
    assert np.abs(diagnosis.simulated[0] - run.values["y_sim"])[100:].max() < 0.01 * BOUND
    assert "missing_input" in diagnosis.skipped, "the simulation is no further input"


def test_the_base_model_does_not_depend_on_the_measurement():
    assert simulator(tank_record(0), "y_sim") == simulator(tank_record(0, HIDDEN["gain"]), "y_sim")


def test_the_smallest_follower_is_taken():
    u = steps(0)
    data = record(u, lag(u), y_sim=lag(u), swung=tank(u))
    assert set(simulator(data, "y_sim").values) == {"a1", "b0", "offset"}
    assert set(simulator(data, "swung").values) == {"a1", "a2", "b0", "b1", "offset"}


def test_an_input_that_the_simulator_never_had_is_given_to_the_follower():
    u, new = steps(0), steps(1)
    exact = simulator(record(u, lag(u), y_sim=lag(u)), "y_sim")
    assert np.abs(simulate(standalone(exact), {"u": new})["y"] - lag(new))[5:].max() < 1e-6


@pytest.fixture(scope="module")
def rested() -> Case:
    """Return a simulation whose input rests for longer than any effect looks back."""
    u = 2 * steps(0, 400, 8)
    u[:60] = 0.0
    data = record(u, tank(u), y_sim=tank(u))
    (run,) = data.experiments
    residual = run.values["y"] - run.values["y_sim"]
    return Case("a simulation", simulator(data, "y_sim"), Site(data, "u", "y", (residual,)))


@pytest.mark.parametrize("effect", EFFECTS, ids=[effect.name for effect in EFFECTS])
def test_every_effect_keeps_the_contract_on_a_simulation(effect: Effect, rested: Case):
    check_on(effect, rested)


U = steps(0)
GOOD = record(U, lag(U), y_sim=lag(U), still=np.full(U.size, 2.0))


@pytest.mark.parametrize(
    ("data", "options", "error", "words"),
    [
        (GOOD, {"simulated": "y_sin"}, DataError, ["'y_sin' is not in the data", "'y_sim'"]),
        (GOOD, {"simulated": "still"}, DataError, ["'still' is 2 at every sample", "record the output"]),
        (GOOD, {"simulated": "y"}, DataError, ["'y' is the input or the measured output"]),
        (GOOD, {"simulated": "u"}, DataError, ["'u' is the input or the measured output"]),
        (GOOD, {"simulated": None}, ModelError, ["give a model, or None and simulated="]),
        (GOOD, {"seconds": 1e-9}, ModelError, ["too short to fit the base model"]),
        (record(U[:8], lag(U[:8]), y_sim=U[:8]), {}, DataError, ["8 samples", "longer record"]),
        (record(np.ones(300), U, y_sim=U), {}, DataError, ["'u' does not excite"]),
        (
            Dataset.from_arrays(input={"u": U}, output={"y": U, "y_sim": U}, sampling_time=0.1),
            {},
            DataError,
            ["the outputs y, y_sim", "one input and the measured output"],
        ),
    ],
)
def test_a_mistake_is_told_with_its_cure(data, options, error, words):
    with pytest.raises(error) as caught:
        ask(data, **options)
    for word in words:
        assert word in str(caught.value)


def test_a_model_and_a_simulation_are_one_too_many():
    with pytest.raises(ModelError, match="a model or of a simulated channel"):
        diagnose(OutputError(), GOOD, simulated="y_sim")


def test_its_intervals_are_not_certified():
    diagnosis = ask(record(U, lag(U) + 0.3, y_sim=lag(U)), ["sensor_bias"])
    with pytest.raises(ModelError, match="only its recorded output is known"):
        prove_parameters(diagnosis, BOUND)
