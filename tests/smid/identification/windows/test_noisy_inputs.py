"""Long records with noisy inputs: windows prove what the whole record proves, and are as tight."""

from pathlib import Path

import numpy as np
import pytest
from scipy import sparse
from scipy.optimize import linprog
from scipy.signal import lfilter

from relaxations.search.enclosure import Reason
from smid import Dataset, EmptyFeasibleSetError, ErrorsInVariables, Estimate, identify, verify
from smid.fitting.binding import bind
from smid.identification.windows import windowed as windowed_module

BOUND = 0.05
MODEL = ErrorsInVariables(na=1, nb=0, stable=True)
TRUTH = {"a1": -0.8, "b0": 0.5}
N = 400


@pytest.fixture(autouse=True)
def _short_records_have_windows(monkeypatch):
    monkeypatch.setattr(windowed_module, "LONG", N)


def record(n: int = N, seed: int = 0, name: str = "run") -> Dataset:
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-1, 1, n // 5 + 1), 5)[:n]
    y = lfilter([0.5], [1, -0.8], u)
    noise = rng.uniform(-BOUND, BOUND, (2, n))
    return Dataset.from_arrays(input={"u": u + noise[0]}, output={"y": y + noise[1]}, sampling_time=1.0, name=name)


def holds_truth(estimate: Estimate) -> bool:
    return all(estimate[name].lower <= value <= estimate[name].upper for name, value in TRUTH.items())


def least_stretch(data: Dataset, a1: float, b0: float) -> float:
    """Return by how much the noise bounds must be stretched for these parameters, by one linear program."""
    u, y = data.values("u"), data.values("y")
    n = len(u)
    # y_t - eta_t + a1 (y_{t-1} - eta_{t-1}) - b0 (u_t - zeta_t) = 0, unknowns eta, zeta, stretch
    rows = np.arange(n - 1)
    one = np.ones(n - 1)
    places = (np.tile(rows, 3), np.concatenate([rows + 1, rows, n + rows + 1]))
    matrix = sparse.csr_matrix((np.concatenate([one, a1 * one, -b0 * one]), places), (n - 1, 2 * n + 1))
    within = sparse.hstack([sparse.identity(2 * n), -np.ones((2 * n, 1))])
    beyond = sparse.hstack([-sparse.identity(2 * n), -np.ones((2 * n, 1))])
    found = linprog(
        np.eye(2 * n + 1)[-1],
        A_eq=matrix,
        b_eq=y[1:] + a1 * y[:-1] - b0 * u[1:],
        A_ub=sparse.vstack([within, beyond]),
        b_ub=np.zeros(4 * n),
        bounds=(None, None),
        method="highs",
    )
    return float(found.x[-1]) / BOUND


@pytest.fixture(scope="module")
def estimate() -> Estimate:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(windowed_module, "LONG", N)
        return identify(MODEL, record(), BOUND, tolerance=1e-3)


def test_the_ends_are_those_of_the_whole_record(estimate):
    whole = identify(MODEL, record(), BOUND, tolerance=1e-3, windows=False)
    assert estimate.windows
    assert sum(map(len, estimate.windows)) < N / 2
    assert estimate.reason is Reason.TIGHT
    assert holds_truth(estimate)
    for one, other in zip(estimate, whole, strict=True):
        assert one.lower == pytest.approx(other.lower, abs=2e-3 * other.width)
        assert one.upper == pytest.approx(other.upper, abs=2e-3 * other.width)


def test_inner_ends_fit_every_sample(estimate):
    points = np.array(estimate.enclosure.witnesses)
    for k, interval in enumerate(estimate):
        for end in (interval.inner_lower, interval.inner_upper):
            point = points[np.argmin(np.abs(points[:, k] - end))]
            assert point[k] == end
            assert least_stretch(record(), *point) <= 1 + 1e-9


def test_parameters_beyond_the_ends_do_not_fit(estimate):
    outside = np.array([(estimate["a1"].upper + 1e-3 * estimate["a1"].width, b0) for b0 in np.linspace(0.3, 0.7, 41)])
    assert all(least_stretch(record(), *p) > 1 for p in outside)


def test_several_experiments(estimate):
    both = identify(MODEL, Dataset.merge([record(), record(seed=1, name="other")]), BOUND, tolerance=1e-2)
    assert {w.experiment for w in both.windows} == {0, 1}
    assert holds_truth(both)
    assert both["a1"].width < estimate["a1"].width


@pytest.mark.parametrize("channel", ["u", "y"])
def test_one_sample_beyond_the_bounds_is_proven(channel):
    data = record(5000)
    samples = {name: data.values(name).copy() for name in ("u", "y")}
    samples[channel][3210] += 8 * BOUND
    changed = Dataset.from_arrays(input={"u": samples["u"]}, output={"y": samples["y"]}, sampling_time=1.0)
    with pytest.raises(EmptyFeasibleSetError) as proof:
        identify(MODEL, changed, BOUND)
    assert min(abs(k - 3210) for _, k, _ in proof.value.samples) <= 3


def test_the_certificate_holds_the_windows(tmp_path: Path):
    file = tmp_path / "proof.json"
    found = identify(MODEL, record(), BOUND, tolerance=0.05, certificate=file)
    assert verify(file, record(), MODEL, BOUND).intervals["b0"] == (found["b0"].lower, found["b0"].upper)


@pytest.mark.parametrize("seconds", [1e-3, 0.5])
def test_an_interrupt_returns_what_is_proven(seconds):
    found = identify(MODEL, record(3000), BOUND, seconds=seconds)
    assert found.reason is Reason.TIME
    assert holds_truth(found)


def test_a_record_with_missing_samples_is_taken_whole():
    data = record()
    y = data.values("y").copy()
    y[100:110] = np.nan
    with_gap = Dataset.from_arrays(input={"u": data.values("u")}, output={"y": y}, sampling_time=1.0)
    assert not windowed_module.has_windows(bind(MODEL, with_gap), with_gap)
