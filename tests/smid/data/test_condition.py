"""Trends and frequencies are removed as defined, per experiment, and the source says so."""

import numpy as np
import pytest

from smid import DataError, Dataset

T = 0.01 * np.arange(2000)


def record(y: np.ndarray, u: np.ndarray | None = None) -> Dataset:
    return Dataset.from_arrays(input={"u": y if u is None else u}, output={"y": y}, sampling_time=0.01, T=5 + T)


def test_a_trend_is_removed_from_each_experiment_on_its_own() -> None:
    one, two = record(3 + T), record(1 - 2 * T).experiments[0]
    data = one.with_experiments([one.experiments[0], type(two)("second", two.values)])
    for run in data.detrend("linear").experiments:
        np.testing.assert_allclose(run.values["y"], 0, atol=1e-9)
    for run, raw in zip(data.detrend().experiments, data.experiments, strict=True):
        np.testing.assert_allclose(run.values["y"], raw.values["y"] - raw.values["y"].mean())
        np.testing.assert_array_equal(run.values["T"], raw.values["T"])  # no role, so it is kept
    assert data.detrend().source == "mean of each experiment removed from u, y"
    only = data.detrend(channels="y")
    np.testing.assert_array_equal(only.stacked("u"), data.stacked("u"))


@pytest.mark.parametrize(
    ("edges", "gains"),
    [({"below": 5}, (1, 0, 0)), ({"above": 20}, (0, 0, 1)), ({"above": 2, "below": 20}, (0, 1, 0))],
)
def test_the_filter_keeps_its_frequencies_without_delay(edges: dict[str, float], gains: tuple[int, ...]) -> None:
    tones = [np.sin(2 * np.pi * f * T + 1) for f in (0.5, 8.0, 40.0)]
    kept = sum(gain * tone for gain, tone in zip(gains, tones, strict=True))
    found = record(np.sum(tones, axis=0)).filter(**edges)
    assert np.abs(found.values("y") - kept)[200:-200].max() < 0.03
    np.testing.assert_array_equal(found.values("T"), 5 + T)
    assert "zero-phase Butterworth filter of order 4 keeps" in found.source
    assert found.checksum != record(np.sum(tones, axis=0)).checksum


def test_an_edge_keeps_half_of_the_amplitude() -> None:
    found = record(np.sin(2 * np.pi * 5 * T)).filter(below=5).values("y")[500:-500]
    assert np.abs(found).max() == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda d: d.detrend("quadratic"), "detrend removes 'constant' or 'linear', not 'quadratic'"),
        (lambda d: d.detrend(channels="z"), "no channel 'z'"),
        (lambda d: d.normalise().detrend(), "the data are normalised, .*call it first"),
        (lambda d: d.filter(), "the filter has no edge: give above, below, or both"),
        (lambda d: d.filter(below=50), "an edge at 50 Hz: give one between 0 and 50 Hz, half the sampling rate"),
        (lambda d: d.filter(below=float("nan")), "an edge at nan Hz"),
        (lambda d: d.filter(above=9, below=3), "the band from 9 Hz to 3 Hz is empty"),
        (lambda d: d.filter(below=5, order=0), "the order of the filter is 0: give a whole number from 1 to 10"),
        (lambda d: d.crop(0, 15).filter(below=5), "has 15 samples, and this filter needs 16: lower its order"),
    ],
)
def test_a_mistake_is_told_in_one_line(change: object, words: str) -> None:
    with pytest.raises(DataError, match=words) as told:
        change(record(np.sin(T)))  # type: ignore[operator]
    assert "\n" not in str(told.value)
