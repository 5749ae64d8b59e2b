"""Missing samples are no constraint: intervals hold the truth, and nothing is interpolated into a proof."""

import numpy as np
import pandas as pd
import pytest

import smid
from smid.data import Dataset
from smid.models import OutputError
from smid.validation.validate import validate

N, BOUND = 200, 0.05
TRUTH = {"a1": -0.8, "b0": 0.4}
MODEL = OutputError(na=1, stable=True)


def measured(seed):
    """Return a simulated record as a frame; noise is drawn near its bound, where an invented sample shows."""
    random = np.random.default_rng(seed)
    u = np.repeat(random.choice([-1.0, 1.0], N // 5), 5) + random.uniform(-0.2, 0.2, N)
    w = np.zeros(N)
    for k in range(1, N):
        w[k] = 0.8 * w[k - 1] + 0.4 * u[k - 1]
    y = w + BOUND * random.choice([-1.0, 1.0], N) * random.uniform(0.8, 1.0, N)
    return pd.DataFrame({"time": 0.1 * np.arange(N), "u": u, "y": y}), random


def lost(kind, random):
    """Return the rows that are missing."""
    return random.choice(N, N // 20, replace=False) if kind == "at random" else np.arange(80, 130)


def dataset(frame):
    return Dataset.from_pandas(frame, "u", "y")


def intervals(data):
    found = smid.identify(MODEL, data, BOUND, rounds=2)
    return {one.name: (one.lower, one.upper) for one in found.intervals}


@pytest.mark.parametrize("kind", ["at random", "one gap"])
@pytest.mark.parametrize("seed", range(3))
def test_intervals_hold_the_truth_and_use_every_part(kind, seed):
    frame, random = measured(seed)
    data = dataset(frame.drop(index=lost(kind, random)))
    found = intervals(data)
    longest = max(data.experiments, key=lambda run: run.n_samples)
    alone = intervals(data.with_experiments([longest]))
    for name, value in TRUTH.items():
        low, high = found[name]
        assert low <= value <= high
        assert high - low <= (alone[name][1] - alone[name][0]) * (1 + 1e-3)
    width = {name: high - low for name, (low, high) in found.items()}
    assert any(width[name] < 0.999 * (alone[name][1] - alone[name][0]) for name in TRUTH)


@pytest.mark.parametrize("column", ["u", "y"])
def test_an_empty_cell_is_left_out_like_its_row(column):
    frame, random = measured(0)
    rows = lost("at random", random)
    whole, holes = frame.copy(), frame.copy()
    holes.loc[rows, column] = np.nan
    for mine, theirs in zip(dataset(holes).experiments, dataset(whole.drop(index=rows)).experiments, strict=True):
        np.testing.assert_array_equal(mine.values["y"], theirs.values["y"])
        assert mine.start_time == pytest.approx(theirs.start_time)


def test_every_sample_is_a_measured_one():
    frame, random = measured(1)
    data = dataset(frame.drop(index=lost("at random", random)))
    for run in data.experiments:
        rows = np.rint(run.start_time / 0.1).astype(int) + np.arange(run.n_samples)
        np.testing.assert_array_equal(run.values["y"], frame["y"].to_numpy()[rows])
    assert "10 of 200 samples are missing" in data.source


def test_fits_and_validation_score_measured_samples_only():
    frame, random = measured(2)
    data = dataset(frame.drop(index=lost("one gap", random)))
    scores = validate(MODEL.with_values(TRUTH), data).scores
    assert sum(score.samples for score in scores) == data.n_samples - MODEL.max_lag * len(data.experiments)
    assert data.n_samples == N - 50
