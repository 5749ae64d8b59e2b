"""The bundled records of current, pressure and position: reproducible, irregular, rich, inside their noise bounds."""

import hashlib
import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

from smid.data import DataError
from smid.data.bundled import CLUTCH_RECORDS, SHORT_RECORDS, load_clutch
from smid.theses.clutch import POSITION_NOISE_BOUND, ReturnSpring
from smid.theses.clutch.plant import NOISE_BOUND

ROOT = Path(__file__).resolve().parents[4]
FOLDER = ROOT / "data" / "clutch"
WITH_HYSTERESIS = ("20C_step_b", "60C_step_c", "m20C_step_c")

each_record = pytest.mark.parametrize("name", CLUTCH_RECORDS)


@pytest.fixture(scope="module")
def script():
    path = ROOT / "data" / "make_clutch.py"
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up by name
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def data():
    return load_clutch()


def raw(name):
    """The columns of a file, as they were written."""
    return np.loadtxt(FOLDER / f"{name}.csv", delimiter=",", skiprows=5).T


def record(script, name):
    return next(r for r in script.RECORDS if r.name == name)


@each_record
def test_the_script_writes_the_files_bit_for_bit(script, name):
    content = (FOLDER / f"{name}.csv").read_bytes()
    assert record(script, name).render().encode("ascii") == content
    assert content.startswith(b"# SIMULATED")
    readme = (ROOT / "data" / "README.md").read_text("utf-8")
    assert f"{hashlib.sha256(content).hexdigest()}  clutch/{name}.csv" in readme
    assert f"| `{name}` | {record(script, name).temperature:g} degC | {record(script, name).seed} |" in readme


def test_folder_script_and_loader_name_the_same_records(script):
    assert tuple(r.name for r in script.RECORDS) == CLUTCH_RECORDS + SHORT_RECORDS
    assert sorted(path.stem for path in FOLDER.iterdir()) == sorted(CLUTCH_RECORDS + SHORT_RECORDS)
    assert sum(path.stat().st_size for path in FOLDER.iterdir()) < 2.5e6
    seeds = [r.seed for r in script.RECORDS]
    assert len(set(seeds)) == len(seeds)


@each_record
def test_the_recordings_are_irregular_and_their_noise_is_bounded(script, name):
    time, current, pressure, position, temperature = raw(name)
    steps = np.diff(time)
    assert 0.0009 < steps.min() < 0.0012
    assert 0.0028 < steps.max() < 0.0031
    ticks = script.stamps_of(record(script, name))
    np.testing.assert_allclose(time, ticks * 1e-4, atol=1e-9)
    true_current, true_pressure, true_position = (v[ticks] for v in script.truth_of(record(script, name)))
    np.testing.assert_allclose(current, true_current, atol=1e-9)
    for measured, truth, bound in (
        (pressure, true_pressure, NOISE_BOUND),
        (position, true_position, POSITION_NOISE_BOUND),
    ):
        assert 0.95 * bound < np.abs(measured - truth).max() <= bound
    assert set(temperature) == {float(name.split("_")[0].replace("m", "-").removesuffix("C"))}


def test_loading_unifies_to_2_ms(data):
    assert data.sampling_time == 2e-3
    assert [run.name for run in data.experiments] == list(CLUTCH_RECORDS)
    assert [str(channel) for channel in data.channels] == [
        "current [mA]",
        "pressure [bar]",
        "position [mm]",
        "temperature [degC]",
    ]
    assert (data.inputs, data.outputs) == (("current",), ("pressure", "position"))
    assert data.source.endswith("(simulated)")
    for k, resampling in enumerate(data.resampling):
        assert resampling.method == "linear"
        assert data.experiments[k].n_samples == 5001
        time, _, _, position, _ = raw(CLUTCH_RECORDS[k])
        np.testing.assert_allclose(data.values("position", k), np.interp(data.time(k), time, position), atol=1e-12)


def test_names_choose_and_order(data):
    chosen = load_clutch(["60C_step_c", "20C_ramp_a"])
    assert [run.name for run in chosen.experiments] == ["60C_step_c", "20C_ramp_a"]
    np.testing.assert_array_equal(chosen.values("position", 1), data.values("position", 0))
    assert load_clutch("20C_ramp_a").n_samples == 5001


@each_record
def test_profiles_visit_the_dead_zones_and_the_range(data, name):
    k = CLUTCH_RECORDS.index(name)
    current, pressure, position = (data.values(channel, k) for channel in ("current", "pressure", "position"))
    assert (np.histogram(current, bins=6, range=(350, 950))[0] >= 100).all()
    assert (current == 0).sum() > 100
    assert (np.histogram(position, bins=8, range=(0, 8))[0] >= 20).all()
    assert ((current > 150) & (pressure < 1.0)).sum() > 50
    assert ((pressure > 1.0) & (position < 2 * POSITION_NOISE_BOUND)).sum() > 50


def friction_at_rest(data, name):
    """What friction takes off the pressure, in bar, at the end of every step that leaves the clutch on its way."""
    k = CLUTCH_RECORDS.index(name)
    current, pressure, position = (data.values(channel, k) for channel in ("current", "pressure", "position"))
    ends = np.flatnonzero(np.diff(current)) - 1
    rests = [slice(end - 14, end + 1) for end in ends if end > 50 and np.ptp(current[end - 45 : end + 1]) == 0]
    spring, share = ReturnSpring(), 1 - ReturnSpring().softening * (data.values("temperature", k)[0] - 20)
    x = np.array([position[rest].mean() for rest in rests])
    acting = spring.preload + spring.stiffness * x + spring.cushion * np.maximum(0, x - spring.kiss_point) ** 2
    return (np.array([pressure[rest].mean() for rest in rests]) - share * acting)[x > 0.3]


def test_only_the_sets_with_hysteresis_come_to_rest_from_above(data):
    for name in WITH_HYSTERESIS:
        from_below = friction_at_rest(data, name.split("_")[0] + "_step_a")
        assert from_below.size > 10
        assert from_below.min() > 0
        both = friction_at_rest(data, name)
        assert (both < -0.3).sum() >= 8
        assert (both > 0.3).sum() >= 8


def test_a_warm_clutch_goes_further(data):
    tops = [data.values("position", CLUTCH_RECORDS.index(f"{t}_step_a")).max() for t in ("m20C", "20C", "60C")]
    assert tops[0] + 0.1 < tops[1] < tops[2] - 0.1


def test_mistakes_are_named():
    with pytest.raises(DataError, match="no clutch record '20C_step_c'; did you mean"):
        load_clutch("20C_step_c")
    with pytest.raises(DataError, match=r"no clutch record '\.\./varying_pole_20C_steps'"):
        load_clutch(["20C_step_a", "../varying_pole_20C_steps"])
    with pytest.raises(DataError, match="short records have no position"):
        load_clutch(["20C_step_a", "varying_pole_20C_steps"])
    with pytest.raises(DataError, match="no files were given"):
        load_clutch([])
    with pytest.raises(DataError, match="occurs 2 times"):
        load_clutch(["20C_step_a", "20C_step_a"])
