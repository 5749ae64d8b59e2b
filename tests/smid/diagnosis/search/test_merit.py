"""What the noise bound says of a fitted model beside its likelihood."""

from dataclasses import replace

import numpy as np
import pytest

from smid.diagnosis.search.merit import Record
from smid.fitting.fit import Fit, fit
from tests.smid.diagnosis.lag_records import BOUND, LAG, lag, record, steps

N, FITTED = 400, 280


def fitted(w: np.ndarray, u: np.ndarray, noise_bound: float | None) -> tuple[Record, Fit]:
    """Fit the lag to the first part of a record."""
    data, used = record(u, w), np.arange(N) < FITTED
    held = Record(data, (used,), (~used,), "u", "y", noise_bound)
    return held, fit(LAG, data, held.used)


@pytest.mark.parametrize("noise_bound", [BOUND, None])
def test_noise_within_its_bound_costs_nothing(noise_bound):
    u = steps(0, N)
    held, found = fitted(lag(u), u, noise_bound)
    assert held.excess(found) == 1.0
    assert held.merit(found) == held.score(found)


def test_what_no_parameters_bring_within_the_bound_is_behind():
    u = steps(0, N)
    held, found = fitted(lag(u + 0.3 * u**3), u, BOUND)
    excess = held.excess(found)
    assert excess > 1.2
    # Twice the negative log likelihood of uniform noise is 2 n log of its bound.
    assert held.merit(found) - held.score(found) == pytest.approx(2 * FITTED * np.log(excess))
    assert replace(held, noise_bound=None).excess(found) == 1.0  # nobody knows of a bound


def test_least_squares_beyond_the_bound_are_given_a_descent():
    """The least squares fit errs by more than the bound, another does not; far below, none does."""
    u = steps(0, N)
    held, found = fitted(lag(u), u, BOUND)
    largest = max(float(np.abs(e).max()) for e in held.fitted_part(held.residual(found)))
    assert replace(held, noise_bound=0.94 * largest).excess(found) == 1.0
    assert replace(held, noise_bound=0.8 * largest).excess(found) > 1.0
