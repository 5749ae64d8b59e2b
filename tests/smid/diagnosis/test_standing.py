"""What the noise bound says of a fitted model beside its likelihood."""

from dataclasses import replace

import numpy as np
from lag_records import BOUND, LAG, lag, record, steps

from smid.diagnosis.standing import MARGIN, Record
from smid.fit import fit


def judged(y: np.ndarray, u: np.ndarray, noise_bound: float | None) -> tuple[bool, float]:
    """Tell of the lag fitted to a record whether it keeps the bound, and what its merit is over its score."""
    data = record(u, y)
    fitted = np.arange(len(u)) < 0.7 * len(u)
    held = Record(data, (fitted,), (~fitted,), "u", "y", noise_bound)
    found = fit(LAG, data, held.used)
    return held.keeps_bound(found), held.merit(found) - held.score(found)


def test_noise_within_its_bound_keeps_it_and_costs_nothing():
    u = steps(0, 400)
    assert judged(lag(u), u, BOUND) == (True, 0.0)
    assert judged(lag(u), u, None) == (True, 0.0)


def test_what_no_parameters_bring_within_the_bound_is_behind():
    u = steps(0, 400)
    curved = lag(u + 0.3 * u**3)
    assert judged(curved, u, BOUND) == (False, MARGIN)
    assert judged(curved, u, None) == (True, 0.0)  # nobody knows of a bound


def test_least_squares_beyond_the_bound_are_given_a_descent():
    """The least squares fit errs by more than the bound, another does not; far below, none does."""
    u = steps(0, 400)
    data = record(u, lag(u))
    fitted = np.arange(400) < 280
    tight = Record(data, (fitted,), (~fitted,), "u", "y", BOUND)
    found = fit(LAG, data, tight.used)
    largest = max(float(np.abs(e).max()) for e in tight.fitted_part(tight.residual(found)))
    assert replace(tight, noise_bound=0.94 * largest).keeps_bound(found)
    assert not replace(tight, noise_bound=0.8 * largest).keeps_bound(found)
