"""Spectra integrate to the variance, coherence is that of theory, and the hidden delay is found."""

import numpy as np
import pytest
from scipy.signal import lfilter

from smid import DataError, Dataset
from smid.signals import delay_estimate, spectrum


def record(u: object, y: object, sampling_time: float = 0.1) -> Dataset:
    return Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=sampling_time, units={"y": "bar"})


def white(seed: int, n: int = 600) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(n)


def test_a_spectrum_integrates_to_the_variance() -> None:
    y = lfilter([1], [1, -0.5], white(0, 20_000))
    found = spectrum(record(white(1, 20_000), y), segment=500)
    assert found.frequency[[0, -1]].tolist() == pytest.approx([0.02, 5.0])
    assert np.sum(found.density["y"]) * 0.02 == pytest.approx(y.var(), rel=0.03)
    # |1 / (1 - 0.5 exp(-j w))|^2, times 2 Ts for one side
    transfer = 1 / np.abs(1 - 0.5 * np.exp(-2j * np.pi * found.frequency * 0.1)) ** 2
    assert np.median(found.density["y"] / (2 * 0.1 * transfer)) == pytest.approx(1, abs=0.05)


def test_white_noise_keeps_its_band_and_unrelated_signals_their_coherence() -> None:
    found = [spectrum(record(white(seed), white(1000 + seed))) for seed in range(100)]
    inside = []
    for one in found:
        low, high = one.white
        level = np.mean(one.density["y"])
        inside.append(np.mean((one.density["y"] > low * level) & (one.density["y"] < high * level)))
    assert np.mean(inside) == pytest.approx(0.99, abs=0.01)
    assert np.mean([np.mean(one.coherence["u", "y"] > one.level) for one in found]) == pytest.approx(0.01, abs=0.005)


def test_coherence_is_the_share_that_the_input_explains() -> None:
    u, noise = white(0, 50_000), white(1, 50_000)
    found = spectrum(record(u, u + noise), segment=200)
    assert np.mean(found.coherence["u", "y"]) == pytest.approx(0.5, abs=0.02)


def test_experiments_are_averaged_by_their_segments() -> None:
    parts = [record(white(s, n), white(50 + s, n)) for s, n in ((0, 64), (1, 128), (2, 20))]
    runs = [type(p.experiments[0])(str(k), p.experiments[0].values) for k, p in enumerate(parts)]
    found = spectrum(parts[0].with_experiments(runs), segment=32)
    single = [spectrum(part, segment=32).density["y"] for part in parts[:2]]
    np.testing.assert_allclose(found.density["y"], (3 * single[0] + 7 * single[1]) / 10)
    assert found.segments == pytest.approx(18 * 100 / 189)


def plant(seed: int, kind: str, delay: int, noise: float = 0.1) -> Dataset:
    inputs = {
        "white": white(seed),
        "held": np.repeat(np.random.default_rng(seed).choice([-1.0, 1.0], 120), 5),
        "slow": lfilter([1], [1, -0.9], white(seed)),
    }
    u = inputs[kind]
    w = np.concatenate([np.zeros(delay), lfilter([0.2], [1, -0.8], u)[: 600 - delay]])
    return record(u, w + noise * w.std() * lfilter([1], [1, -0.5], white(500 + seed)))


@pytest.mark.parametrize("kind", ["white", "held", "slow"])
@pytest.mark.parametrize("delay", [0, 7])
def test_the_hidden_delay_is_found(kind: str, delay: int) -> None:
    found = [delay_estimate(plant(seed, kind, delay)) for seed in range(20)]
    assert [one.samples for one in found] == [delay] * 20
    assert found[0].seconds == pytest.approx(0.1 * delay)


def test_unrelated_signals_have_no_delay() -> None:
    found = [delay_estimate(record(lfilter([1], [1, -0.9], white(s)), lfilter([1], [1, -0.8], white(900 + s))))
             for s in range(20)]  # fmt: skip
    assert [one.samples for one in found] == [None] * 20
    assert found[0].seconds is None
    assert "No delay found" in str(found[0])
    assert found[0].rise[-1] <= found[0].band[-1]


def test_chance_exceeds_the_band_in_one_of_a_hundred_records() -> None:
    found = (delay_estimate(record(white(seed), white(7000 + seed))) for seed in range(300))
    beyond = [one.rise[-1] > one.band[-1] for one in found]
    assert np.mean(beyond) == pytest.approx(0.01, abs=0.015)


def test_units_do_not_matter() -> None:
    data = plant(3, "held", 7)
    other = record(1e6 * data.values("u") + 1e7, 1e-6 * data.values("y") - 3)
    first, second = delay_estimate(data), delay_estimate(other)
    assert first.samples == second.samples
    np.testing.assert_allclose(first.rise, second.rise, rtol=1e-4, atol=1e-6)
    coherences = [spectrum(one).coherence["u", "y"] for one in (data, other)]
    np.testing.assert_allclose(*coherences, rtol=1e-4)


def test_feedback_is_not_taken_for_a_delay() -> None:
    u, y, noise = np.zeros(600), np.zeros(600), white(0)
    dither = white(1)
    for k in range(600):
        y[k] = (0.5 * y[k - 1] if k else 0.0) + (u[k - 4] if k >= 4 else 0.0) + 0.3 * noise[k]
        u[k] = -0.1 * y[k] + dither[k]
    assert delay_estimate(record(u, y)).samples == 4


def test_the_other_input_is_accounted_for() -> None:
    u, v = white(0), lfilter([1], [1, -0.9], white(1))
    y = np.concatenate([np.zeros(5), u[:-5]]) + np.concatenate([np.zeros(2), v[:-2]]) + 0.1 * white(2)
    data = Dataset.from_arrays(input={"u": u, "v": v}, output={"y": y}, sampling_time=1.0)
    assert [delay_estimate(data, input=name).samples for name in "uv"] == [5, 2]


@pytest.mark.parametrize(
    ("work", "words"),
    [
        (lambda: delay_estimate(record(white(0), np.ones(600))), "channel 'y' is constant"),
        (lambda: delay_estimate(record(white(0), white(1)), output="z"), "no channel 'z'"),
        (lambda: delay_estimate(record(white(0, 60), white(1, 60))), "30 samples after the first 30 are too few"),
        (lambda: delay_estimate(record(white(0), white(1)), longest=0), "longest = 0 leaves no delay to test"),
        (lambda: spectrum(record(white(0), np.ones(600))), "the output 'y' is constant: it has no spectrum"),
        (lambda: spectrum(record(white(0, 20), white(1, 20))), "needs two segments of 16: take a longer record"),
        (lambda: spectrum(record(white(0), white(1)), segment=4), "segment = 4 is too short"),
    ],
)  # fmt: skip
def test_a_mistake_is_told_in_one_line(work: object, words: str) -> None:
    with pytest.raises(DataError, match=words) as told:
        work()  # type: ignore[operator]
    assert "\n" not in str(told.value)
