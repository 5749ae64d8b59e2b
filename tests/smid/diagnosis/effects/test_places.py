"""An effect is offered at every place among the effects on the same input or sensor."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.measured_cases import two_tanks
from smid import Dataset, OutputError
from smid.diagnosis.effects import (
    extra_lag,
    gravity,
    input_backlash,
    input_dead_zone,
    input_saturation,
    output_saturation,
    rate_limit,
    sensor_bias,
    viscous_friction,
)
from smid.diagnosis.effects.effect import Effect, Site
from smid.models import Model
from smid.models.simulate import simulate
from tests.smid.diagnosis.lag_records import steps

DATA = Dataset.from_arrays(input={"u": steps(1, 200)}, output={"y": steps(2, 200)}, sampling_time=0.1)
SITE = Site(DATA, "u", "y")
BASE = OutputError(stable=True)
VALUES = {
    **{"a1": -0.7, "b0": 0.4, "dead_zone_upper": 0.2, "backlash_gap": 0.3, "input_limit_upper": 0.3},
    **{"sensor_limit_upper": 0.2, "sensor_pole": 0.6, "sensor_share": 0.3, "sensor_bias": 0.15, "slew_time": 0.4},
}


def offered(model: Model, effect: Effect, label: str = "") -> dict[str, Model]:
    known = model.with_values({p.name: VALUES[p.name] for p in model.parameters})
    return {e.place: e.model for e in effect.extensions(known, SITE) if e.label == label}


def outputs(model: Model) -> np.ndarray:
    values = {p.name: VALUES[p.name] for p in model.parameters}
    return simulate(model, {"u": DATA.experiments[0].values["u"]}, values)["y"]


@pytest.mark.parametrize(
    ("first", "second", "place"),
    [
        ((input_dead_zone.EFFECT, "above zero"), (input_backlash.EFFECT, ""), "behind the input dead zone"),
        ((input_backlash.EFFECT, ""), (input_saturation.EFFECT, "above"), "behind the input backlash"),
        ((rate_limit.EFFECT, "both ways"), (input_saturation.EFFECT, "above"), "behind the rate limit"),
        (
            (output_saturation.EFFECT, "above, at the sensor"),
            (extra_lag.EFFECT, "at the sensor"),
            "before the output saturation",
        ),
        (
            (extra_lag.EFFECT, "at the sensor"),
            (output_saturation.EFFECT, "above, at the sensor"),
            "before the extra lag",
        ),
    ],
    ids=["dead zone", "backlash", "rate limit", "limit", "lag"],
)
def test_either_order_of_two_effects_is_offered_whichever_is_put_on_first(
    first: tuple[Effect, str], second: tuple[Effect, str], place: str
) -> None:
    on_first = offered(offered(BASE, *first)[""], *second)
    on_second = offered(BASE, *second)[""]
    assert set(on_first) == {"", place}
    # Next to the plant, the second is where it is if it is put on first and the other next to the channel.
    np.testing.assert_allclose(outputs(on_first[place]), outputs(offered(on_second, *first)[""]), atol=1e-12)
    assert np.ptp(outputs(on_first[""]) - outputs(on_first[place])) > 1e-3


def test_among_three_effects_a_fourth_has_four_places() -> None:
    model = BASE
    for effect, label in (
        (input_dead_zone.EFFECT, "above zero"),
        (input_backlash.EFFECT, ""),
        (rate_limit.EFFECT, "both ways"),
    ):
        model = offered(model, effect, label)[""]
    found = offered(model, input_saturation.EFFECT, "above")
    assert set(found) == {"", "behind the rate limit", "behind the input backlash", "behind the input dead zone"}
    assert len({outputs(one).round(9).tobytes() for one in found.values()}) == 4


@pytest.mark.parametrize("effect", [viscous_friction.EFFECT, gravity.EFFECT], ids=lambda e: e.name)
def test_what_acts_within_the_plant_has_one_place(effect: Effect) -> None:
    """Effects on the input and the sensor do not move it."""
    chained = offered(offered(BASE, input_backlash.EFFECT)[""], sensor_bias.EFFECT)[""]
    assert {e.place for e in effect.extensions(chained, SITE)} <= {""}


def test_a_full_vessel_behind_the_zero_of_its_sensor_is_named_by_its_own_level() -> None:
    """The sensor shows another number than the level at which the vessel overflows."""
    u = np.random.default_rng(2).uniform(0, 5, 100)
    known = {"outflow": 0.01, "pump": 0.02, "zero": 3.0}
    model = replace(two_tanks(), sampling_time=4.0).with_values(known)
    data = Dataset.from_arrays(input={"u": u}, output={"y": simulate(model, {"u": u})["y"]}, sampling_time=4.0)
    offered = {item.label: item for item in output_saturation.EFFECT.extensions(model, Site(data, "u", "y"))}
    for label, what in (("above, in the state", "w"), ("above, at the sensor", "y")):
        item = offered[label]
        assert item.describe is not None
        assert f" {what} rises no further than " in item.describe(item.starts[0], Site(data, "u", "y"))
