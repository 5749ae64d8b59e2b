"""Parameters that drift, noisy inputs, several inputs, missing samples: the present parameters stay inside."""

import numpy as np
import pytest

from smid import DataError, ModelError
from smid.recursive import Arx, RecursiveSet
from smid.recursive.polytope import Polytope

INSIDE = 1 - 1e-12


def drifting(seed, arx, n=300, *, step=4e-4, input_bound=0.0):
    """Return input, output, parameters at each sample, noise bound, and the largest change of each parameter."""
    generator, p = np.random.default_rng(seed), len(arx.names)
    moves = step * np.where(generator.random((n, p)) < 0.5, 1.0, generator.uniform(-1, 1, (n, p)))
    theta = np.cumsum(moves * np.repeat(generator.choice([-1.0, 1.0], (n // 50 + 1, p)), 50, axis=0)[:n], axis=0)
    start = [-0.7] if arx.na == 1 else [-1.3, 0.42]
    theta = theta + np.append(start, generator.uniform(0.5, 1.5, p - arx.na))
    u, w = generator.choice([-1.0, 1.0], (n, arx.inputs)), np.zeros(n)
    for k in range(arx.max_lag, n):
        inputs = (u[k - arx.delay - arx.nb : k + 1, c][::-1].tolist() for c in range(arx.inputs))
        w[k] = np.dot(arx.row(w[k - arx.na : k][::-1].tolist(), *inputs), theta[k])
    bound = 0.03 * float(np.abs(w).max())
    y = w + bound * INSIDE * generator.choice([-1.0, 1.0], n)
    measured = u + input_bound * INSIDE * generator.uniform(-1, 1, u.shape)
    return measured, y, theta, bound, np.abs(np.diff(theta, axis=0)).max(axis=0) * (1 + 1e-9)


def box(arx):
    return {name: (-20.0, 20.0) for name in arx.names if name.startswith("b")}


CASES = {
    "1 pole": (Arx(), 0.0),
    "2 poles": (Arx(2, 1), 0.0),
    "noisy input": (Arx(), 0.03),
    "2 inputs": (Arx(inputs=2), 0.0),
    "2 noisy inputs, 2 poles": (Arx(2, 0, inputs=2), 0.02),
}


@pytest.mark.parametrize("case", CASES)
def test_the_present_parameters_stay_inside(case):
    arx, input_bound = CASES[case]
    for seed in range(2):
        u, y, theta, bound, step = drifting(seed, arx, input_bound=input_bound)
        drift = dict(zip(arx.names, step.tolist(), strict=True))
        estimator = RecursiveSet(arx, bound, box(arx), drift=drift, input_noise_bound=input_bound)
        for k in range(len(y)):
            assert estimator.update(u[k].tolist(), y[k]) is None
            assert (estimator.lower <= theta[k]).all()
            assert (theta[k] <= estimator.upper).all()
            if k == 250:
                assert estimator.refine(4) is None
                assert (estimator.lower <= theta[k]).all()
                assert (theta[k] <= estimator.upper).all()
        assert estimator.upper[0] - estimator.lower[0] < (1.0 if arx.na == 2 else 0.25)


def test_without_a_drift_the_same_record_proves_a_change():
    u, y, _, bound, _ = drifting(0, Arx(), 1000)
    estimator = RecursiveSet(Arx(), bound, box(Arx()))
    for k in range(len(y)):
        estimator.update(u[k].tolist(), y[k])
    assert estimator.changes


def test_a_change_beyond_the_drift_is_proven():
    u, y, _, bound, step = drifting(1, Arx(), 300)
    y[200:] = -2.0 * y[200:]
    drift = dict(zip(Arx().names, step.tolist(), strict=True))
    estimator = RecursiveSet(Arx(), 2 * bound, box(Arx()), drift=drift)
    for k in range(len(y)):
        estimator.update(u[k].tolist(), y[k])
    assert 200 <= estimator.changes[0].sample < 250


@pytest.mark.parametrize("drift", [0.0, 1e-3])
def test_missing_samples_are_skipped(drift):
    arx = Arx(2, 1)
    u, y, theta, bound, _ = drifting(2, arx, step=0.0 if drift == 0 else 4e-4)
    estimator = RecursiveSet(arx, bound, box(arx), drift=drift)
    for k in range(len(y)):
        if k % 60 in (7, 8):
            estimator.skip()
        else:
            estimator.update(u[k].tolist(), y[k])
        assert (estimator.lower <= theta[k]).all()
        assert (theta[k] <= estimator.upper).all()
    assert estimator.history.lower.shape == (len(y), 4)
    assert estimator.upper[0] - estimator.lower[0] < 2.0
    with pytest.raises(ModelError, match="samples = 0 is refused"):
        estimator.skip(0)


def test_a_set_that_drifts_holds_every_point_within_a_step():
    generator = np.random.default_rng(3)
    for _ in range(20):
        first = Polytope.box(-np.ones(3), np.ones(3), 60)
        normals = generator.normal(size=(12, 3))
        cut = first.cut(normals, generator.uniform(0.2, 1.0, 12))
        step = 10.0 ** generator.uniform(-6, -1, 3)
        points = generator.uniform(-1, 1, (2000, 3))
        points = points[(points @ cut.normals.T <= cut.offsets).all(axis=1)]
        moved = np.clip(points + step * generator.choice([-1.0, 1.0], points.shape), -1, 1)
        grown = cut.drifted(step, first)
        assert len(points) > 5
        assert (moved @ grown.normals.T <= grown.offsets).all()
        assert (moved @ grown.directions.T <= grown.ends).all()
        assert (grown.upper <= first.upper).all()
        # A later cut keeps them, too.
        half = grown.cut(np.array([[1.0, 0.0, 0.0]]), np.array([0.1]))
        assert (moved[moved[:, 0] <= 0.1] @ half.directions.T <= half.ends).all()


@pytest.mark.parametrize(
    ("changed", "says"),
    [
        ({"drift": -1.0}, "drift = -1.0 is refused"),
        ({"drift": {"c": 1.0}}, "unknown parameter 'c'"),
        ({"input_noise_bound": -1.0}, "input_noise_bound = -1.0 is refused"),
        ({"input_noise_bound": [0.1, 0.1]}, "one for each input"),
        ({"input_noise_bound": 0.1, "arx": Arx(powers=(3,))}, "leave out input_noise_bound"),
    ],
)
def test_bad_settings_are_refused(changed, says):
    settings = {"arx": Arx(), "noise_bound": 0.1, "bounds": {}} | changed
    settings["bounds"] = dict.fromkeys(settings["arx"].names[1:], (-1.0, 1.0))
    with pytest.raises(ModelError, match=says):
        RecursiveSet(**settings)


def test_a_sample_with_another_number_of_inputs_is_refused():
    estimator = RecursiveSet(Arx(inputs=2), 0.1, box(Arx(inputs=2)))
    with pytest.raises(DataError, match="sample 0 has 1 inputs and the model 2"):
        estimator.update(1.0, 0.0)
