"""A refinement only removes what no parameters explain, and reaches nearly the batch intervals."""

import numpy as np
import pytest
from scipy.signal import lfilter

from smid import Dataset, ModelError, OutputError
from smid.identification.windows.scan import Scan
from smid.recursive import Arx, RecursiveSet

INSIDE = 1 - 1e-12  # the simulated output is rounded: the noise stays off its bound by that much
TWO, THREE = (np.poly([0.8, 0.6])[1:], [1.0, 0.5]), (np.poly([0.5, 0.5 + 0.4j, 0.5 - 0.4j]).real[1:], [1.0, 0.5, 0.2])


def simulated(a, b, n, seed, *, kind="uniform", held=1):
    """Return input, output and noise bound."""
    generator = np.random.default_rng(seed)
    u = np.repeat(generator.choice([-1.0, 1.0], n), held)[:n]
    w = lfilter(np.append(0.0, b), np.append(1.0, a), u)
    bound = 0.05 * float(np.abs(w).max())
    noise = generator.uniform(-1, 1, n) if kind == "uniform" else generator.choice([-1.0, 1.0], n)
    return u, w + bound * INSIDE * noise, bound


def fed(u, y, bound, a, b, **options):
    bounds = {f"b{j}": (-20.0, 20.0) for j in range(len(b))}
    estimator = RecursiveSet(Arx(len(a), len(b) - 1), bound, bounds, **options)
    for sample in zip(u.tolist(), y.tolist(), strict=True):
        estimator.update(*sample)
    return estimator


def holds(estimator, theta):
    return bool((estimator.lower <= theta).all() and (theta <= estimator.upper).all())


@pytest.mark.parametrize("plant", [TWO, THREE], ids=["2 poles", "3 poles"])
@pytest.mark.parametrize("kind", ["uniform", "extreme"])
@pytest.mark.parametrize("held", [1, 3])
def test_the_truth_stays_inside(plant, kind, held):
    a, b = plant
    theta = np.append(a, b)
    for seed in range(2):
        estimator = fed(*simulated(a, b, 150, seed, kind=kind, held=held), a, b)
        before = estimator.upper - estimator.lower
        assert estimator.refine(6) is None
        assert holds(estimator, theta)
        assert (estimator.upper - estimator.lower <= before).all()
        np.testing.assert_array_equal(estimator.history.upper[-1], estimator.upper)


@pytest.mark.parametrize("seed", [3, 4])
def test_two_poles_are_at_most_three_times_as_wide_as_they_must_be(seed):
    a, b = TWO
    u, y, bound = simulated(a, b, 250, seed)
    estimator = fed(u, y, bound, a, b)
    estimator.refine(16)
    # The oracle: extreme free runs within the noise bound, found by a local search.
    data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    bounds = {"a1": (-2.0, 2.0), "a2": (-1.0, 1.0), "b0": (-20.0, 20.0), "b1": (-20.0, 20.0)}
    scan = Scan(OutputError(2, 1, bounds=bounds), data, {"y": bound})
    for own in estimator.intervals:
        low, high = (scan.extreme(own.name, sign).value for sign in (1, -1))
        assert own.lower <= low < high <= own.upper
        assert own.width < 3.0 * (high - low)


def test_equations_that_carried_an_end_are_used_after_the_memory_has_lost_them():
    a, b = TWO
    u, y, bound = simulated(a, b, 260, 2)
    u[150:] = 1.0  # no information
    y[150:] = lfilter(np.append(0.0, b), np.append(1.0, a), u)[150:]
    whole, kept, lost = (fed(u[:120], y[:120], bound, a, b, memory=memory) for memory in (400, 100, 100))
    kept.refine(4)
    for estimator in (whole, kept, lost):
        for sample in zip(u[120:].tolist(), y[120:].tolist(), strict=True):
            estimator.update(*sample)
        estimator.refine(8)
        assert holds(estimator, np.append(a, b))
    widths = [(e.upper - e.lower).sum() for e in (whole, kept, lost)]
    assert widths[0] <= 1.01 * widths[1]
    assert widths[1] < 0.95 * widths[2]


def test_a_change_that_updates_miss_empties_the_set():
    a, b = TWO
    u, y, bound = simulated(a, b, 300, 3)
    estimator = fed(u, y + np.where(np.arange(300) < 150, 0.0, 0.9 * bound), bound, a, b)
    if estimator.empty is None:
        change = estimator.refine()
        assert change is not None
        assert change.sample == 299
        assert estimator.history.changes == (change,)
    assert estimator.refined_at is None
    assert "not refined" in estimator.state


def test_nothing_to_refine():
    estimator = RecursiveSet(Arx(), 0.1, {"b0": (-1.0, 1.0)})
    assert estimator.refine() is None
    estimator.update(1.0, 0.0)
    assert estimator.refine() is None
    with pytest.raises(ModelError, match="pieces = 0 is refused: give 1 or more"):
        estimator.refine(0)


@pytest.mark.parametrize("error", ["output", "equation"])
def test_a_refinement_without_poles_and_of_equation_errors(error):
    generator = np.random.default_rng(5)
    u = generator.choice([-1.0, 1.0], 100)
    y = lfilter([0.0, 1.0, 0.5], [1.0], u) + 0.1 * INSIDE * generator.uniform(-1, 1, 100)
    estimator = fed(u, y, 0.1, [], [1.0, 0.5], error=error, input_noise_bound=0.01)
    estimator.refine()
    assert holds(estimator, [1.0, 0.5])
