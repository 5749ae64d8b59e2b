"""Estimates of a channel without its noise."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from relaxations.algebra.arrays import Array
from smid.data import Dataset
from smid.data.estimates import estimate_names, levels, smoothed, with_estimates
from smid.signals import multisine, noise, prbs


def left(estimate: Array, true: Array, recorded: Array) -> float:
    """Return the error of an estimate as a share of the noise."""
    return float(np.std(estimate - true) / np.std(recorded - true))


@pytest.mark.parametrize("seed", range(5))
def test_a_sum_of_sines_is_told_by_its_neighbours(seed: int) -> None:
    true = multisine(1000, seed=seed, lines=tuple(range(1, 20)))
    recorded = true + 0.3 * noise(1000, seed=seed + 10)
    assert left(smoothed(recorded), true, recorded) < 0.6


@pytest.mark.parametrize("seed", range(5))
def test_levels_are_told_by_samples_that_are_alike(seed: int) -> None:
    true = prbs(1000, seed=seed, clock_period=5)
    recorded = true + 0.2 * noise(1000, seed=seed + 10)
    assert left(levels(recorded, 0.2), true, recorded) < 0.3
    assert left(smoothed(recorded), true, recorded) > 0.8


@settings(deadline=None)
@given(st.floats(0.01, 100), st.booleans(), st.floats(-100, 100), st.integers(0, 5))
def test_units_and_origin_change_nothing(size: float, turned: bool, shift: float, seed: int) -> None:
    x = prbs(200, seed=seed, clock_period=4) + 0.2 * noise(200, seed=seed)
    factor = -size if turned else size
    for estimate in (smoothed, lambda samples: levels(samples, 0.2)):
        expected = factor * estimate(x) + shift
        np.testing.assert_allclose(estimate(factor * x + shift), expected, atol=1e-6 * (size + abs(shift)))


@pytest.mark.parametrize("x", [np.zeros(0), np.ones(1), np.arange(20.0), np.full(400, 3.0)])
def test_what_is_too_short_or_constant_stays(x: Array) -> None:
    np.testing.assert_allclose(smoothed(x), x)
    if x.size and not x.std():
        np.testing.assert_allclose(levels(x, 0.2), x)


def test_each_experiment_has_its_own_estimate_and_outputs_may_be_missing() -> None:
    u, y = noise(300, seed=1), noise(300, seed=2)
    y[250] = np.nan
    whole = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0, units={"u": "V"})
    names = estimate_names("u")
    found = with_estimates(whole, [*names, "y", "unknown__smoothed"])
    assert found.names == ("u", "y", *names)
    assert {(c.unit, c.estimate_of) for c in found.channels[2:]} == {("V", "u")}
    assert (found.inputs, found.outputs) == (whole.inputs, whole.outputs)
    first, _ = whole.split(0.5)
    np.testing.assert_array_equal(with_estimates(first, names).values(names[0]), smoothed(u[:150]))
    assert with_estimates(found, names) is found
