"""The parameters never leave the set, a change of the plant empties it, and nothing else does."""

from fractions import Fraction

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.signal import lfilter

from relaxations.search.enclosure import Proof
from smid import DataError, Dataset, ModelError, OutputError, identify
from smid.recursive import Arx, NormalisedGradient, RecursiveEstimator, SlidingWindow
from smid.recursive.locate_change import locate_change
from smid.recursive.set_history import Change
from smid.recursive.set_membership import RecursiveSet

INSIDE = 1 - 1e-12  # the simulated output is rounded: the noise stays off its bound by that much


def noise(generator, n, kind):
    if kind == "uniform":
        return INSIDE * generator.uniform(-1, 1, n)
    held = 1 if kind == "extreme" else 25
    return INSIDE * np.repeat(generator.choice([-1.0, 1.0], n), held)[:n]


def simulated(a, b, n, *, seed, share=0.05, kind="uniform", error="output"):
    """Return input, output and noise bound."""
    generator = np.random.default_rng(seed)
    u = generator.choice([-1.0, 1.0], n)
    denominator = np.append(1.0, a)
    w = lfilter(np.append(0.0, b), denominator, u)
    bound = share * float(np.abs(w).max())
    disturbance = bound * noise(generator, n, kind)
    return u, w + (disturbance if error == "output" else lfilter([1.0], denominator, disturbance)), bound


def box(nb, reach=20.0):
    return {f"b{j}": (-reach, reach) for j in range(nb)}


def fed(estimator, u, y, theta=None):
    """Feed a record; assert at each sample that the parameters are inside."""
    for sample in zip(u.tolist(), y.tolist(), strict=True):
        estimator.update(*sample)
        if theta is not None:
            assert (estimator.lower <= theta).all()
            assert (theta <= estimator.upper).all()
    return estimator


PLANTS = {
    "1 pole": ([0.8], [1.0]),
    "2 poles": ([0.7 + 0.4j, 0.7 - 0.4j], [1.0, 0.5]),
    "3 poles": ([0.5, 0.5 + 0.4j, 0.5 - 0.4j], [1.0, 0.5, 0.2]),
}


@pytest.mark.parametrize("plant", PLANTS)
@pytest.mark.parametrize("kind", ["uniform", "extreme", "held"])
@pytest.mark.parametrize("error", ["output", "equation"])
def test_the_truth_never_leaves_the_set(plant, kind, error):
    poles, b = PLANTS[plant]
    a = np.poly(poles).real[1:]
    theta = np.append(a, b)
    for seed in range(2):
        u, y, bound = simulated(a, b, 400, seed=seed, kind=kind, error=error)
        estimator = fed(RecursiveSet(Arx(len(a), len(b) - 1), bound, box(len(b)), error=error), u, y, theta)
        assert estimator.empty is None
        history = estimator.history
        assert (np.diff(history.lower, axis=0) >= 0).all()
        assert (np.diff(history.upper, axis=0) <= 0).all()
        assert (history.upper[-1] - history.lower[-1])[len(a)] < 4


def test_exact_data_and_a_bound_of_rounding_size():
    """All samples are exact, so nothing but the estimator rounds."""
    w, u = [Fraction(0)], np.random.default_rng(0).choice([-1, 1], 28).tolist()
    for value in u[:-1]:
        w.append(w[-1] / 2 + Fraction(3, 4) * value)
    assert all(Fraction(float(x)) == x for x in w)
    estimator = RecursiveSet(Arx(), 1e-15, box(1))
    fed(estimator, np.array(u, dtype=float), np.array([float(x) for x in w]), np.array([-0.5, 0.75]))
    assert estimator.empty is None
    assert (estimator.upper - estimator.lower < 1e-12).all()


def test_powers_of_a_scaled_input_and_an_offset():
    arx = Arx(powers=(3, 1), input_scale=0.1, offset=True)
    theta, generator = np.array([-0.7, 0.4, -0.2, 3.0]), np.random.default_rng(2)
    u, w = generator.uniform(-20, 20, 600), [0.0]
    for value in (0.1 * u[:-1]).tolist():
        w.append(0.7 * w[-1] + 0.4 * value**3 - 0.2 * value + 3.0)
    y = np.array(w) + 0.1 * noise(generator, 600, "uniform")
    bounds = {name: (-10.0, 10.0) for name in arx.names if name != "a1"}
    estimator = fed(RecursiveSet(arx, 0.1, bounds), u, y, theta)
    assert (estimator.upper - estimator.lower < [0.01, 0.02, 0.1, 0.2]).all()


def test_equation_errors_give_the_linear_programs_over_all_samples():
    a, b = np.poly([0.8, 0.5])[1:], np.array([1.0, 0.5])
    u, y, bound = simulated(a, b, 500, seed=1, error="equation")
    arx = Arx(2, 1)
    estimator = fed(RecursiveSet(arx, bound, box(2), error="equation"), u, y)
    rows, right = arx.matrix(u, y), y[2:]
    system = np.concatenate([rows, -rows]), np.concatenate([right, -right]) + bound
    for k, axis in enumerate(np.eye(4)):
        ends = [sign * linprog(sign * axis, *system, bounds=(-20, 20)).fun for sign in (1, -1)]
        assert [estimator.lower[k], estimator.upper[k]] == pytest.approx(ends, abs=1e-6)
        assert estimator.lower[k] <= ends[0] + 1e-9
        assert estimator.upper[k] >= ends[1] - 1e-9


@pytest.mark.parametrize(("plant", "wider"), [("1 pole", 6.0), ("2 poles", 12.0)])
def test_outer_of_the_batch_intervals_and_not_much_wider(plant, wider):
    poles, b = PLANTS[plant]
    a = np.poly(poles).real[1:]
    u, y, bound = simulated(a, b, 150, seed=3, share=0.03)
    estimator = fed(RecursiveSet(Arx(len(a), len(b) - 1), bound, box(len(b))), u, y)
    data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    batch = identify(OutputError(len(a), len(b) - 1, stable=True, bounds=box(len(b))), data, bound)
    for own, exact in zip(estimator.intervals, batch.intervals, strict=True):
        assert own.name == exact.name
        # The batch's inner ends are attained by parameters that explain all samples.
        assert own.lower <= exact.inner_lower
        assert own.upper >= exact.inner_upper
        assert own.width < wider * exact.width


def test_a_first_box_from_a_batch_is_kept():
    a, b = np.poly([0.8, 0.6])[1:], np.array([1.0, 0.5])
    u, y, bound = simulated(a, b, 200, seed=4, share=0.03)
    theta = np.append(a, b)
    narrow = {name: (value - 0.012, value + 0.015) for name, value in zip(Arx(2, 1).names, theta.tolist(), strict=True)}
    wide = fed(RecursiveSet(Arx(2, 1), bound, box(2)), u, y)
    begun = fed(RecursiveSet(Arx(2, 1), bound, narrow), u, y, theta)
    assert ((begun.upper - begun.lower) <= 0.8 * (wide.upper - wide.lower)).all()


def changing(seed, after, n=400, at=250, share=0.03):
    generator = np.random.default_rng(seed)
    u, w = generator.choice([-1.0, 1.0], n), [0.0]
    for t in range(1, n):
        w.append((0.8 if t < at else after) * w[-1] + (0.2 if t < at else 1 - after) * u[t - 1])
    bound = share * float(np.abs(w).max())
    return u, np.array(w) + bound * noise(generator, n, "uniform"), bound


@pytest.mark.parametrize("after", [0.6, 0.75])
def test_a_change_of_the_pole_is_certified_and_the_changed_plant_found(after):
    for seed in range(8):
        u, y, bound = changing(seed, after)
        estimator = fed(RecursiveSet(Arx(), bound, box(1)), u[:250], y[:250], np.array([-0.8, 0.2]))
        assert estimator.empty is None
        found = [estimator.update(*sample) for sample in zip(u[250:].tolist(), y[250:].tolist(), strict=True)]
        history = estimator.history
        assert [c for c in found if c is not None] == list(history.changes)
        (change,) = history.changes
        assert change.after == 1
        assert 250 <= change.sample < 300
        assert estimator.empty == change.sample
        later = slice(change.sample, None)
        assert (history.lower[later] <= [-after, 1 - after]).all()
        assert (history.upper[later] >= [-after, 1 - after]).all()
        assert (estimator.upper - estimator.lower < 0.2).all()
        located = locate_change(estimator, change, u, y)
        assert change.after <= located.after < 250 <= located.sample <= change.sample + 1


def test_no_change_no_alarm():
    for seed in range(8):
        u, y, bound = changing(seed, 0.8)
        assert fed(RecursiveSet(Arx(), bound, box(1)), u, y).history.changes == ()


def test_noise_beyond_its_bound_empties_the_set_too():
    u, y, bound = changing(0, 0.8)
    assert fed(RecursiveSet(Arx(), 0.5 * bound, box(1)), u, y).empty is not None


def test_a_constant_input_and_a_plant_at_rest_do_no_harm():
    estimator = RecursiveSet(Arx(2, 1), 0.1, box(2))
    fed(estimator, np.zeros(500), np.zeros(500), np.array([-1.2, 0.35, 1.0, 0.5]))
    fed(estimator, np.ones(500), np.full(500, 10.0) + 0.05)
    assert np.isfinite(estimator.lower).all()


def test_units_change_the_intervals_and_nothing_else():
    a, b = np.poly([0.8, 0.6])[1:], np.array([1.0, 0.5])
    u, y, bound = simulated(a, b, 300, seed=6)
    plain = fed(RecursiveSet(Arx(2, 1), bound, box(2)), u, y)
    gain = 2.0**30
    scaled = fed(RecursiveSet(Arx(2, 1), bound * 2.0**10, box(2, 20 * gain)), u * 2.0**-20, y * 2.0**10)
    units = np.array([1, 1, gain, gain])
    np.testing.assert_allclose(scaled.upper, plain.upper * units, rtol=1e-3)
    np.testing.assert_allclose(scaled.lower, plain.lower * units, rtol=1e-3)


def test_a_model_without_poles_is_a_matter_of_linear_programs():
    generator = np.random.default_rng(7)
    u = generator.choice([-1.0, 1.0], 200)
    y = lfilter([0.0, 1.0, 0.5], [1.0], u) + 0.1 * noise(generator, 200, "uniform")
    estimator = fed(RecursiveSet(Arx(0, 1), 0.1, box(2)), u, y, np.array([1.0, 0.5]))
    assert (estimator.upper - estimator.lower < 0.05).all()


def test_intervals_and_history():
    u, y, bound = changing(1, 0.8)
    estimator = RecursiveSet(Arx(), bound, box(1))
    assert [i.proof_lower for i in estimator.intervals] == [Proof.BOX, Proof.BOX]
    assert [(i.lower, i.upper) for i in estimator.intervals] == [(-1.0, 1.0), (-20.0, 20.0)]
    fed(estimator, u, y)
    history = estimator.history
    assert history.names == ("a1", "b0")
    assert history.lower.shape == history.upper.shape == (400, 2)
    np.testing.assert_array_equal(history.lower[-1], [i.lower for i in estimator.intervals])
    assert all(i.proof_upper is Proof.PROVEN and np.isnan(i.gap) for i in estimator.intervals)


def test_a_long_record_outgrows_its_first_room():
    a, b = np.poly([0.8, 0.6])[1:], np.array([1.0, 0.5])
    u, y, bound = simulated(a, b, 1500, seed=8, kind="held")
    estimator = fed(RecursiveSet(Arx(2, 1), bound, box(2), memory=30), u, y, np.append(a, b))
    assert len(estimator.history.lower) == 1500


@pytest.mark.parametrize(
    ("sample", "says"),
    [
        ((np.nan, 0.0), "sample 3: the input is nan: leave the sample out, or fill the gap"),
        ((0.0, np.inf), "sample 3: the output is inf"),
        ((0.0, 1e200), "sample 3: .* too large: scale the data"),
    ],
)
def test_bad_samples_are_refused_and_change_nothing(sample, says):
    one, other = (RecursiveSet(Arx(), 0.1, box(1)) for _ in range(2))
    for k, good in enumerate([(1.0, 0.0), (-1.0, 1.0), (1.0, -0.2), (1.0, 0.8), (-1.0, 1.7)]):
        if k == 3:
            with pytest.raises(DataError, match=says):
                one.update(*sample)
        one.update(*good)
        other.update(*good)
    np.testing.assert_array_equal(one.history.upper, other.history.upper)


@pytest.mark.parametrize(
    ("changed", "says"),
    [
        ({"noise_bound": 0.0}, "noise_bound = 0.0 is refused: give a positive number"),
        ({"noise_bound": np.nan}, "noise_bound = nan"),
        ({"bounds": {}}, "'b0' has no bounds: give a first interval"),
        ({"bounds": {"b0": (-1, 1), "b1": (0, 1)}}, "unknown parameter 'b1'"),
        ({"bounds": {"b0": (1, -1)}}, "bounds of 'b0' are 1 and -1: give finite ends"),
        ({"bounds": {"b0": (0, np.inf)}}, "give finite ends"),
        ({"arx": Arx(stable=False)}, "'a1' has no bounds"),
        ({"error": "input"}, "neither 'output' nor 'equation'"),
        ({"memory": 3}, "memory = 3 equations are too few"),
    ],
)
def test_bad_settings_are_refused(changed, says):
    settings = {"arx": Arx(), "noise_bound": 0.1, "bounds": box(1)} | changed
    with pytest.raises(ModelError, match=says):
        RecursiveSet(**settings)


def test_a_record_that_ends_before_the_change_locates_nothing():
    with pytest.raises(DataError, match="up to sample 30"):
        locate_change(RecursiveSet(Arx(), 0.1, box(1)), Change(1, 30), np.zeros(20), np.zeros(20))


def test_the_figure_shows_intervals_truth_and_changes():
    u, y, bound = changing(2, 0.6)
    history = fed(RecursiveSet(Arx(), bound, box(1)), u, y).history
    truth = np.where(np.arange(400)[:, None] < 250, [-0.8, 0.2], [-0.6, 0.4])
    figure = history.plot(truth, sampling_time=0.5)
    panels = figure.axes
    assert [panel.get_ylabel() for panel in panels] == ["a1", "b0"]
    assert panels[-1].get_xlabel() == "time [s]"
    (change,) = history.changes
    for panel in panels:
        marked = [line.get_xdata()[0] for line in panel.lines if line.get_label() == "certified change"]
        assert marked == [0.5 * change.sample]
        low, high = panel.get_ylim()
        assert high - low < 1.0
    assert {text.get_text() for text in figure.legends[0].get_texts()} == {"certified", "truth", "certified change"}
    assert history.plot().axes[-1].get_xlabel() == "sample"
    with pytest.raises(DataError, match=r"truth has shape \(3,\): give \(2,\)"):
        history.plot([1.0, 2.0, 3.0])


def test_estimators_print_their_samples_and_parameters() -> None:
    estimators = (
        RecursiveSet(Arx(), 0.1, {"b0": (-10.0, 10.0)}),
        SlidingWindow(OutputError(stable=True), 0.1, window=8, every=4),
        RecursiveEstimator(Arx(), NormalisedGradient()),
    )
    for estimator in estimators:
        for u, y in zip([1.0, 0, 1, 1, 0, 0, 1, 0], [0.0, 1, 0.5, 1.3, 1.6, 0.8, 0.4, 1.2], strict=True):
            estimator.update(u, y)
        assert repr(estimator).startswith(f"{type(estimator).__name__} after 8 samples: a1 ")
        assert "b0 " in repr(estimator)
        assert "\n" not in repr(estimator)
    assert str(estimators[0].intervals[0]) in repr(estimators[0])
