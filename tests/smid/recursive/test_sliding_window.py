"""A sliding window gives what identification gives on its samples, and a window without parameters proves a change."""

import numpy as np
import pytest
from scipy.signal import lfilter

from smid import DataError, Dataset, ModelError, OutputError, identify
from smid.models import Line, Measurement, Model, Parameter, signal, t
from smid.recursive.set_history import Change
from smid.recursive.sliding_window import SlidingWindow


def record(poles, n=60, at=60, bound=0.05):
    generator = np.random.default_rng(3)
    u, w = generator.choice([-1.0, 1.0], n), [0.0]
    for k in range(1, n):
        w.append(poles[int(k >= at)] * w[-1] + u[k - 1])
    return u, np.array(w) + bound * generator.uniform(-1, 1, n), bound


def test_the_intervals_are_those_of_the_last_samples():
    u, y, bound = record((0.8, 0.8))
    model = OutputError(stable=True)
    estimator = SlidingWindow(model, bound, window=25, every=20)
    for k, sample in enumerate(zip(u, y, strict=True)):
        assert estimator.update(*sample) is None
        if k < 39:  # the first computation with a full window
            assert [(i.lower, i.upper) for i in estimator.intervals] == [(-1.0, 1.0), (-np.inf, np.inf)]
    data = Dataset.from_arrays(input={"u": u[35:60]}, output={"y": y[35:60]}, sampling_time=1.0)
    expected = identify(model, data, bound).intervals
    assert estimator.intervals == expected
    history = estimator.history
    assert history.lower.shape == (60, 2)
    np.testing.assert_array_equal(history.upper[59], [i.upper for i in expected])
    assert (history.upper[58] != history.upper[59]).all()
    assert (history.lower <= [-0.8, 1.0]).all()
    assert (history.upper >= [-0.8, 1.0]).all()
    assert history.plot().axes  # ends that are infinite are left out


def test_an_empty_window_is_a_change():
    u, y, bound = record((0.8, 0.5), at=30)
    estimator = SlidingWindow(OutputError(stable=True), bound, window=20, every=10)
    found = [estimator.update(*sample) for sample in zip(u, y, strict=True)]
    (change,) = (c for c in found if c is not None)
    assert change == Change(21, 39)
    assert estimator.empty == 39
    a1, b0 = estimator.intervals
    assert a1.lower < -0.5 < a1.upper < -0.3
    assert b0.lower < 1.0 < b0.upper


def test_a_window_of_a_constant_input_says_nothing():
    estimator = SlidingWindow(OutputError(stable=True), 0.1, window=20, every=10)
    for y in lfilter([0.0, 1.0], [1.0, -0.5], np.ones(40)):
        assert estimator.update(1.0, y) is None
    assert estimator.intervals[0].width == 2.0


def test_bad_input():
    model = OutputError(stable=True)
    with pytest.raises(ModelError, match="window = 3, every = 1: the model needs windows of 4 samples"):
        SlidingWindow(model, 0.1, window=3, every=1)
    with pytest.raises(ModelError, match="every = 0"):
        SlidingWindow(model, 0.1, every=0)
    with pytest.raises(ModelError, match="noise_bound = -1"):
        SlidingWindow(model, -1)
    c = Parameter("c")
    line = Line(signal("w")[t], c.symbol * signal("u")[t - 1] + signal("v")[t - 1])
    with pytest.raises(ModelError, match="one input and one output"):
        SlidingWindow(Model("two inputs", (c,), (line,), (Measurement("y", "w", "eta"),)), 0.1)
    estimator = SlidingWindow(model, 0.1)
    with pytest.raises(DataError, match="sample 0: the input is nan"):
        estimator.update(np.nan, 0.0)
    assert estimator.history.lower.shape == (0, 2)
