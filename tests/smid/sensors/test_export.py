"""The exported C says what `predict` says, sample by sample, and certified ranges contain what a sensor says."""

import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest

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
    export_c,
    export_onnx,
    trained_range,
)
from smid.sensors.bounded import BoundedSensor
from smid.sensors.flow import FlowLaw
from smid.sensors.ptx_dynamics import EFFECTS, LevelLaw, RateLaw

GCC = shutil.which("gcc") or shutil.which("cc")
needs_compiler = pytest.mark.skipif(GCC is None, reason="no C compiler: install gcc")

SENSORS = {
    "CPX": CPX(hidden=(4,)),
    "CPX of three channels": CPX(hidden=(3, 2), inputs=("current", "pressure", "temperature"), delays=(0, 3)),
    "PX": PX(hidden=(3,)),
    "CFPX": CFPX(order=12),
    "CFPX of order 0": CFPX(order=0),
    "PTX": PTX(hidden=(3,), plays=2),
    "PTX with all effects": PTX(hidden=(2,), plays=1, effects=EFFECTS),
    "PTX without temperature": PTX(hidden=(3,), plays=1, temperature=None),
    "PTX with effects, without temperature": PTX(
        hidden=(2,), plays=1, temperature=None, effects=("flow", "backlash", "level", "rate")
    ),
    "PTX without plays": PTX(hidden=(2,), plays=0),
    "median": MedianFiltered(CPX(hidden=(3,)), order=20, causal=True),
    "dead zone": DeadZone(PX(hidden=(3,))),
    "both": DeadZone(MedianFiltered(CFPX(order=5), order=7, causal=True)),
}

LAWS = {
    "flow": {"flow": FlowLaw(0.02, 0.01, 1e-4, 0.03, 10.0, 0.005)},
    "temperature": {"friction_slope": 0.02},
    "backlash": {"backlash": 0.2},
    "level": {"level": LevelLaw(0.05, 10.0)},
    "rate": {"rate": RateLaw(-0.7, 1.0, 0.02)},
}
STRONG = (*((effect,) for effect in EFFECTS), EFFECTS)

MAIN = """\
#include "sensor.h"
#include <stdio.h>
int main(void) {
  sensor_state state, saved;
  double u[IN], y[3], before[3];
  sensor_reset(&state);
  for (long k = 0; fread(u, sizeof u, 1, stdin) == 1; k++) {
    if (k % 100 == 50) { saved = state; double wild[IN] = {1e6}; sensor_update(&state, wild, y); state = saved; }
    if (sensor_update(&state, u, y) == 1) return 1;
    fwrite(y, sizeof y, 1, stdout);
  }
  u[0] = 1.0 / 0.0;
  for (int k = 0; k < 3; k++) before[k] = y[k];
  if (sensor_update(&state, u, y) != 1) return 2;
  u[0] = 0.0 / 0.0;
  sensor_reset(&state);
  if (sensor_update(&state, u, y) != 1) return 3;
  for (int k = 0; k < 3; k++) if (before[k] != y[k]) return 4;
  return 0;
}
"""


@pytest.fixture(scope="module")
def trained():
    data = load_clutch(["20C_step_a", "60C_step_a"]).crop(1200, 1800)
    return {name: bound_error(sensor.fit(data, seed=1, starts=1), data) for name, sensor in SENSORS.items()}


def with_strong(bounded, effects):
    """Return a sensor with more friction and with effects as no training would find them."""
    sensor = bounded.sensor
    laws = {name: law for effect in effects for name, law in LAWS[effect].items()}
    friction = {"thresholds": (0.8, 2.5), "forces": (0.6, 1.1)}
    dynamics = replace(sensor.dynamics, **friction, **laws)
    return replace(bounded, sensor=replace(sensor, effects=effects, dynamics=dynamics))


def compiled(sensor, folder):
    """Return a function that runs the exported C over samples of shape (n, inputs)."""
    export_c(sensor, folder / "sensor.c")
    (folder / "main.c").write_text(MAIN.replace("IN]", f"{len(sensor.trained_on.inputs)}]"))
    flags = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-O2"]
    subprocess.run([GCC, *flags, "sensor.c", "main.c", "-o", "sensor", "-lm"], cwd=folder, check=True)

    def run(samples):
        found = subprocess.run([folder / "sensor"], input=samples.tobytes(), capture_output=True, check=True)
        return np.frombuffer(found.stdout).reshape(-1, 3)

    return run


@needs_compiler
@pytest.mark.parametrize("name", SENSORS)
def test_c_says_what_predict_says(trained, name, tmp_path):
    sensor = trained[name]
    run = compiled(sensor, tmp_path)
    for record in ("20C_step_b", "60C_ramp_b"):
        data = load_clutch(record).crop(0, 3000)
        samples = np.stack([data.values(s.name) for s in sensor.trained_on.inputs], axis=1)
        said = sensor.predict(data)
        found = run(samples)
        expected = np.stack([said.position[0], said.lower[0], said.upper[0]], axis=1)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * max(1.0, np.abs(expected).max()))


@needs_compiler
def test_c_without_error_bound(trained, tmp_path):
    sensor = trained["PTX"].sensor
    data = load_clutch("m20C_step_c").crop(0, 1000)
    samples = np.stack([data.values(name) for name in sensor.channels], axis=1)
    np.testing.assert_allclose(
        compiled(sensor, tmp_path)(samples)[:, 0], sensor.predict(data).position[0], rtol=0, atol=1e-11
    )


def bridges_as_the_stream_does(sensor, run):
    """Compare the exported C with the stream, where 10 % of the samples and a part are lost."""
    record = load_clutch("20C_step_b").crop(300, 620).experiments[0]
    names = [signal.name for signal in sensor.trained_on.inputs]
    samples = np.stack([record.values[n] for n in names], axis=1)
    generator = np.random.default_rng(11)
    samples[1:][generator.random((319, len(names))) < 0.1] = np.nan
    samples[200:230] = np.nan  # longer than the window
    stream = sensor.stream()
    said = [stream.update(0.002 * k, **dict(zip(names, row, strict=True))) for k, row in enumerate(samples)]
    expected = np.array([(now.position, now.lower, now.upper) for now in said])
    np.testing.assert_allclose(run(samples), expected, rtol=0, atol=1e-12 * max(1.0, np.abs(expected).max()))


@needs_compiler
@pytest.mark.parametrize(("name", "bounded"), [*((name, True) for name in SENSORS), ("PTX", False)])
def test_c_bridges_lost_samples_as_the_stream_does(trained, name, bounded, tmp_path):
    sensor = trained[name] if bounded else trained[name].sensor
    bridges_as_the_stream_does(sensor, compiled(sensor, tmp_path))


@needs_compiler
@pytest.mark.parametrize("effects", STRONG)
def test_c_holds_each_effect_where_it_is_strong(trained, effects, tmp_path):
    sensor = with_strong(trained["PTX"], effects)
    run = compiled(sensor, tmp_path)
    bridges_as_the_stream_does(sensor, run)
    data = load_clutch("60C_ramp_b").crop(0, 3000)
    samples = np.stack([data.values(s.name) for s in sensor.trained_on.inputs], axis=1)
    expected = sensor.predict(data).position[0]
    without = with_strong(trained["PTX"], ()).predict(data).position[0]
    assert np.abs(expected - without).max() > 0.01
    np.testing.assert_allclose(run(samples)[:, 0], expected, rtol=0, atol=1e-11)


def test_what_c_cannot_hold(trained, tmp_path):
    centred = MedianFiltered(trained["PX"].sensor, order=5)
    with pytest.raises(ModelError, match="a centred median needs future samples: take causal=True"):
        export_c(centred, tmp_path / "sensor.c")
    with pytest.raises(ModelError, match="PX is not trained"):
        export_c(PX(), tmp_path / "sensor.c")
    with pytest.raises(DataError, match=r"ends in \.c"):
        export_c(trained["PX"], tmp_path / "sensor.txt")
    with pytest.raises(DataError, match="'2nd' cannot begin the name of a C function"):
        export_c(trained["PX"], tmp_path / "2nd.c")
    broken = replace(trained["CFPX"].sensor, coefficients=np.array([1.0, np.inf]))
    with pytest.raises(ModelError, match="a number of the sensor is inf, which C cannot hold"):
        export_c(broken, tmp_path / "sensor.c")
    assert list(tmp_path.iterdir()) == []


def onnx_says_what_predict_says(sensor, folder):
    """Run the ONNX model sample by sample, and compare with `predict`."""
    onnxruntime = pytest.importorskip("onnxruntime", reason="no ONNX runtime: pip install onnxruntime")
    data = load_clutch("20C_step_b").crop(300, 900)
    session = onnxruntime.InferenceSession(export_onnx(sensor, folder / "sensor.onnx").read_bytes())
    memory = np.full(session.get_inputs()[1].shape, np.nan)
    found = []
    for row in np.stack([data.values(s.name) for s in sensor.trained_on.inputs], axis=1):
        y, memory = session.run(None, {"u": row, "memory": memory})
        found.append(y)
    said = sensor.predict(data)
    ends = [said.lower[0], said.upper[0]] if isinstance(sensor, BoundedSensor) else []
    expected = np.stack([said.position[0], *ends], axis=1)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * max(1.0, np.abs(expected).max()))


@pytest.mark.parametrize("name", [name for name in SENSORS if name not in ("median", "both")])
def test_onnx_says_what_predict_says(trained, name, tmp_path):
    onnx_says_what_predict_says(trained[name], tmp_path)
    onnx_says_what_predict_says(trained[name].sensor, tmp_path)


@pytest.mark.parametrize("effects", STRONG)
def test_onnx_holds_each_effect_where_it_is_strong(trained, effects, tmp_path):
    onnx_says_what_predict_says(with_strong(trained["PTX"], effects), tmp_path)


def test_what_onnx_cannot_hold(trained, tmp_path):
    with pytest.raises(ModelError, match="ONNX cannot hold the growing window of a median: export C"):
        export_onnx(trained["median"], tmp_path / "sensor.onnx")
    with pytest.raises(DataError, match=r"ends in \.onnx"):
        export_onnx(trained["PX"], tmp_path / "sensor.txt")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", SENSORS)
def test_certified_ranges_contain_what_the_sensor_says(trained, name):
    sensor = trained[name]
    found = trained_range(sensor)
    generator = np.random.default_rng(1)
    told = sensor.trained_on
    most = 0.0
    for hold in (1, 5, 40, 400):
        levels = {s.name: generator.uniform(s.lower, s.upper, 2000 // hold) for s in told.inputs}
        ends = {s.name: generator.choice([s.lower, s.upper], 2000 // hold) for s in told.inputs}
        for values in (levels, ends):
            samples = {n: np.repeat(x, hold) for n, x in values.items()}
            program = sensor.program()
            signals, _ = program.advance(samples)
            assert found.lower <= signals[program.output].min()
            assert signals[program.output].max() <= found.upper
            assert found.half_width[0] <= signals[program.half_width].min()
            assert signals[program.half_width].max() <= found.half_width[1]
            most = max(most, np.ptp(signals[program.output]))
    assert found.upper - found.lower < 3.0 * most + 0.3
    assert "Certified" in str(found)
