"""What a noise bound adds to the likelihood: a density, its derivatives, and what it decides."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import t

from smid.diagnosis.effects import sensor_bias
from smid.diagnosis.search.evidence import bound_of_evidence, evidence, noise_of
from smid.diagnosis.search.record import Record
from smid.diagnosis.search.student import TAIL
from smid.diagnosis.search.trial import fitted_base, try_effect
from smid.diagnosis.search.within_bound import WithinBound
from tests.smid.diagnosis.lag_records import LAG, lag, record, steps

N, BOUND = 500, 0.1


@given(st.floats(0.1, 10.0), st.floats(0.1, 5.0), st.floats(-3.0, 3.0))
def test_errors_have_a_density(blur: float, deviation: float, expected: float) -> None:
    """Its integral is one, or less where the past tells an error that cannot be."""
    within = WithinBound(1.0, blur)
    errors = np.linspace(-30 - 10 * deviation, 30 + 10 * deviation, 20001)
    plain = t.pdf((errors - expected) / deviation, TAIL) / deviation
    means, deviations = (np.full_like(errors, x) for x in (expected, deviation))
    total = np.trapezoid(plain * np.exp(within.log_density(errors, means, deviations)), errors)
    assert total <= 1.1
    assert total >= 0.9 or abs(expected) > 1.0


@given(st.floats(0.05, 10.0), st.floats(-20.0, 20.0))
def test_the_slopes_are_those_of_the_density(blur: float, error: float) -> None:
    within, small = WithinBound(1.0, blur), 1e-4 * blur

    def minus_log(e: float) -> float:
        # The past tells the same of each error.
        return -float(within.log_density(np.array([e]), np.array([0.0]), np.array([1.0]))[0])

    first, second = within.slopes(np.array([error]))
    before, here, after = (minus_log(error + step) for step in (-small, 0.0, small))
    size = 1 + abs(error) / blur
    assert first[0] == pytest.approx((after - before) / (2 * small), rel=1e-4, abs=1e-6 * size / blur)
    assert second[0] == pytest.approx((after - 2 * here + before) / small**2, rel=1e-2, abs=1e-4 * size**2 / blur**2)
    assert second[0] >= 0


def biased(bias: float) -> Record:
    u = steps(3, N)
    noise = np.random.default_rng(3).uniform(-BOUND, BOUND, N)
    data = record(u, lag(u) + bias + noise, bound=0.0)
    return Record(data, (np.ones(N, bool),), "u", "y")


@pytest.mark.parametrize(("bias", "blurred"), [(0.0, False), (5 * BOUND, True)])
def test_the_blur_is_large_where_the_error_exceeds_the_bound(bias: float, blurred: bool) -> None:
    seen = replace(biased(bias), noise_bound=BOUND)
    base = fitted_base(LAG, seen.data, seen.used, "u", "y")
    noise = noise_of(seen, base.errors, base.fit, base.errors, {})
    assert (noise.within["y"].blur > BOUND) == blurred
    assert noise_of(biased(bias), base.errors, base.fit, base.errors, {}).within == {}


def test_an_error_beyond_the_bound_is_evidence_against_a_model() -> None:
    free = biased(5 * BOUND)
    bounded = replace(free, noise_bound=BOUND)
    base = fitted_base(LAG, free.data, free.used, "u", "y")
    trial = try_effect(sensor_bias.EFFECT, base)
    assert trial is not None
    boxes = {p.name: p.upper - p.lower for p in map(trial.fit.model.parameter, trial.parameters)}
    places = {[p.name for p in trial.fit.model.parameters].index(name): width for name, width in boxes.items()}

    def gained(seen: Record) -> float:
        noise = noise_of(seen, base.errors, trial.fit, trial.errors, boxes)
        beside = evidence(seen, noise, trial.fit, boxes).value
        assert beside <= bound_of_evidence(seen, noise, trial.errors, places) + 0.5
        return beside - evidence(seen, noise, base.fit, {}).value

    assert gained(bounded) > gained(free) + 100
