"""Published intervals of first-order models against linear programs at every fixed pole."""

import numpy as np
import pytest

from relaxations.algebra.polynomial import Polynomials
from relaxations.points.witness import verify
from relaxations.problem.problem import PolynomialProblem
from relaxations.search.enclosure import Reason
from relaxations.search.hierarchy import intervals

CASES = [
    ("output_error", {"n": 15, "seed": 1}),
    ("output_error", {"n": 40, "seed": 2}),
    ("output_error", {"n": 25, "seed": 3, "pole": 0.4, "gain": -2.0}),
    ("output_error", {"n": 30, "seed": 4, "pole": -0.9, "noise_bound": 0.3}),
    ("hammerstein", {"n": 20, "seed": 0}),
    ("hammerstein", {"n": 40, "seed": 5}),
    ("hammerstein", {"n": 30, "seed": 6, "powers": 2}),
]


@pytest.mark.parametrize(("kind", "options"), CASES, ids=[f"{k}-{o['n']}-{o['seed']}" for k, o in CASES])
def test_published_ends_are_those_of_the_oracle(request, kind, options):
    model = request.getfixturevalue(kind)(**options)
    targets = list(range(1 + model.n_linear)) if kind == "output_error" else [0, model.n_linear]
    found = intervals(model.problem, targets)
    poles = model.pole_interval()
    for k, interval in zip(targets, found.intervals, strict=True):
        low, high = poles if k == 0 else model.linear_interval(k - 1, poles)
        width = high - low
        # Linear programs are exact to about 1e-9 of the noise bound: that is all they may lie outside.
        slack = 1e-7 * width
        assert interval.lower <= low + slack
        assert interval.upper >= high - slack
        assert interval.lower == pytest.approx(low, abs=1e-4 * width)
        assert interval.upper == pytest.approx(high, abs=1e-4 * width)
        # A witness is proven; the oracle's golden section stops a little inside.
        assert interval.inner_lower >= low - 1e-6 * width
        assert interval.inner_upper <= high + 1e-6 * width
    assert found.reason is Reason.TIGHT


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("kind", ["output_error", "hammerstein"])
def test_the_parameters_that_made_the_data_lie_inside(request, kind, seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(5, 30))
    model = request.getfixturevalue(kind)(n, seed=seed)
    targets = range(1 + model.n_linear)
    found = intervals(model.problem, targets, order=1, rounds=2, witnesses=False)
    assert found.empty is None
    points = model.sample(10, rng)
    for interval, values in zip(found.intervals, points.T[list(targets)], strict=True):
        assert interval.lower <= values.min()
        assert values.max() <= interval.upper


def errors_in_variables(n, seed, noise_bound=0.05, pole=-0.8, gain=1.0):
    """Return a first-order model with noise on input and output, and the point that made its data."""
    rng = np.random.default_rng(seed)
    u = rng.choice([-1.0, 1.0], n)
    x = np.zeros(n)
    for t in range(1, n):
        x[t] = -pole * x[t - 1] + gain * u[t - 1]
    e, d = rng.uniform(-noise_bound, noise_bound, (2, n))
    y, v = x + e, u + d
    rows = [
        {
            (): y[t],
            (2 + t,): -1.0,
            (0,): y[t - 1],
            (0, 1 + t): -1.0,
            (1,): -v[t - 1],
            (1, 1 + n + t): 1.0,
        }
        for t in range(1, n)
    ]
    problem = PolynomialProblem(
        ("a", "b", *(f"e{t}" for t in range(n)), *(f"d{t}" for t in range(n))),
        np.r_[-1, -5, np.full(2 * n, -noise_bound)],
        np.r_[1, 5, np.full(2 * n, noise_bound)],
        Polynomials.from_terms(rows),
        Polynomials.empty(),
    )
    return problem, np.r_[pole, gain, e, d]


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("order", [1, 2])
def test_errors_in_variables_contain_the_truth_and_reach_their_witnesses(seed, order):
    problem, truth = errors_in_variables(6 + 2 * seed, seed)
    witness = verify(problem, problem.variable(0), truth)
    assert witness is not None
    found = intervals(problem, [0, 1], order=order, rounds=4)
    assert found.complicating == ("a", "b")
    for k, interval in enumerate(found.intervals):
        assert interval.lower <= truth[k] <= interval.upper
        assert interval.lower <= interval.inner_lower
        assert interval.inner_upper <= interval.upper
        if order == 2:
            assert interval.gap <= 1e-2 * interval.width
    for point in found.witnesses:
        assert verify(problem, problem.variable(0), point) is not None
