"""What a sensor says of a stream is what it says of a record, to the last bit; what it cannot do, it refuses."""

import json
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from smid import load
from smid.data import DataError
from smid.data.bundled import load_clutch
from smid.models import ModelError
from smid.sensors import (
    CFPX,
    CPX,
    PTX,
    PX,
    DeadZone,
    MedianFiltered,
    bound_error,
    save_sensor,
    sensor_to_dict,
)
from smid.sensors.ptx_dynamics import EFFECTS

PART = (1200, 1800)


def records(*names):
    return load_clutch(names).crop(*PART)


SENSORS = {
    "CPX": CPX(hidden=(4,)),
    "PX": PX(hidden=(3,)),
    "CFPX": CFPX(order=12),
    "PTX": PTX(hidden=(3,), plays=2),
    "PTX with all effects": PTX(hidden=(2,), plays=1, effects=EFFECTS),
    "median": MedianFiltered(CPX(hidden=(3,)), order=20, causal=True),
    "dead zone": DeadZone(PX(hidden=(3,))),
    "both": DeadZone(MedianFiltered(CFPX(order=5), order=7, causal=True)),
}


@pytest.fixture(scope="module")
def trained():
    data = records("20C_step_a", "60C_step_a")
    return {name: sensor.fit(data, seed=1, starts=1) for name, sensor in SENSORS.items()}


@pytest.mark.parametrize("name", SENSORS)
def test_a_stream_says_what_a_record_says(trained, name):
    data = records("m20C_step_c")
    sensor, run = trained[name], data.experiments[0]
    stream = sensor.stream()
    said = [
        stream.update(run.start_time + k * data.sampling_time, **{c: float(run.values[c][k]) for c in data.names})
        for k in range(run.n_samples)
    ]
    assert [s.position for s in said] == sensor.predict(data).position[0].tolist()
    assert all(s.lower == s.position == s.upper and not s.bridged for s in said)
    assert all(any("temperature -20 degC" in w for w in s.warnings) == name.startswith("PTX") for s in said)


@settings(max_examples=15, deadline=None)
@given(cuts=st.lists(st.integers(1, 599), max_size=6), name=st.sampled_from(sorted(SENSORS)))
def test_blocks_of_any_length_say_the_same(trained, cuts, name):
    sensor, run = trained[name], records("20C_step_b").experiments[0]
    whole, program, memory, pieces = sensor.evaluate(run.values), sensor.program(), None, []
    ends = [0, *sorted(set(cuts)), run.n_samples]
    for a, b in pairwise(ends):
        signals, memory = program.advance({c: samples[a:b] for c, samples in run.values.items()}, memory)
        pieces.append(signals[program.output])
    assert np.concatenate(pieces).tolist() == whole.tolist()


def test_a_bounded_sensor_streams_what_it_predicts(trained, tmp_path):
    data = records("20C_step_b")
    save_sensor(bound_error(trained["PTX"], data), tmp_path / "bounded.json")
    bounded = load(tmp_path / "bounded.json")
    np.testing.assert_array_equal(
        bounded.predict(data).lower[0], bound_error(trained["PTX"], data).predict(data).lower[0]
    )
    said, run, stream = bounded.predict(data), data.experiments[0], bounded.stream()
    for k in range(300):
        one = stream.update(
            k * data.sampling_time, pressure=run.values["pressure"][k], temperature=run.values["temperature"][k]
        )
        expected = (said.position[0][k], said.lower[0][k], said.upper[0][k])
        assert (one.position, one.lower, one.upper) == expected


@pytest.mark.parametrize("name", SENSORS)
def test_a_file_holds_the_sensor_to_the_last_bit(trained, name, tmp_path):
    data = records("20C_ramp_b")
    for sensor in (SENSORS[name], trained[name]):
        save_sensor(sensor, tmp_path / "sensor.json")
        again = load(tmp_path / "sensor.json")
        assert sensor_to_dict(again) == sensor_to_dict(sensor)
        assert again.n_parameters == sensor.n_parameters
    np.testing.assert_array_equal(again.predict(data).position[0], trained[name].predict(data).position[0])


@pytest.mark.parametrize("name", SENSORS)
def test_training_leaves_the_untrained_sensor_as_it_was(trained, name):
    assert SENSORS[name].sampling_time is None
    assert trained[name].sampling_time == 0.002
    with pytest.raises(ModelError, match="is not trained: take what its fit"):
        SENSORS[name].predict(records("20C_step_a"))
    with pytest.raises(ModelError, match="is not trained"):
        SENSORS[name].stream()
    with pytest.raises(ModelError, match="is not trained"):
        bound_error(SENSORS[name], records("20C_step_a"))


def test_the_parameters_of_the_thesis():
    assert [sensor.n_parameters for sensor in (CPX(), PX(), CFPX(20))] == [61, 31, 21]
    assert PTX().n_parameters <= 2 * 61


def without(data, channel):
    runs = [replace(run, values={c: v for c, v in run.values.items() if c != channel}) for run in data.experiments]
    return replace(
        data,
        experiments=tuple(runs),
        channels=tuple(c for c in data.channels if c.name != channel),
        outputs=tuple(name for name in data.outputs if name != channel),
    )


@pytest.mark.parametrize(("name", "channel"), [("PTX", "temperature"), ("CPX", "pressure"), ("dead zone", "pressure")])
def test_a_missing_channel(trained, name, channel):
    data = without(records("20C_step_a"), channel)
    with pytest.raises(DataError, match=f"no channel '{channel}', which the sensor needs"):
        trained[name].predict(data)
    with pytest.raises(DataError, match=f"no channel '{channel}'"):
        SENSORS[name].fit(data, seed=1)
    with pytest.raises(DataError, match=f"no sample of '{channel}' at 0 s"):
        trained[name].stream().update(0.0, **{c: 1.0 for c in trained[name].channels if c != channel})


def test_no_position():
    data = without(records("20C_step_a"), "position")
    with pytest.raises(DataError, match="no channel 'position'"):
        CPX().fit(data, seed=1)
    sensor = CFPX(3).fit(records("20C_step_a"), seed=1)
    said = sensor.predict(data)
    with pytest.raises(DataError, match="no channel 'position'"):
        said.mse(data)
    with pytest.raises(DataError, match="not those of the prediction"):
        said.mse(records("20C_step_b"))


def test_warm_up_samples_do_not_count():
    data = records("20C_step_a")
    said = CFPX(3).fit(data, seed=1).predict(data)
    late = data.with_n_init(100)
    assert said.residuals(late)[0].size == 500
    assert said.mse(late) == pytest.approx(np.mean(said.residuals(data)[0][100:] ** 2))


@pytest.mark.parametrize(
    ("times", "message"),
    [
        ((0.0, 0.002, 0.002), "came after that of 0.002 s: give samples in the order of time"),
        ((0.0, 3.0), "1499 samples are lost between 0 s and 3 s, and at most 1000 are bridged"),
        ((0.0, 0.002, 0.0), "came after"),
        ((float("nan"),), "is not a finite time"),
    ],
)
def test_samples_out_of_order(trained, times, message):
    stream = trained["CPX"].stream()
    for time in times[:-1]:
        stream.update(time, current=100.0, pressure=3.0)
    with pytest.raises(DataError, match=message):
        stream.update(times[-1], current=100.0, pressure=3.0)


def test_a_refused_sample_leaves_the_stream_as_it_was(trained):
    one, other = trained["PTX"].stream(), trained["PTX"].stream()
    for k, pressure in enumerate((1.0, 5.0, 9.0, 3.0)):
        sample = {"pressure": pressure, "temperature": 20.0}
        with pytest.raises(DataError, match="pressure = inf at"):
            other.update(0.002 * k, pressure=float("inf"), temperature=20.0)
        if k:
            with pytest.raises(DataError, match="came after"):
                other.update(0.002 * (k - 1), **sample)
        assert one.update(0.002 * k, **sample) == other.update(0.002 * k, **sample)


def test_another_sampling_time(trained):
    with pytest.raises(DataError, match=r"sampling time of 0.004 s, those that trained the sensor 0.002 s: resample"):
        trained["CPX"].predict(records("20C_step_a").decimate(2, antialias=False))


@pytest.mark.parametrize("name", ["CPX", "PX", "CFPX", "PTX"])
def test_a_channel_that_does_not_vary(name):
    data = load_clutch(["20C_step_a", "60C_step_a"]).crop(220, 255)
    runs = [replace(r, values={**r.values, "pressure": np.full(35, 2.0)}) for r in data.experiments]
    with pytest.raises(DataError, match=r"pressure \[bar\] is 2 in every sample: train on"):
        SENSORS[name].fit(replace(data, experiments=tuple(runs), resampling=()), seed=1)


@pytest.mark.parametrize("name", ["CPX", "PX", "CFPX", "PTX"])
def test_too_few_samples(name):
    data = load_clutch(["20C_step_a", "60C_step_a"]).crop(250, 255)
    with pytest.raises(DataError, match=r"but \d+ (training )?samples"):
        replace(SENSORS[name], **({"order": 30} if name == "CFPX" else {"hidden": (10,)})).fit(data, seed=1)


def test_files_that_hold_no_sensor(tmp_path):
    unknown = '{"schema": "smid.sensor/3", "kind": "XYZ"}'
    with pytest.raises(DataError, match="no file"):
        load(tmp_path / "none.json")
    older = '{"schema": "smid.sensor/2", "kind": "CPX"}'
    for text, message in (
        (older, "reads smid.sensor/3: use the version of smid"),
        ("{", "is not valid JSON"),
        ("[1]", "holds no result"),
        (unknown, "kind 'XYZ'"),
    ):
        (tmp_path / "sensor.json").write_text(text)
        with pytest.raises(DataError, match=message):
            load(tmp_path / "sensor.json")
    record = sensor_to_dict(CPX())
    del record["hidden"]
    (tmp_path / "sensor.json").write_text(json.dumps(record))
    with pytest.raises(DataError, match="hidden: the key is missing"):
        load(tmp_path / "sensor.json")
