"""A proof of emptiness: never where the truth is feasible, and right, by a linear program, where there is one."""

import json

import numpy as np
import pytest

from smid import Dataset
from smid.diagnosis.proof.emptiness import prove_empty
from smid.fitting.fit import fit
from tests.smid.diagnosis.lag_records import BOUND, LAG, dead_zone, lag, least_bound, record, steps


def proof(data: Dataset, noise_bound: float):
    fitted = fit(LAG, data)
    return prove_empty(fitted.model, data, noise_bound, "y", fitted.residual(data, "y"))


@pytest.mark.parametrize("seed", range(20))
def test_nothing_is_proven_where_the_truth_is_feasible(seed):
    """With odd seeds the noise sits on its bound, and the set is as small as it can be."""
    u = steps(seed, 120)
    clean = lag(u)
    data = record(u, clean, seed)
    if seed % 2:
        noise = BOUND * (1 - 1e-9) * np.random.default_rng(seed).choice([-1.0, 1.0], len(u))
        data = record(u, clean + noise, bound=0.0)
    assert proof(data, BOUND) is None


@pytest.mark.parametrize("seed", range(3))
def test_what_is_proven_empty_is_empty(seed):
    u = steps(seed, 240)
    data = record(u, lag(dead_zone(u, 0.3)), seed)
    found = proof(data, BOUND)
    assert found is not None
    window = slice(found.first, found.last + 1)
    least = min(least_bound(u[window], data.values("y")[window], pole) for pole in np.linspace(-0.99, 0.99, 67))
    assert least > found.noise_bound
    assert all(found.first <= sample <= found.last for sample, _ in found.samples)
    assert all(share > 0 for _, share in found.samples)
    shares = [share for _, share in found.samples]
    assert shares == sorted(shares, reverse=True)


def test_a_proof_speaks_in_units_and_samples():
    u = steps(0, 240)
    found = proof(record(u, lag(dead_zone(u, 0.3))), BOUND)
    assert f"within {BOUND:g} bar" in found.sentence
    assert f"samples {found.first} to {found.last} of run" in found.sentence
    assert json.loads(json.dumps(found.to_dict(), allow_nan=False))["sentence"] == found.sentence


def test_a_generous_bound_is_not_contradicted():
    u = steps(0, 240)
    assert proof(record(u, lag(dead_zone(u, 0.3))), 2.0) is None


def test_the_window_is_looked_for_where_the_fit_misses_most():
    u = steps(1, 300)
    w = lag(u)
    w[200:220] += 1.0
    found = proof(record(u, w), BOUND)
    assert found.first <= 200
    assert found.last >= 219
