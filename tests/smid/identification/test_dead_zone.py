"""Certified dead zones hold the thresholds that made the records, in any unit, and refuse what cannot have one."""

from dataclasses import replace

import numpy as np
import pytest

from smid import DataError, Dataset, ModelError, dead_zones
from smid.theses.clutch import actuator_record, simulate_clutch, simulate_position


def record(seed, threshold=2.5, slope=0.8, noise=0.03, friction=0.0):
    """A slow ramp up and down, twice, into a curve with a dead zone and backlash."""
    generator = np.random.default_rng(seed)
    u = np.interp(np.arange(2000), [0, 50, 900, 1000, 1050, 1900, 2000], [0, 0, 8, 0, 0, 8, 0])
    held, pushed = 0.0, []
    for x in u:
        held = max(x - friction, min(x + friction, held))
        pushed.append(held)
    y = 0.4 + slope * np.maximum(0.0, np.array(pushed) - (threshold - friction))
    measured = {"u": u + generator.uniform(-0.05, 0.05, 2000), "y": y + generator.uniform(-noise, noise, 2000)}
    return Dataset.from_arrays(
        input={"u": measured["u"]}, output={"y": measured["y"]}, sampling_time=0.01, units={"u": "V", "y": "mm"}
    )


@pytest.mark.parametrize(("threshold", "slope", "friction"), [(2.5, 0.8, 0.0), (1.0, 2.0, 0.4), (3.0, -0.5, 0.0)])
def test_the_threshold_that_made_the_record_is_inside(threshold, slope, friction):
    zone = dead_zones(record(1, threshold, slope, friction=friction), [("u", "y")]).zones[0]
    assert zone.threshold[0] < threshold < zone.threshold[1]
    assert zone.threshold[1] - zone.threshold[0] < 1.5
    assert zone.rest[0] < 0.4 < zone.rest[1]
    assert zone.proven


def test_units_and_the_sign_of_the_output_do_not_matter():
    data = record(2)
    run = data.experiments[0]
    scaled = data.with_experiments(
        [replace(run, values={"u": 1000.0 * run.values["u"] + 5.0, "y": -1e-3 * run.values["y"]})]
    )
    one, other = (dead_zones(d, [("u", "y")]).zones[0] for d in (data, scaled))
    np.testing.assert_allclose(np.array(one.threshold) * 1000.0 + 5.0, other.threshold, rtol=1e-3)


def test_no_dead_zone_is_proven_where_there_is_none():
    zone = dead_zones(record(3, threshold=-1.0), [("u", "y")]).zones[0]
    assert not zone.proven


def test_bad_input():
    data = record(4)
    with pytest.raises(DataError, match="no channel 'x'"):
        dead_zones(data, [("u", "x")])
    still = data.with_experiments([replace(r, values={**r.values, "y": np.ones(2000)}) for r in data.experiments])
    with pytest.raises(DataError, match=r"y \[mm\] does not vary: give a record that leaves the dead zone"):
        dead_zones(still, [("u", "y")])
    with pytest.raises(DataError, match="slow points of u and y near the rest, and a dead zone needs 10"):
        dead_zones(data.crop(0, 45), [("u", "y")])
    with pytest.raises(ModelError, match="a noise bound is not positive"):
        dead_zones(data, [("u", "y")], noise_bounds=[-1.0])
    with pytest.raises(ModelError, match="1 noise bounds for 2 pairs"):
        dead_zones(data, [("u", "y"), ("u", "y")], noise_bounds=[1.0])
    with pytest.raises(
        ModelError, match=r"no dead zone from u to y fits within 1e-05 mm \(proven\): give a noise bound"
    ):
        dead_zones(data, [("u", "y")], noise_bounds=[1e-5])


def test_the_three_dead_zones_of_the_clutch():
    # On a slow ramp from rest; the thresholds are those of the same ramp without noise.
    current = np.interp(np.arange(20_000), [0, 1000, 17_000, 19_000, 20_000], [0, 0, 800, 0, 0])
    pressure = simulate_clutch(current, 20.0)
    position = simulate_position(pressure, 20.0)
    starts, moves = int(np.argmax(pressure > 0.02)), int(np.argmax(position > 0.01))
    pairs = [("current", "pressure"), ("current", "position"), ("pressure", "position")]
    found = dead_zones(actuator_record(current, 20.0, seed=1), pairs)
    for zone, truth in zip(found.zones, (current[starts], current[moves], pressure[moves]), strict=True):
        assert zone.threshold[0] < truth < zone.threshold[1]
        assert zone.proven
