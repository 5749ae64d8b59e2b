"""Where samples are lost, the interval contains what the sensor says of all samples, and the memory survives."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from smid.data import DataError
from smid.data.bundled import load_clutch
from smid.sensors import CFPX, CPX, PTX, PX, DeadZone, MedianFiltered, bound_error
from smid.sensors.ptx_dynamics import EFFECTS
from smid.sensors.trained_on import Signal

PART = (1200, 1800)
SENSORS = {
    "CPX": CPX(hidden=(4,)),
    "CFPX": CFPX(order=12),
    "PTX": PTX(hidden=(3,), plays=2),
    "PTX with all effects": PTX(hidden=(2,), plays=1, effects=EFFECTS),
    "median": MedianFiltered(PX(hidden=(3,)), order=7, causal=True),
    "dead zone": DeadZone(PX(hidden=(3,))),
}


@pytest.fixture(scope="module")
def data():
    return load_clutch(["20C_step_a", "60C_step_a"]).crop(*PART)


@pytest.fixture(scope="module")
def trained(data):
    return {name: bound_error(sensor.fit(data, seed=1, starts=1), data) for name, sensor in SENSORS.items()}


def streamed(sensor, run, lost, skipped=()):
    """Return the estimates of a record in which samples, a set of instant and channel, and whole instants are lost."""
    stream, found = sensor.stream(), {}
    for k in range(run.n_samples):
        if k not in skipped:
            samples = {
                name: None if (k, name) in lost else float(run.values[name][k]) for name in sensor.sensor.channels
            }
            found[k] = stream.update(0.002 * k, **samples)
    return found


@settings(max_examples=8, deadline=None)
@given(name=st.sampled_from(sorted(SENSORS)), seed=st.integers(0, 10**6), share=st.sampled_from([0.02, 0.1, 0.4]))
def test_the_interval_contains_that_of_all_samples(trained, data, name, seed, share):
    # On the records of the training, where no sample changes faster than it was learnt.
    generator = np.random.default_rng(seed)
    sensor, run = trained[name], data.experiments[seed % 2]
    start = int(generator.integers(0, 450))
    run = replace(run, values={c: x[start : start + 120] for c, x in run.values.items()})
    lost = {(k, c) for k in range(1, 120) for c in sensor.sensor.channels if generator.random() < share}
    skipped = {k for k in range(1, 120) if generator.random() < share / 2}
    whole = streamed(sensor, run, set())
    for k, said in streamed(sensor, run, lost, skipped).items():
        assert said.lower <= whole[k].lower + 1e-9
        assert said.upper >= whole[k].upper - 1e-9
        if not said.bridged:
            assert (said.lower, said.upper) == pytest.approx((whole[k].lower, whole[k].upper), abs=1e-6)


def test_a_tenth_of_the_samples_is_bridged_on_a_record_that_trained_nothing():
    names = [f"{t}C_{kind}_a" for t in ("20", "m20") for kind in ("ramp", "step")]
    sensor = PTX(hidden=(3,), plays=1).fit(load_clutch(names).crop(1200, 2200), seed=1, starts=1)
    bounded = bound_error(sensor, load_clutch(["20C_ramp_b", "m20C_step_c"]))
    run = load_clutch("20C_step_b").crop(300, 1300).experiments[0]
    generator = np.random.default_rng(7)
    lost = {(k, "pressure") for k in range(1, 1000) if generator.random() < 0.1}
    whole, said = streamed(bounded, run, set()), streamed(bounded, run, lost)
    position = run.values["position"]
    held = [s.lower <= position[k] <= s.upper for k, s in said.items()]
    assert np.mean(held) >= 0.999
    mean = [np.mean([s.upper - s.lower for s in found.values()]) for found in (whole, said)]
    assert mean[1] < 3 * mean[0]
    assert said[min(lost)[0]].warnings == (f"pressure is lost at {0.002 * min(lost)[0]:g} s: bridged",)


def test_the_memory_of_the_hysteresis_survives(trained):
    # Up to a level along two ways; the branch is still known after a loss at rest.
    sensor = trained["PTX"].sensor
    ways = [
        np.concatenate([np.linspace(0, top, 60), np.linspace(top, 15.0, 40), np.full(60, 15.0)]) for top in (15.0, 30)
    ]
    ends = []
    for way in ways:
        stream = sensor.stream()
        for k, pressure in enumerate(way):
            said = stream.update(0.002 * k, pressure=None if 120 <= k < 123 else pressure, temperature=20.0)
        assert said.bridged
        ends.append(said)
    assert ends[1].lower > ends[0].upper + 0.1


def test_a_late_sample_is_said(trained):
    stream = trained["CFPX"].stream()
    stream.update(0.0, pressure=5.0)
    assert stream.update(0.0021, pressure=5.0).warnings == ()
    said = stream.update(0.0049, pressure=5.0)
    assert said.warnings == ("the sample of 0.0049 s is 0.89 ms late",)
    assert said.bridged
    assert stream.update(0.0100, pressure=5.0).warnings == ("2 samples are lost before 0.01 s: bridged",)
    for k in range(200):
        said = stream.update(0.0120 + 0.002 * k, pressure=5.0)
    assert not said.bridged


@pytest.mark.parametrize("name", SENSORS)
def test_a_state_is_saved_and_restored(trained, data, name):
    sensor, run = trained[name], data.experiments[0]
    channels = sensor.sensor.channels
    stream = sensor.stream()
    for k in range(60):
        again = sensor.stream(state=json.loads(json.dumps(stream.state))) if k else sensor.stream()
        samples = {c: None if k in (20, 21, 40) else float(run.values[c][k]) for c in channels}
        assert stream.update(0.002 * k, **samples) == again.update(0.002 * k, **samples)
    other = trained["PTX" if name != "PTX" else "CPX"]
    with pytest.raises(DataError, match="no state of this sensor"):
        other.stream(state=stream.state)


def test_what_cannot_be_bridged(trained):
    stream = trained["CPX"].stream()
    with pytest.raises(DataError, match="no state before its first sample"):
        _ = stream.state
    with pytest.raises(DataError, match="pressure is lost in the first sample: begin with a complete one"):
        stream.update(0.0, current=0.0, pressure=None)
    with pytest.raises(DataError, match="no sample of 'pressure' at 0 s: give current, pressure, and None for a lost"):
        stream.update(0.0, current=0.0)


def test_what_is_between_two_samples_is_bounded_by_the_training():
    generator = np.random.default_rng(3)
    from smid.data import Dataset

    walk = np.cumsum(generator.normal(size=2000)) + 5 * (np.arange(2000) % 400 > 200)
    data = Dataset.from_arrays(input={"u": walk}, output={"y": walk}, sampling_time=1.0)
    signal = Signal.of(data, "u")
    for _ in range(500):
        k, span = int(generator.integers(0, 1950)), int(generator.integers(2, 40))
        age = int(generator.integers(1, span))
        for found in (
            signal.between(walk[k], walk[k + span], age, span - age),
            signal.after(walk[k], age),
            signal.after(walk[k + span], span - age),
        ):
            assert found.lower <= walk[k + age] <= found.upper


def test_units_of_the_samples_are_converted(trained):
    one, other = trained["CFPX"].stream(), trained["CFPX"].stream(units={"pressure": "kPa"})
    assert one.update(0.0, pressure=5.0).position == pytest.approx(other.update(0.0, pressure=500.0).position)
    with pytest.raises(DataError, match="pressure is in mA, but the sensor was trained on records in bar: convert"):
        trained["CFPX"].stream(units={"pressure": "mA"})
    with pytest.raises(DataError, match="a unit is given for 'presure', which is no channel of it; did you mean"):
        trained["CFPX"].stream(units={"presure": "bar"})


def test_records_in_other_units(trained, data):
    sensor = trained["CFPX"]
    in_kpa = replace(
        data,
        experiments=tuple(
            replace(
                r, values={**r.values, "pressure": 100 * r.values["pressure"], "position": r.values["position"] / 1e3}
            )
            for r in data.experiments
        ),
        channels=tuple(
            replace(c, unit={"pressure": "kPa", "position": "m"}.get(c.name, c.unit)) for c in data.channels
        ),
    )
    expected, found = sensor.predict(data), sensor.predict(in_kpa)
    np.testing.assert_allclose(found.position[0], expected.position[0], atol=1e-9)
    assert found.coverage(in_kpa) == expected.coverage(data)
    unknown = replace(in_kpa, channels=tuple(replace(c, unit="") for c in data.channels))
    assert "states no unit of pressure: taken to be in bar" in sensor.predict(unknown).warnings[0]
    wrong = replace(in_kpa, channels=tuple(replace(c, unit="K") for c in data.channels))
    with pytest.raises(DataError, match="pressure is in K, but the sensor was trained on records in bar"):
        sensor.predict(wrong)
