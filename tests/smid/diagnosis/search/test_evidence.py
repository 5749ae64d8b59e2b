"""The merit of fitted models, against what defines it: evidence of linear models, and blocks that were left out."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import toeplitz
from scipy.signal import lfilter
from scipy.stats import t

from smid import OutputError
from smid.diagnosis.effects import sensor_bias
from smid.diagnosis.search.evidence import bound_of_evidence, evidence
from smid.diagnosis.search.noise_model import DISCREPANCY, NoiseModel, noise_model
from smid.diagnosis.search.record import FOLDS, Record
from smid.diagnosis.search.student import log_density, log_probability, weights
from smid.diagnosis.search.trial import fitted_base, try_effect
from tests.smid.diagnosis.lag_records import LAG, lag, record, steps

N, DEVIATION = 500, 0.05


def noisy(seed: int, bias: float = 0.0) -> Record:
    u = steps(seed, N)
    data = record(u, lag(u) + bias + DEVIATION * np.random.default_rng(seed).normal(size=N), bound=0.0)
    return Record(data, (np.ones(N, bool),), "u", "y")


def test_the_noise_model_whitens_coloured_noise_to_deviation_one():
    random = np.random.default_rng(0)
    noise = np.zeros(4000)
    for k, e in enumerate(random.normal(size=4000)):
        noise[k] = 0.9 * noise[k - 1] + 0.3 * e
    errors = ((0, "y", noise, np.empty((4000, 0))),)
    model = noise_model(errors, (np.ones(4000, bool),))
    white = model.innovations("y", noise)[len(model.taps["y"]) - 1 :]
    assert model.taps["y"][1] / model.taps["y"][0] == pytest.approx(-0.9, abs=0.03)
    assert np.mean(weights(white) * white**2) == pytest.approx(1.0, rel=1e-6), "the likeliest scale"
    assert np.std(white) == pytest.approx(1.0, rel=0.2)


def test_one_bad_sample_hardly_moves_the_noise_model():
    noise = np.random.default_rng(1).normal(size=1000)
    spoilt = noise.copy()
    spoilt[500] = 40.0
    errors = [((0, "y", e, np.empty((1000, 0))),) for e in (noise, spoilt)]
    plain, other = (noise_model(e, (np.ones(1000, bool),)) for e in errors)
    assert other.taps["y"][0] == pytest.approx(plain.taps["y"][0], rel=0.05)


def test_what_a_law_may_leave_is_little_evidence_but_noise_of_its_size_is_as_before():
    random = np.random.default_rng(2)
    noise, missed = 0.1 * random.normal(size=2000), np.sin(np.arange(2000) / 20)
    used = (np.ones(2000, bool),)
    left, base = (((0, "y", e, np.empty((2000, 0))),) for e in (noise, missed + noise))
    alone, both = noise_model(left, used), noise_model(left, used, base)

    def cost(model, error):
        return float(np.sum(model.innovations("y", error) ** 2))

    share = DISCREPANCY * missed
    assert cost(alone, share) > 900
    assert cost(both, share) < 0.1 * cost(alone, share)
    assert cost(both, noise) == pytest.approx(cost(alone, noise), rel=0.2)


@pytest.mark.parametrize("taps", [[10.0], [10.0, -6.0, 0.0, -3.0]], ids=["white", "coloured"])
def test_another_unit_changes_the_evidence_alike_under_each_noise_model(taps):
    """Each noise model judges the same samples: else a density in another unit would choose another model."""
    used = np.ones(N, bool)
    used[:5] = used[100:103] = used[::50] = False
    seen = replace(noisy(0), used=(used,))
    base = fitted_base(LAG, seen.data, seen.used, "u", "y")
    large = tuple((e, channel, 1e3 * error, 1e3 * slopes) for e, channel, error, slopes in base.errors)
    noise, in_thousandths = (NoiseModel({"y": np.array(taps) / unit}) for unit in (1.0, 1e3))
    gained = bound_of_evidence(seen, noise, base.errors, {}) - bound_of_evidence(seen, in_thousandths, large, {})
    assert gained == pytest.approx(used.sum() * np.log(1e3))


def test_the_first_errors_have_the_density_of_a_stationary_noise():
    """Against the covariance: x_t = 0.9 x_(t-1) - 0.3 x_(t-2) + e_t."""
    noise, n = NoiseModel({"y": np.array([1.0, -0.9, 0.3])}), 6
    response = lfilter([1.0], [1.0, -0.9, 0.3], np.eye(1, 400)[0])
    covariance = toeplitz([response[: 400 - lag] @ response[lag:] for lag in range(n)])
    errors = np.random.default_rng(4).normal(size=n)
    innovations, deviations = noise.innovations("y", errors), noise.deviations("y", n)
    assert np.sum(innovations**2) == pytest.approx(errors @ np.linalg.solve(covariance, errors))
    assert 2 * np.sum(np.log(deviations)) == pytest.approx(np.linalg.slogdet(covariance)[1])


def test_a_glitch_that_does_not_count_moves_no_innovation():
    used = np.ones(N, bool)
    used[[50, 51]] = False
    seen = replace(noisy(0), used=(used,))
    base = fitted_base(LAG, seen.data, seen.used, "u", "y")
    ((_, _, error, slopes),) = base.errors
    noise = NoiseModel({"y": np.array([10.0, -8.0])})
    spoilt = error.copy()
    spoilt[~used] = 1e6
    values = [bound_of_evidence(seen, noise, ((0, "y", one, slopes),), {}) for one in (error, spoilt)]
    assert values[0] == values[1]


def test_a_number_on_which_hardly_anything_depends_counts_as_one_on_which_nothing_does():
    seen = noisy(0)
    base = fitted_base(LAG, seen.data, seen.used, "u", "y")
    ((_, _, error, slopes),) = base.errors
    noise = NoiseModel({"y": np.array([10.0])})
    values = []
    for share in (0.0, 1e-160):  # whose square is no normal number
        some = slopes * np.where(np.arange(slopes.shape[1]) == 0, share, 1.0)
        values.append(bound_of_evidence(seen, noise, ((0, "y", error, some),), {}))
    assert values[0] == values[1]


@pytest.mark.parametrize("seed", range(4))
def test_left_out_blocks_cost_little_where_the_model_is_right(seed):
    """In theory each of the k fitted numbers costs about half a nat more than where all samples were seen."""
    seen = noisy(seed)
    base = fitted_base(LAG, seen.data, seen.used, "u", "y")
    noise = noise_model(base.errors, seen.used)
    found = evidence(seen, noise, base.fit, {})
    bound = bound_of_evidence(seen, noise, base.errors, {})
    assert bound - 3 * base.fit.n_free < found.value <= bound + 0.5


def test_occams_factor_is_that_of_the_gaussian_evidence():
    """The log of the width of the prior over that of the posterior, for one number that the record tells."""
    seen = noisy(0, bias=0.3)
    base = fitted_base(LAG, seen.data, seen.used, "u", "y")
    trial = try_effect(sensor_bias.EFFECT, base)
    assert trial is not None
    (name,) = trial.parameters
    noise = NoiseModel({"y": np.array([1 / DEVIATION])})
    wide, wider = (evidence(seen, noise, trial.fit, {name: width}) for width in (10.0, 20.0))
    assert wider.occam - wide.occam == pytest.approx(np.log(2.0), abs=1e-3)
    place = [p.name for p in trial.fit.model.parameters if p.lower < p.upper].index(name)
    assert wide.vector[place] == pytest.approx(0.3, abs=4 * wide.deviation[place])


def test_a_bias_is_worth_it_where_it_is_and_not_where_it_is_not():
    for bias, better in ((0.3, True), (0.0, False)):
        seen = noisy(3, bias)
        base = fitted_base(LAG, seen.data, seen.used, "u", "y")
        trial = try_effect(sensor_bias.EFFECT, base)
        assert trial is not None
        p = trial.fit.model.parameter(trial.parameters[0])
        noise = noise_model(trial.errors, seen.used)
        without = evidence(seen, noise, base.fit, {}).value
        beside = evidence(seen, noise, trial.fit, {p.name: p.upper - p.lower}).value
        assert (beside > without) == better


def test_folds_leave_the_beginning_of_each_experiment_in():
    u = steps(0, 100)
    one = record(u, lag(u))
    data = one.with_experiments((one.experiments[0], replace(one.experiments[0], name="again")))
    (first, second) = Record(data, (np.ones(100, bool),) * 2, "u", "y").folds
    assert (first[:10] == -1).all()
    assert (second[:10] == -1).all()
    joined = np.concatenate([first[10:], second[10:]])
    assert (np.diff(joined) >= 0).all()
    assert set(joined) == set(range(FOLDS))


def test_a_run_that_diverges_has_no_evidence():
    seen = noisy(0)
    base = fitted_base(OutputError(), seen.data, seen.used, "u", "y")
    broken = tuple((e, c, np.full_like(error, np.inf), slope) for e, c, error, slope in base.errors)
    assert bound_of_evidence(seen, noise_model(base.errors, seen.used), broken, {}) == -np.inf


def test_the_density_is_students():
    x = np.linspace(-5, 5, 11)
    assert log_density(x) - log_density(np.zeros(1)) == pytest.approx(t.logpdf(x, 10) - t.logpdf(0, 10))


@settings(deadline=None)
@given(st.floats(-300, -1e-6), st.floats(0.01, 600))
def test_the_probability_is_students(lower, width):
    upper = lower + width
    expected = t.cdf(upper, 10) - t.cdf(lower, 10)
    found = log_probability(np.array([lower]), np.array([upper]))
    assert found == pytest.approx(np.log(expected), abs=1e-7)
