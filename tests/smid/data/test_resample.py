import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from smid.data import DataError
from smid.data.columns import Table
from smid.data.resample import LONGEST, check_increasing, resample, uniform_interval

intervals = st.lists(st.floats(0.5, 1.5), min_size=2, max_size=40)


@settings(deadline=None)
@given(st.integers(2, 500), st.floats(1e-4, 1e3), st.floats(-1e3, 1e3))
def test_regular_stamps_are_recognised_and_kept(n, interval, start):
    stamps = start + interval * np.arange(n)
    if interval < 1e-8 * abs(start):
        return
    found = uniform_interval(stamps)
    assert found == pytest.approx(interval, rel=1e-5)
    y = np.cos(np.arange(n))
    values, record = resample(stamps, {"y": y}, found)
    assert record.method == "none"
    assert values["y"] is y


@settings(deadline=None)
@given(intervals, st.floats(-5, 5), st.floats(-5, 5), st.floats(0.1, 1.0))
def test_straight_lines_are_resampled_exactly(steps, slope, offset, interval):
    stamps = np.r_[0.0, np.cumsum(steps)]
    values, record = resample(stamps, {"y": offset + slope * stamps}, interval)
    if record.method == "linear":
        grid = interval * np.arange(values["y"].size)
        there = np.isfinite(values["y"])
        np.testing.assert_allclose(values["y"][there], (offset + slope * grid)[there], atol=1e-4 * max(1, abs(slope)))
        assert record.curvature_error["y"] < 1e-9
        assert grid[-1] <= stamps[-1] + 1e-5
        # A sample is missing exactly inside an interval that is much longer than usual.
        longest = LONGEST * max(np.median(np.diff(stamps)), interval)
        within = np.diff(stamps)[np.clip(np.searchsorted(stamps, grid, side="right") - 1, 0, len(steps) - 1)]
        assert (within[~there] > longest).all()
        near = np.abs(grid[:, None] - stamps).min(axis=1) <= 1e-5
        assert (there | near | (within > longest)).all()


@settings(deadline=None)
@given(intervals, st.integers(0, 2**32 - 1))
def test_interpolation_keeps_noise_bounds(steps, seed):
    stamps = np.r_[0.0, np.cumsum(steps)]
    noise = np.random.default_rng(seed).uniform(-1, 1, stamps.size)
    values, _ = resample(stamps, {"noise": noise}, 0.37)
    assert np.nanmax(np.abs(values["noise"])) <= np.max(np.abs(noise)) + 1e-12


def test_curvature_error_covers_the_error_of_a_parabola():
    stamps = np.r_[0.0, np.cumsum(np.random.default_rng(1).uniform(0.5, 1.5, 50))]
    values, record = resample(stamps, {"y": 0.3 * stamps**2}, 0.25)
    error = np.max(np.abs(values["y"] - 0.3 * (0.25 * np.arange(values["y"].size)) ** 2))
    assert 0 < error <= record.curvature_error["y"] <= 4 * error


def test_curvature_error_is_an_eighth_of_the_second_difference_at_equal_intervals():
    values = {"y": np.array([0.0, 1.0, 5.0, 6.0])}
    assert resample(np.arange(4.0), values, 0.3)[1].curvature_error["y"] == pytest.approx(3 / 8)


@pytest.mark.parametrize(
    ("printed", "interval"),
    [
        ("%.2f", 1 / 3),
        ("%.3f", 1 / 60),
        ("%.4g", 0.02),
        ("%.6g", 0.013),
        ("%.5e", 0.1),
    ],
)
def test_rounding_of_printed_stamps_is_no_jitter(printed, interval):
    cells = [printed % (interval * k) for k in range(200)]
    table = Table("run", "run.csv", {"time": cells})
    found = uniform_interval(table.numbers("time"), table.resolution("time"))
    assert abs(found - interval) * 199 <= 2 * table.resolution("time")


def test_a_missing_row_leaves_a_missing_sample():
    cells = ["0", "1", "2", "4", "5", "6"]
    table = Table("run", "run.csv", {"time": cells})
    assert uniform_interval(table.numbers("time"), table.resolution("time")) == 1.0
    values, record = resample(table.numbers("time"), {"y": np.arange(6.0)}, 1.0, table.resolution("time"))
    np.testing.assert_array_equal(values["y"], [0, 1, 2, np.nan, 3, 4, 5])
    assert record.method == "none"


def test_a_missing_cell_spreads_only_over_the_samples_that_would_use_it():
    stamps = np.array([0.0, 1.1, 2.0, 2.9, 4.0, 5.0])
    values, record = resample(stamps, {"y": np.array([0.0, 1, np.nan, 3, 4, 5])}, 1.0)
    assert record.method == "linear"
    assert np.isnan(values["y"]).tolist() == [False, False, True, False, False, False]
    values, _ = resample(stamps, {"y": np.array([0.0, np.nan, 2, 3, 4, 5])}, 1.0)
    assert np.isnan(values["y"]).tolist() == [False, True, False, False, False, False]


def test_the_interval_is_the_shortest_decimal_that_fits():
    assert uniform_interval(np.arange(1000) * 0.1) == 0.1
    assert uniform_interval(1.7e9 + np.arange(1000) * 0.01) == 0.01


def test_short_records_have_no_curvature():
    assert resample(np.array([0.0, 1.0]), {"y": np.array([0.0, 1.0])}, 0.4)[1].curvature_error["y"] == 0.0


def test_stamps_are_checked():
    check_increasing(np.array([0.0, 0.5, 2.0]), "run.csv")
    with pytest.raises(DataError, match="row 2"):
        check_increasing(np.array([0.0, -1.0]), "run.csv")
