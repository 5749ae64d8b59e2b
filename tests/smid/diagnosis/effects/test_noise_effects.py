"""Effects on the noise: found where they are, and not taken for what looks like them."""

import re

import numpy as np
import pytest
from scipy.signal import lfilter

from smid import Dataset
from smid.data.estimates import estimate_names, with_estimates
from smid.diagnosis import EFFECTS, Site, diagnose
from smid.models import Model, simulate
from smid.signals import prbs
from tests.smid.diagnosis.lag_records import BOUND, LAG, autoregressive, dead_zone, known_lag, lag, record, steps

BY_NAME = {effect.name: effect for effect in EFFECTS}
TRUE = LAG.with_values({"a1": -0.8, "b0": 0.5})


def detection(name: str, u: np.ndarray, y: np.ndarray, model: Model = TRUE):
    """Ask an effect, of the true model."""
    data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=0.1, units={"u": "V", "y": "bar"})
    return BY_NAME[name].detect(model, Site(data, "u", "y", (y - simulate(model, {"u": u})["y"],)))


def white(seed: int, n: int = 500) -> np.ndarray:
    return np.random.default_rng([seed, 2]).standard_normal(n)


@pytest.mark.parametrize("seed", range(5))
def test_input_noise_is_detected_and_its_size_told(seed):
    u = steps(seed, 500)
    recorded = u + 0.1 * white(seed)
    found = detection("input_noise", recorded, lag(u) + 0.01 * white(seed + 50))
    assert found is not None
    assert found.values["deviation"] == pytest.approx(0.1, rel=0.2)
    assert found.confidence > 0.5
    assert any(m.channel == "u" and m.noise for m in found.model.measurements)
    assert "V RMS" in BY_NAME["input_noise"].describe(found.values, Site(record(u, u), "u", "y"))


def test_white_noise_on_the_output_is_no_input_noise():
    assert not [s for s in range(20) if detection("input_noise", u := steps(s, 500), lag(u) + 0.05 * white(s))]


@pytest.mark.parametrize("pole", [-0.6, 0.4, 0.97])
def test_noise_of_another_colour_is_no_input_noise(pole):
    """0.8 would be the plant's own, and cannot be told from input noise."""
    taken = 0
    for seed in range(10):
        u = steps(seed, 500)
        colour = autoregressive(np.random.default_rng([seed, 3]), 500, pole)
        taken += detection("input_noise", u, lag(u) + 0.05 * colour) is not None
    assert taken <= 1


def test_a_resonant_disturbance_is_no_input_noise():
    for seed in range(5):
        u = steps(seed, 500)
        ringing = lfilter([1.0], [1.0, -1.8 * np.cos(1.0), 0.81], white(seed))
        assert detection("input_noise", u, lag(u) + 0.05 * ringing) is None


@pytest.mark.parametrize("step", [0.05, 0.2])
def test_rounding_is_detected_with_its_step(step):
    u = steps(0, 400)
    y = lag(u) + 0.1 * step * white(0, 400)
    found = detection("quantisation", u, step * np.round(y / step))
    assert found.values["step"] == pytest.approx(step, rel=1e-6)
    assert detection("quantisation", u, y) is None


def test_rounding_below_the_noise_is_no_cause():
    u = steps(0, 400)
    y = lag(u) + 0.1 * white(0, 400)
    assert detection("quantisation", u, 0.05 * np.round(y / 0.05)) is None


def glitched(seed: int, size: float = 5.0) -> tuple[Dataset, Dataset, np.ndarray]:
    """A record without and with six glitches, and where these are; one of them is held out."""
    u = steps(seed, 300)
    clean = record(u, lag(dead_zone(u, 0.3)), seed)
    random = np.random.default_rng(seed)
    places = np.sort(np.append(random.choice(np.arange(5, 200), 5, replace=False), 250))
    y = clean.values("y").copy()
    y[places] += random.choice([-size, size], 6)
    return clean, record(u, y, bound=0.0), places


@pytest.mark.parametrize(("size", "order"), [(5.0, 1), (0.15, -1)])
def test_glitches_are_named_and_no_fit_bends_to_them(size, order):
    """The small ones are hidden by what the base model lacks, and seen when it is named."""
    clean, data, places = glitched(0, size)
    effects = ["outliers", "input_dead_zone"]
    plain, found = (diagnose(LAG, d, BOUND, effects, certify=False, workers=1) for d in (clean, data))
    assert [c.effect for c in plain.causes] == ["input_dead_zone"]
    assert [c.effect for c in found.causes] == effects[::order]
    assert found.model.values == pytest.approx(plain.model.values, abs=5e-3)
    values = {p.name: p.value for p in found.causes[::order][0].parameters}
    assert values["count"] == len(places)
    assert values["size"] == pytest.approx(size, rel=0.1)
    # The glitch in the test part is not judged by.
    assert found.gain.rmse_after == pytest.approx(plain.gain.rmse_after, rel=0.05)
    assert not found.unexplained


def test_interrupted_in_its_second_look_it_tells_what_the_first_has_found():
    _, data, _ = glitched(0, 0.15)
    lines = []

    def progress(line):
        lines.append(line)
        if line.startswith("input_dead_zone") and "searching again" in " ".join(lines):
            raise KeyboardInterrupt

    effects = ["outliers", "input_dead_zone"]
    found = diagnose(LAG, data, BOUND, effects, certify=False, workers=1, progress=progress)
    assert found.interrupted
    assert [c.effect for c in found.causes] == ["input_dead_zone", "outliers"]


def stop_at_the_best(line):
    if line.startswith("best so far"):
        raise KeyboardInterrupt


def test_interrupted_it_still_compares_effects_on_the_noise():
    u, step = steps(0, 500), 0.2
    w = lag(dead_zone(u, 0.3))
    hiding = {
        "quantisation": record(u, step * np.round(w / step), bound=0.0),
        "input_noise": record(u + 0.1 * white(1), w, bound=0.005),
    }
    for name, data in hiding.items():
        effects = ["input_dead_zone", "input_bias", name]
        found = diagnose(LAG, data, None, effects, certify=False, workers=1, progress=stop_at_the_best)
        assert found.interrupted
        assert [c.effect for c in found.causes] == ["input_dead_zone", name]


@pytest.mark.parametrize("stopped", [False, True])
def test_a_limit_that_is_reached_briefly_is_no_glitch(stopped):
    u = steps(0, 400)
    w = lag(u)
    data = record(u, np.minimum(w, np.quantile(w, 0.98)), bound=0.005)
    effects, progress = ["outliers", "output_saturation", "input_bias"], stop_at_the_best if stopped else None
    found = diagnose(LAG, data, None, effects, certify=False, workers=1, progress=progress)
    assert found.interrupted == stopped
    assert [c.effect for c in found.causes] == ["output_saturation"]


def test_what_is_ambiguous_is_told_after_the_rounding():
    u = np.repeat(np.random.default_rng(1).integers(0, 2, 100), 4).astype(float)
    data = record(u, 0.1 * np.round(lag(0.7 * u) / 0.1), bound=0.0)
    effects = ["gain", "input_saturation", "quantisation"]
    found = diagnose(known_lag(), data, None, effects, certify=False, workers=1)
    assert found.verdict == "ambiguous"
    assert set(found.alternatives) == {"gain", "input_saturation"}
    assert [c.effect for c in found.causes][:-1] == ["quantisation"]
    assert found.causes[-1].effect in found.alternatives


def test_glitches_that_nobody_asked_about_stay_in():
    _, data, _ = glitched(0)
    found = diagnose(LAG, data, None, ["input_dead_zone"], certify=False, workers=1)
    assert "outliers" not in [c.effect for c in found.causes]
    assert found.gain.rmse_after > 0.3
    assert [f.kind for f in found.faults].count("outliers") <= 1


def test_input_noise_is_named_by_the_diagnosis_and_put_into_the_model():
    u = steps(1, 500)
    data = record(u + 0.1 * white(1), lag(u), bound=0.005)
    found = diagnose(LAG, data, None, ["input_noise", "input_delay"], certify=False, workers=1)
    assert [c.effect for c in found.causes] == ["input_noise"]
    assert found.verdict == "named"
    assert_noisy(found.model, LAG, "u")
    (size,) = re.findall(r"about ([\d.]+) V RMS", found.causes[0].sentence)
    assert 0.03 < float(size) <= 0.1  # part of the noise is in no estimate


@pytest.mark.parametrize("name", ["input_noise", "multiplicative_noise"])
def test_noise_that_is_much_larger_on_the_test_part_is_not_the_cause(name):
    """There a drift begins that nothing before it shows."""
    u = steps(0, 500)
    w = lag(u)
    noisy = {"input_noise": (u + 0.1 * white(1), w), "multiplicative_noise": (u, w + 0.1 * np.abs(w) * white(2))}
    recorded, y = noisy[name]
    drifted = y + np.maximum(0, np.arange(500) - 400) / 50
    same, other = (diagnose(LAG, record(recorded, one), None, [name], certify=False, workers=1) for one in (y, drifted))
    assert [cause.effect for cause in same.causes] == [name]
    assert other.verdict == "none"
    assert [cause.effect for cause in other.details] == [name]
    assert other.unexplained


def assert_noisy(model, base, channel):
    """Assert that a model is the base model with noise in the record of a channel, and nothing else."""
    assert model.with_values({}).parameters == base.parameters
    assert [m.noise is not None for m in model.measurements if m.channel == channel] == [True]
    assert model.channels == ("u", "y")
    assert len(model.lines) == len(base.lines)


def test_a_noisy_input_is_corrected_by_what_its_own_record_tells():
    """A limit takes noise of the outer levels away too, but less of it."""
    u = np.repeat(np.random.default_rng(3).integers(-2, 3, 120) / 2, 5)
    data = record(u + 0.1 * white(1, 600), lag(u) + 0.005 * white(2, 600), bound=0.02)
    names = ["input_noise", "input_saturation", "input_delay"]
    found = diagnose(LAG, data, None, names, certify=False, workers=1)
    assert found.causes[0].effect == "input_noise"
    assert found.causes[0].label.startswith("levels")
    assert found.gain.rmse_after < 0.5 * found.gain.rmse_before
    assert {"u", "y"} == set(found.model.channels) == set(found.data.names) == set(found.misfit.data.names)


def test_the_input_of_the_test_part_changes_no_number_of_a_noisy_input():
    true = np.repeat(np.random.default_rng(3).integers(-2, 3, 80) / 2, 5)
    u, y = true + 0.1 * white(1, 400), lag(true) + 0.005 * white(2, 400)
    other = np.concatenate([u[:320], white(4, 80)])
    found = [diagnose(LAG, record(x, y, bound=0.02), None, ["input_noise"], certify=False) for x in (u, other)]
    # With another input the test part shows no gain, so that the effect is only a detail.
    (first,), (second,) = ((*one.causes, *one.details) for one in found)
    assert found[0].gain.rmse_after != found[1].gain.rmse_after
    assert first.effect == "input_noise"
    assert first.parameters == second.parameters


def test_a_noisy_input_is_noisy_once_and_before_what_happens_to_it():
    u = prbs(600, seed=3, clock_period=6) + 0.1 * white(1, 600)
    data = with_estimates(record(u, lag(u)), estimate_names("u"))
    site = Site(data, "u", "y")
    first = next(iter(BY_NAME["input_noise"].extensions(LAG, site)))
    assert not list(BY_NAME["input_noise"].extensions(first.model, site))
    limited = next(iter(BY_NAME["input_saturation"].extensions(LAG, site)))
    assert {item.place for item in BY_NAME["input_noise"].extensions(limited.model, site)} == {""}
    # The other effects do not take an estimate for a further measured channel.
    assert not list(BY_NAME["missing_input"].extensions(LAG, site))


def test_what_follows_from_its_own_past_is_hardly_noisy():
    u = np.sin(np.arange(500) / 20)
    data = with_estimates(record(u, lag(u)), estimate_names("u"))
    for item in BY_NAME["input_noise"].extensions(LAG, Site(data, "u", "y")):
        (share,) = (p for p in item.model.parameters if p.name not in {q.name for q in LAG.parameters})
        noise = data.values("u") - data.values(next(c for c in item.model.input_channels if c != "u"))
        assert share.upper * np.std(noise) < 1e-3


@pytest.mark.parametrize("seed", range(5))
def test_noise_that_grows_with_the_level_is_detected_and_its_law_told(seed):
    u = steps(seed, 1000, low=0.0)
    w = lag(u)
    found = detection("multiplicative_noise", u, w + np.hypot(0.02, 0.05 * w) * white(seed, 1000))
    assert found is not None
    assert found.values["share"] == pytest.approx(0.05, rel=0.2)
    assert found.values["floor"] == pytest.approx(0.02, rel=0.5)
    assert "bar RMS at zero" in BY_NAME["multiplicative_noise"].describe(found.values, Site(record(u, u), "u", "y"))


def test_other_noise_does_not_grow_with_the_level():
    taken = 0
    for seed in range(20):
        u = steps(seed, 500, low=0.0)
        w, pink = lag(u), autoregressive(np.random.default_rng([seed, 3]), 500, 0.9)
        with_time, with_speed = np.linspace(0.2, 2, 500), 0.1 + 10 * np.abs(np.gradient(w))
        for noise in (white(seed), pink, with_time * white(seed), with_speed * white(seed)):
            taken += detection("multiplicative_noise", u, w + 0.05 * noise) is not None
    assert taken <= 1


def test_noise_of_the_input_that_a_curve_passes_on_does_not_grow_with_the_level():
    curved = TRUE.insert_before("u", lambda u: u**2)
    for seed in range(10):
        u = steps(seed, 500, low=0.0)
        y = simulate(curved, {"u": u + 0.05 * white(seed)})["y"] + 0.005 * white(seed + 50)
        assert detection("multiplicative_noise", u, y, curved) is None
