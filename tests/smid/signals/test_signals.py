"""Signals have the range, the levels and the spectrum that they promise, and come again from the same seed."""

import inspect

import numpy as np
import pytest

from smid.data import DataError
from smid.signals import SIGNALS, multisine, noise, noisy_staircase, prbs, qprts, ramp, sine, staircase, step
from smid.signals.prbs import TAPS

RANDOM = [name for name, function in SIGNALS.items() if "seed" in inspect.signature(function).parameters]


def test_every_signal_is_registered():
    assert len(SIGNALS) == 13
    assert RANDOM == ["multisine", "noise", "noisy_staircase", "prbs", "qprs", "qprts"]


@pytest.mark.parametrize("name", SIGNALS)
def test_length_type_and_refusal(name):
    seed = {"seed": 3} if name in RANDOM else {}
    signal = SIGNALS[name](60, **seed)
    assert signal.shape == (60,)
    assert signal.dtype == np.float64
    with pytest.raises(DataError, match="not a number of samples"):
        SIGNALS[name](0, **seed)


@pytest.mark.parametrize("name", RANDOM)
def test_a_seed_or_its_generator_determines_the_signal(name):
    first = SIGNALS[name](100, seed=3)
    np.testing.assert_array_equal(first, SIGNALS[name](100, seed=3))
    np.testing.assert_array_equal(first, SIGNALS[name](100, seed=np.random.default_rng(3)))
    assert (first != SIGNALS[name](100, seed=4)).any()


@pytest.mark.parametrize("order", range(2, 13))
def test_a_register_runs_through_its_whole_period(order):
    period = 2**order - 1
    signal = prbs(2 * period, seed=order, order=order)
    np.testing.assert_array_equal(signal[:period], signal[period:])
    assert signal[:period].sum() == 1
    power = np.abs(np.fft.rfft(signal[:period])[1:]) ** 2
    np.testing.assert_allclose(power, period + 1, rtol=1e-9)


@pytest.mark.parametrize("order", [13, 14, 15])
def test_long_registers_have_no_shorter_period(order):
    assert order in TAPS
    bits = (prbs(2**order - 1 + order, seed=1, order=order) > 0).astype(int)
    words = sum(bits[k : k + 2**order - 1] << k for k in range(order))
    assert len(np.unique(words)) == 2**order - 1


def test_a_clock_holds_the_levels():
    signal = prbs(1000, seed=2, sampling_time=0.1, clock_period=0.5, amplitude=3, offset=1)
    assert set(signal.tolist()) == {-2.0, 4.0}
    assert (np.flatnonzero(np.diff(signal)) % 5 == 4).all()
    with pytest.raises(DataError, match=r"clock_period = 0\.25 s is not a whole number of samples"):
        prbs(10, seed=2, sampling_time=0.1, clock_period=0.25)
    with pytest.raises(DataError, match="order = 1 is not supported"):
        prbs(10, seed=2, order=1)


def test_the_trinary_signal_has_the_levels_of_the_thesis():
    signal = qprts(40_000, seed=1)
    levels = np.unique(signal.round(9))
    expected = {round(0.5 + a + b + c, 9) for a in (-0.2, 0, 0.2) for b in (-0.1, 0, 0.1) for c in (-0.05, 0, 0.05)}
    assert set(levels.tolist()) == expected
    # Variance of three equally likely levels is 2/3 of the squared spacing.
    assert signal.var() == pytest.approx(2 / 3 * (0.2**2 + 0.1**2 + 0.05**2), rel=0.05)
    coarse = qprts(400, seed=1, periods=(20,), spacings=(0.2,))
    assert (np.flatnonzero(np.diff(coarse)) % 20 == 19).all()
    with pytest.raises(DataError, match="one spacing per period"):
        qprts(10, seed=1, periods=(1,), spacings=(1, 2))


def test_spectra():
    flat = multisine(200, seed=5, lines=(2, 5, 9), amplitude=2, offset=7)
    found = np.abs(np.fft.rfft(flat - 7))
    np.testing.assert_array_equal(np.flatnonzero(found > 1e-9), [2, 5, 9])
    np.testing.assert_allclose(found[[2, 5, 9]], found[2])
    assert np.abs(flat - 7).max() == pytest.approx(2)
    one = sine(100, sampling_time=0.01, frequency=4, amplitude=3, offset=1)
    assert np.argmax(np.abs(np.fft.rfft(one - 1))) == 4
    with pytest.raises(DataError, match="numbers from 1 to 4"):
        multisine(10, seed=1, lines=(5,))


def test_ranges():
    white = noise(5000, seed=2, amplitude=0.5, offset=2)
    assert np.abs(white - 2).max() <= 0.5
    assert white.var() == pytest.approx(0.5**2 / 3, rel=0.05)
    stairs = staircase(500, period=4, sampling_time=0.5, steps=3, amplitude=0.6, offset=0.5)
    assert len(np.unique(stairs.round(9))) == 7
    assert (stairs.min(), stairs.max()) == pytest.approx((-0.1, 1.1))
    assert set(np.unique(np.diff(stairs).round(9)).tolist()) == {-0.2, 0.0, 0.2}
    noisy = noisy_staircase(500, seed=1, steps=3, noise_amplitude=0.01)
    assert 0 < np.abs(noisy - staircase(500, steps=3)).max() <= 0.01
    with pytest.raises(DataError, match="leave no level"):
        staircase(5, steps=0)


def test_corners_and_levels():
    times = 0.1 * np.arange(50)
    np.testing.assert_allclose(
        ramp(50, sampling_time=0.1, corners=[(1, 0), (2, 1), (4, 0.5)], amplitude=100, offset=5),
        5 + 100 * np.interp(times, [1, 2, 4], [0, 1, 0.5]),
    )
    stepped = step(50, sampling_time=0.1, levels=[(0.3, 1), (0.7, 0.2)], amplitude=10)
    np.testing.assert_array_equal(stepped[[2, 3, 6, 7]], [0, 10, 10, 2])
    assert step(20)[[1, 2]].tolist() == [0, 1]
    assert ramp(1).tolist() == [0]
    for wrong in ([(1, 0), (1, 1)], [1, 2]):
        with pytest.raises(DataError, match="rising times"):
            ramp(5, corners=wrong)
        with pytest.raises(DataError, match="rising times"):
            step(5, levels=wrong)
    with pytest.raises(DataError, match="positive number of seconds"):
        ramp(5, sampling_time=0)
