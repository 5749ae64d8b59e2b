"""Long records of models with kinks of an input: windows prove the ends, and every sample is asked."""

from pathlib import Path

import numpy as np
import pytest
import sympy

from relaxations.search.enclosure import Reason
from smid import Dataset, EmptyFeasibleSetError, Estimate, OutputError, OwnModel, Parameter, identify, verify
from smid.feasible.template import Templates
from smid.fitting.binding import bind
from smid.identification.windows import windowed as windowed_module
from smid.identification.windows.whole_record import WholeRecord, suits
from smid.models import simulate

BOUND = 0.05
N = 600
TRUTH = {"a1": -0.7, "b0": 0.9, "d": 0.3}
THRESHOLD = Parameter("d", 0, 1, null=0.0)
MODEL = OutputError(1, 0, stable=True, bounds={"b0": (-3, 3)}).insert_before(
    "u", lambda x: sympy.Max(0, x - THRESHOLD.symbol), parameters=[THRESHOLD]
)


@pytest.fixture(autouse=True)
def _short_records_have_windows(monkeypatch):
    monkeypatch.setattr(windowed_module, "LONG", N)


def run(u: np.ndarray, a1: float, b0: float, d: float) -> np.ndarray:
    w = np.zeros(len(u))
    for k in range(1, len(u)):
        w[k] = -a1 * w[k - 1] + b0 * max(0.0, u[k - 1] - d)
    return w


def record(n: int = N) -> Dataset:
    rng = np.random.default_rng(0)
    u = np.repeat(rng.uniform(-1, 1, n // 3 + 1), 3)[:n]
    y = run(u, **TRUTH) + rng.uniform(-BOUND, BOUND, n)
    return Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)


def least_bound(data: Dataset, a1: float, b0: float, d: float) -> float:
    """Return the least noise bound with which some initial state fits all samples: a line in it for each sample."""
    left = data.values("y") - run(data.values("u"), a1, b0, d)
    slopes = (-a1) ** np.arange(len(left))
    low, high = -10.0, 10.0
    for _ in range(200):  # the largest of |left - slopes * w| is convex in w
        thirds = low + (high - low) / 3, high - (high - low) / 3
        worst = [np.abs(left - slopes * w).max() for w in thirds]
        low, high = (low, thirds[1]) if worst[0] < worst[1] else (thirds[0], high)
    return float(np.abs(left - slopes * low).max())


@pytest.fixture(scope="module")
def estimate() -> Estimate:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(windowed_module, "LONG", N)
        return identify(MODEL, record(), BOUND, tolerance=0.05)


def test_windows_hold_the_truth_and_meet_points_that_fit_every_sample(estimate):
    assert estimate.reason is Reason.TIGHT
    assert 0 < sum(map(len, estimate.windows)) < N / 2
    points = np.array(estimate.enclosure.witnesses)
    for k, interval in enumerate(estimate):
        assert interval.lower <= TRUTH[interval.name] <= interval.upper
        for end in (interval.inner_lower, interval.inner_upper):
            point = points[np.argmin(np.abs(points[:, k] - end))]
            assert least_bound(record(), *point) <= BOUND


def test_parameters_beyond_the_ends_fit_no_samples(estimate):
    d, others = estimate["d"], [estimate[name] for name in ("a1", "b0")]
    beyond = d.upper + 0.05 * d.width
    grid = np.stack(np.meshgrid(*(np.linspace(i.lower, i.upper, 7) for i in others)), axis=-1).reshape(-1, 2)
    assert all(least_bound(record(), *p, beyond) > BOUND for p in grid)


def test_the_certificate_holds_the_windows(monkeypatch, tmp_path: Path):
    monkeypatch.setattr(windowed_module, "MOST_PIECEWISE", 40)
    file = tmp_path / "proof.json"
    found = identify(MODEL, record(), BOUND, tolerance=0.5, certificate=file)
    assert 0 < sum(map(len, found.windows)) <= 40
    intervals = verify(file, record(), MODEL, BOUND).intervals
    assert all(intervals[i.name] == (i.lower, i.upper) for i in found)


def test_one_sample_beyond_the_bound_is_proven():
    data = record(5000)
    y = data.values("y").copy()
    y[3210] += 3 * BOUND
    changed = Dataset.from_arrays(input={"u": data.values("u")}, output={"y": y}, sampling_time=1.0)
    with pytest.raises(EmptyFeasibleSetError) as proof:
        identify(MODEL, changed, BOUND)
    assert min(abs(k - 3210) for _, k, _ in proof.value.samples) <= 5


def test_kinks_of_kinks_are_simulated_within_rounding():
    lines = ["v[t] = Abs(u[t] - d) + sign(u[t])*c", "w[t] = -a*w[t-1] + b*Max(0, v[t-1] - c)"]
    truth = {"a": -0.6, "b": 0.8, "c": 0.2, "d": 0.1}
    model = OwnModel(lines, {"y": "w"}, ["u"], {name: [-1, 1] for name in truth})
    data = record(300)
    bound_model = bind(model, data)
    whole = WholeRecord(Templates.of(bound_model), data)
    simulated = simulate(bound_model, data.experiments[0].values, truth)
    noises = whole.noises([{"y": simulated["w"]}])
    reached = whole.least_bounds(truth, noises)["y"]
    largest = np.abs(data.values("y") - simulated["w"]).max()
    assert largest <= reached <= largest + 1e-9


def test_kinks_of_an_output_are_taken_whole():
    lines = ["w[t] = -a*w[t-1] + b*u[t-1] - c*sign(w[t-1])"]
    model = OwnModel(lines, {"y": "w"}, ["u"], {name: [-1, 1] for name in "abc"})
    assert not suits(Templates.of(bind(model, record(300))))
