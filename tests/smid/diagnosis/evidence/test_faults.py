"""Faults of the data: silence on clean records, and each hidden fault found."""

import json
from collections import Counter

import numpy as np
import pytest
from scipy.signal import lfilter

from smid.data import DataError, Dataset
from smid.data.resample import resample
from smid.diagnosis.evidence.faults import data_faults, outlier_mask, quantisation_step
from smid.diagnosis.evidence.feedback import feedback

SIGNALS = ("prbs", "multisine", "staircase", "ramp", "noise", "sine", "steps")


def draw_input(random, kind, n):
    t = np.arange(n)
    if kind == "prbs":
        return np.repeat(random.choice([-1.0, 1.0], n), int(random.integers(1, 12)))[:n]
    if kind == "multisine":
        return sum(np.sin(w * t + random.uniform(0, 6)) for w in random.uniform(0.01, 1.0, 8))
    if kind == "staircase":
        levels = random.uniform(0, 1, n) if random.random() < 0.5 else random.integers(0, 6, n) / 5
        return np.repeat(levels, int(random.integers(10, 40)))[:n]
    if kind == "ramp":
        return np.abs((t / random.uniform(50, n)) % 2 - 1)
    if kind == "sine":
        return np.sin(random.uniform(0.01, 0.5) * t)
    if kind == "steps":
        return (t > n // 4) * 1.0 - (t > n // 2) * 0.5
    return random.standard_normal(n)


def draw_plant(random, u):
    if random.random() < 0.5:
        poles = random.uniform(0.2, 0.97, 2)
    else:
        pair = random.uniform(0.5, 0.95) * np.exp(1j * random.uniform(0.1, 1.0))
        poles = np.array([pair, pair.conjugate()])
    return lfilter([1.0, random.uniform(-0.5, 0.5)], np.poly(poles).real, u)


def clean(seed, kind=None, n=None):
    random = np.random.default_rng(seed)
    n = n or int(random.choice([150, 400, 1000]))
    u = draw_input(random, kind or SIGNALS[seed % len(SIGNALS)], n)
    y = draw_plant(random, u)
    size = random.uniform(0.01, 0.2) * y.std()
    noise = size * (random.standard_normal(n) if random.random() < 0.5 else random.uniform(-1.7, 1.7, n))
    return u, y, noise


def dataset(u, y, **others):
    return Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=0.1, units={"y": "bar"}, **others)


def kinds(data):
    return [fault.kind for fault in data_faults(data)]


def test_silent_on_clean_records():
    found = Counter()
    for seed in range(300):
        u, y, noise = clean(seed)
        found.update(set(kinds(dataset(u, y + noise))) - {"excitation"})
    assert all(count <= 3 for count in found.values()), found


def test_silent_without_noise():
    found = Counter()
    for seed in range(70):
        u, y, _ = clean(seed)
        found.update(set(kinds(dataset(u, y))) - {"excitation"})
    assert not found, found


@pytest.mark.parametrize("bits", [3, 4, 5])
def test_a_rounded_output_is_found_with_its_step(bits):
    hits = 0
    for seed in range(40):
        u, y, noise = clean(seed)
        y = y + 0.1 * noise
        step = np.ptp(y) / 2**bits
        rounded = step * np.round(y / step)
        faults = [f for f in data_faults(dataset(u, rounded)) if f.kind == "quantisation" and f.channel == "y"]
        hits += bool(faults) and abs(faults[0].size - step) < 1e-6 * step
    assert hits >= 34


def test_a_fine_grid_is_none_of_our_business():
    u, y, noise = clean(4)
    assert "quantisation" not in kinds(dataset(u, np.round(y + noise, 4)))


def test_the_step_survives_an_offset_and_rounded_printing():
    random = np.random.default_rng(0)
    y = 17.3 + 0.0244 * np.round(random.standard_normal(800) * 8)
    assert quantisation_step(y) == pytest.approx(0.0244, rel=1e-9)
    assert quantisation_step(np.round(y, 3)) == pytest.approx(0.0244, rel=5e-3)


@pytest.mark.parametrize(
    "values", [np.ones(50), np.repeat([0.0, 1.0], 40), np.random.default_rng(1).uniform(0, 1, 900)]
)
def test_no_step_without_a_grid(values):
    assert quantisation_step(values) is None


def test_a_rounded_input_is_found_and_a_command_is_not():
    t = np.arange(800)
    u, _, _ = clean(2, "multisine", 800)
    y = draw_plant(np.random.default_rng(0), u) + 0.1 * np.random.default_rng(1).standard_normal(800)
    assert ("quantisation", "u") in [
        (f.kind, f.channel) for f in data_faults(dataset(0.5 * np.round(np.sin(0.02 * t) * 10), y))
    ]
    command = np.repeat(np.arange(20.0), 40)
    assert "quantisation" not in kinds(dataset(command, y))


def test_a_limited_output_is_found():
    hits = 0
    for seed in range(40):
        u, y, noise = clean(seed)
        y = y + noise
        top = np.quantile(y, 0.9)
        faults = [f for f in data_faults(dataset(u, np.minimum(y, top))) if f.kind == "saturation"]
        hits += bool(faults) and faults[0].size == top
    assert hits >= 37


def test_a_frozen_sensor_is_found():
    hits = 0
    for seed in range(60):
        u, y, noise = clean(seed, ("prbs", "multisine", "noise")[seed % 3])
        y = y + noise
        y[70:100] = y[70]
        faults = [f for f in data_faults(dataset(u, y)) if f.kind in ("frozen", "saturation")]
        hits += bool(faults) and (0, 70, 100) in faults[0].samples
    assert hits >= 58


def test_glitches_are_found_where_they_are():
    right, wrong = 0, 0
    for seed in range(60):
        u, y, noise = clean(seed, n=600)
        y = y + noise
        where = np.array([100, 250, 251, 480])
        y[where] += np.array([1, -1, -1, 1]) * 3 * y.std()
        faults = [f for f in data_faults(dataset(u, y)) if f.kind == "outliers" and f.channel == "y"]
        marked = {start for f in faults for _, start, _ in f.samples}
        right += len(marked & set(where.tolist()))
        wrong += len(marked - set(where.tolist()))
    assert right >= 0.8 * 4 * 60
    assert wrong <= 2


def test_glitches_beside_each_other_are_found():
    values = 0.1 * np.random.default_rng(0).uniform(-1, 1, 300)
    where = [100, 102, 200, 202, 204]
    values[where] += [-2.0, -3.0, 1.0, -4.0, 2.0]
    assert np.flatnonzero(outlier_mask(values)).tolist() == where


@pytest.mark.parametrize("seed", range(5))
def test_a_heavy_tail_is_no_glitch(seed):
    random = np.random.default_rng(seed)
    assert not outlier_mask(random.laplace(size=2000)).any()
    assert not outlier_mask(np.repeat(random.standard_normal(100), 10) + 0.01 * random.standard_normal(1000)).any()


def test_the_response_to_a_pulse_is_no_glitch():
    random = np.random.default_rng(0)
    u = random.uniform(-0.05, 0.05, 500)
    u[[100, 300, 400]] += 5
    y = 2 * u + 0.02 * random.standard_normal(500)
    assert not [f for f in data_faults(dataset(u, y)) if f.channel == "y"]


def test_jitter_is_told():
    random = np.random.default_rng(0)
    stamps = 0.1 * np.arange(300) + random.uniform(-0.03, 0.03, 300)
    u, y, noise = clean(4, "noise", 300)
    values, record = resample(stamps, {"u": u, "y": y + noise}, 0.1)
    plain = dataset(values["u"], values["y"])
    data = Dataset(plain.experiments, plain.channels, plain.inputs, plain.outputs, 0.1, resampling=(record,))
    assert "jitter" in kinds(data)
    assert "jitter" not in kinds(plain)


def test_feedback_is_found():
    hits = 0
    for seed in range(30):
        random = np.random.default_rng(seed)
        reference = np.repeat(random.choice([-1.0, 1.0], 800), 12)[:800]
        u, y, x = np.zeros(800), np.zeros(800), 0.0
        for t in range(1, 800):
            x = 0.9 * x + 0.1 * u[t - 1] + 0.02 * random.standard_normal()
            y[t] = x + 0.02 * random.standard_normal()
            u[t] = 2.0 * (reference[t] - y[t - 1])
        hits += "feedback" in kinds(dataset(u, y))
    assert hits >= 29


@pytest.mark.parametrize("kind", SIGNALS)
def test_no_feedback_with_coloured_noise_and_slow_plants(kind):
    for seed in range(10):
        random = np.random.default_rng(seed)
        u = draw_input(random, kind, 800)
        y = lfilter([0.02], [1, -0.98], u) + 0.05 * lfilter([1.0], [1, -0.95], random.standard_normal(800))
        assert feedback([u], [y]).chance > 1e-7


def test_poor_inputs_are_told():
    noise = np.random.default_rng(0).standard_normal(300)
    warned = data_faults(dataset(np.ones(300), noise))
    assert [(f.kind, f.severity) for f in warned] == [("excitation", "warning")]
    note = data_faults(dataset(np.sin(0.3 * np.arange(300)), noise))
    assert [(f.kind, f.size, f.severity) for f in note] == [("excitation", 2.0, "note")]


def test_several_experiments_and_json():
    u, y, noise = clean(1, "noise", 400)
    first, second = dataset(u, y + noise), dataset(u, y - noise)
    y2 = np.array(y - noise)
    y2[200] += 5 * y.std()
    third = dataset(u, y2)
    data = Dataset.merge([first, *(d.with_experiments([renamed(d, k)]) for k, d in enumerate([second, third]))])
    (fault,) = data_faults(data)
    assert fault.samples == ((2, 200, 201),)
    assert "bar" in str(fault)
    json.dumps([fault.to_dict()], allow_nan=False)


def renamed(data, k):
    run = data.experiments[0]
    return type(run)(f"run{k}", run.values)


def test_bad_values_are_refused():
    with pytest.raises(DataError, match="finite"):
        quantisation_step([1.0, np.nan])
    with pytest.raises(DataError, match="vector"):
        outlier_mask(np.ones((3, 3)))
