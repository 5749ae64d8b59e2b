"""The delay of an input: whole or fractional, and what an interval of it leaves of the input."""

import numpy as np
import pytest

from relaxations.algebra.arrays import Array
from smid import Dataset, Model, OutputError, diagnose
from smid.diagnosis import Site
from smid.diagnosis.effects.input_delay import EFFECT
from smid.identification.inversion.record import Record
from smid.models import OwnModel, simulate
from tests.smid.diagnosis.lag_records import steps

LAG = OutputError().with_values({"a1": -0.8, "b0": 0.5})


def delayed(u: Array) -> tuple[Model, Dataset]:
    data = Dataset.from_arrays(input={"u": u}, output={"y": u}, sampling_time=0.1)
    (extension,) = EFFECT.extend(LAG, Site(data, "u", "y", (np.zeros(len(u)),)))
    return extension.model, data


@pytest.mark.parametrize("delay", [0.0, 0.3, 1.0, 2.7, 12.0])
def test_it_picks_a_sample_or_a_point_between_two(delay: float) -> None:
    u = steps(1, 200)
    model, _ = delayed(u)
    run = simulate(model, {"u": u}, {**LAG.values, "delay_samples": delay})
    assert run["u_delayed"][12:] == pytest.approx(np.interp(np.arange(12, 200) - delay, np.arange(200), u))


@pytest.mark.parametrize("effects", [["inner_curve"], ["extra_lag", "inner_curve", "input_delay"]])
def test_it_is_no_lag_that_is_over_within_a_sample(effects: list[str]) -> None:
    u = steps(1, 400)
    y = simulate(LAG, {"u": np.concatenate([[0.0], u[:-1]])}, LAG.values)["y"]
    y = y + 0.01 * np.random.default_rng(0).uniform(-1, 1, 400)
    data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=0.1)
    found = diagnose(OutputError(), data, 0.01, effects, certify=False, workers=1)
    assert [cause.effect for cause in found.causes] == [name for name in effects if name == "input_delay"]


def test_an_interval_of_delays_leaves_a_constant_input_as_it_is() -> None:
    model, data = delayed(np.ones(60))
    (late,) = (line.expression for line in model.lines if line.signal == "u_delayed")
    alone = OwnModel([f"v[t] = {late}"], {"y": "v"}, ["u"], {"delay_samples": (0, 12)})
    (ends,) = Record(alone, data, {"y": 1e-12}).output_ends("v")
    assert np.abs(ends[12:]).max() < 1e-9
