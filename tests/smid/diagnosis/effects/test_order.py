"""Two effects are one model, whichever of them is put on first."""

import numpy as np
import pytest

from smid import Dataset, Hammerstein, Model, OutputError
from smid.diagnosis.effects import bilinear, input_dead_zone, input_delay, parameter_change
from smid.diagnosis.effects.effect import Effect, Site
from smid.models.simulate import simulate
from tests.smid.diagnosis.lag_records import steps

N = 200
DATA = Dataset.from_arrays(input={"u": steps(1, N)}, output={"y": steps(2, N)}, sampling_time=0.1)
SITE = Site(DATA, "u", "y")


def put(model: Model, effect: Effect, label: str) -> Model:
    return next(e.model for e in effect.extensions(model, SITE) if e.label == label)


@pytest.mark.parametrize("model", [OutputError(stable=True), OutputError(2, 1, stable=True)], ids=["lag", "order two"])
@pytest.mark.parametrize(("effect", "label"), [(input_delay.EFFECT, ""), (input_dead_zone.EFFECT, "above zero")])
def test_what_acts_on_the_input_multiplies_the_state(model: Model, effect: Effect, label: str) -> None:
    """The product is of the input as it acts: behind its delay or its dead zone."""
    one = put(put(model, effect, label), bilinear.EFFECT, "u times w")
    other = put(put(model, bilinear.EFFECT, "u times w"), effect, label)
    values = {"a1": -0.7, "a2": -0.1, "b0": 0.2, "b1": 0.1, "delay": 2.4, "dead_zone_upper": 0.3}
    names = {p.name for p in one.parameters}
    assert names == {p.name for p in other.parameters}
    values |= dict.fromkeys(names - values.keys(), 0.12)
    found = [
        simulate(m, {"u": DATA.experiments[0].values["u"]}, {name: values[name] for name in names})["y"]
        for m in (one, other)
    ]
    assert np.ptp(found[0]) > 0.1
    np.testing.assert_allclose(*found, atol=1e-12)


def test_a_delay_before_the_states_leaves_the_parameters_of_a_curve_to_vary() -> None:
    """The curve of the base model stays a part of the plant."""
    model = Hammerstein(powers=(2, 1), stable=True)
    delayed = put(model, input_delay.EFFECT, "")
    kept = {e.label for e in parameter_change.EFFECT.extensions(delayed, SITE)}
    assert {"gamma1", "gamma2"} <= kept
