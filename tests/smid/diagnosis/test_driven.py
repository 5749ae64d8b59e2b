"""Signals that the inputs drive: what is said to stay on a hold does, for each effect that acts on an input."""

import numpy as np
import pytest

from smid import Dataset
from smid.diagnosis import EFFECTS, Site
from smid.diagnosis.proof.driven import driven_signals
from smid.identification.inversion.record import Record
from smid.models import OutputError, OwnModel, simulate

BOUND = {"y": 0.05}
LAG = OutputError().with_values({"a1": -0.8, "b0": 0.5})
HOLDING = ("hysteresis", "input_backlash")
MOVING = ("rate_limit", "extra_lag", "input_delay")


def steps(seed: int) -> np.ndarray:
    return np.repeat(np.random.default_rng(seed).uniform(-1, 1, 10), 6)


def extensions(names: tuple[str, ...]) -> list:
    u = steps(0)
    data = Dataset.from_arrays(input={"u": u}, output={"y": simulate(LAG, {"u": u})["y"]}, sampling_time=1.0)
    site = Site(data, "u", "y", (np.zeros(60),))
    found = [(e.name, own) for e in EFFECTS if e.name in names for own in e.extend(LAG, site)]
    return [pytest.param(own, id=f"{name} {own.label}") for name, own in found]


def posed(model, u: np.ndarray) -> Record:
    data = Dataset.from_arrays(input={"u": u}, output={"y": np.zeros(len(u))}, sampling_time=1.0)
    record = Record(model, data, BOUND, whole=True)
    return Record(model.bound(**dict.fromkeys(record.loose, (-3.0, 3.0))), data, BOUND, whole=True)


@pytest.mark.parametrize("extension", extensions(HOLDING))
def test_a_signal_stays_on_a_hold_within_the_ends_of_its_number(extension) -> None:
    u, held = steps(1), 0
    found = list(driven_signals(posed(extension.model, u)))
    rng = np.random.default_rng(2)
    for driven in found:
        for _ in range(20):
            values = {p.name: rng.uniform(max(p.lower, -1), min(p.upper, 1)) for p in extension.model.parameters}
            begin = {name: [rng.uniform(-1, 1)] for name in extension.model.states}
            run = simulate(extension.model, {"u": u}, values, begin, check=False)[driven.signal]
            number = driven.samples[0].argmax(axis=1)
            for k, parameter in enumerate(driven.parameters):
                own = run[number == k]
                held += own.size > 1
                assert np.ptp(own) <= 1e-9 * (1 + np.abs(own).max())
                assert parameter.lower - 1e-9 <= own[-1] <= parameter.upper + 1e-9 or k == 0
    at_the_input = "input" in extension.label or "backlash" in str(extension.model.origins.values())
    assert held or not at_the_input


@pytest.mark.parametrize("extension", extensions(MOVING))
def test_what_moves_while_its_input_stays_has_no_numbers(extension) -> None:
    assert not any(driven.parameters for driven in driven_signals(posed(extension.model, steps(1))))


def test_a_difference_is_not_what_it_was_a_sample_ago() -> None:
    model = OwnModel(["v[t] = c*(u[t] - u[t-1])", "w[t] = 0.5*w[t-1] + v[t-1]"], {"y": "w"}, ["u"], {"c": (-1, 1)})
    assert not list(driven_signals(posed(model, steps(1))))
