"""Long records: what is proven on windows holds for every sample, is tight, and can be checked."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from relaxations.search.enclosure import Reason
from smid import (
    DataError,
    Dataset,
    EmptyFeasibleSetError,
    Estimate,
    Model,
    ModelError,
    OutputError,
    OwnModel,
    bode,
    error_bound,
    identify,
    verify,
)
from smid.fitting.binding import bind
from smid.identification.encloser import Settings
from smid.identification.windows import windowed as windowed_module
from smid.identification.windows.scan import Scan
from smid.identification.windows.windowed import LONG, Windowed, has_windows
from tests.smid.first_order import first_order

BOUND = 0.1
MODEL = OutputError(na=1, nb=0, stable=True)
TRUTH = {"a1": -0.8, "b0": 0.4}


def record(n: int = LONG, seed: int = 0, pole: float = 0.8, noise: float = BOUND) -> Dataset:
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-1, 1, n // 5 + 1), 5)[:n]
    y = lfilter([0, 0.4], [1, -pole], u) + rng.uniform(-noise, noise, n)
    return Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)


def changed(data: Dataset, sample: int, by: float) -> Dataset:
    y = data.values("y").copy()
    y[sample] += by
    return Dataset.from_arrays(input={"u": data.values("u")}, output={"y": y}, sampling_time=1.0)


def holds_truth(estimate: Estimate, truth: dict[str, float] = TRUTH) -> bool:
    return all(estimate[name].lower <= value <= estimate[name].upper for name, value in truth.items())


def windowed(model: Model, data: Dataset, bound: float, tolerance: float = 1e-3) -> Windowed:
    return Windowed(bind(model, data), data, {"y": bound}, Settings(tolerance=tolerance), False)


@pytest.mark.parametrize(("kind", "sizes"), [("hammerstein", 600), ("output error", (400, 300))])
def test_the_ends_are_those_of_linear_programs_over_the_whole_record(kind, sizes):
    problem = first_order(kind, sizes, 1)
    found = windowed(problem.model, problem.data, problem.noise_bound).enclose()
    assert found.windows
    assert sum(map(len, found.windows)) < 0.5 * problem.data.n_samples
    poles = problem.pole_interval(11)
    for k, interval in enumerate(found.enclosure.intervals):
        low, high = poles if k == 0 else problem.linear_interval(k - 1, poles, 7)
        width = high - low
        assert interval.lower <= low + 1e-6 * width
        assert interval.upper >= high - 1e-6 * width
        assert interval.lower == pytest.approx(low, abs=1e-3 * width)
        assert interval.upper == pytest.approx(high, abs=1e-3 * width)
        assert low - 1e-4 * width <= interval.inner_lower <= interval.inner_upper <= high + 1e-4 * width


def test_windows_are_the_default_for_long_records_only():
    whole = identify(MODEL, record(200), BOUND)
    assert not whole.windows
    estimate = identify(MODEL, record(), BOUND, tolerance=1e-3)
    assert estimate.windows
    assert f"{sum(map(len, estimate.windows))} of {LONG} samples" in estimate.summary
    assert holds_truth(estimate)
    assert estimate.reason is Reason.TIGHT
    assert Estimate.from_dict(estimate.to_dict(), estimate.data) == estimate
    assert estimate.proven_on.n_samples == sum(map(len, estimate.windows))


def test_inner_ends_fit_every_sample():
    data = record(6000, 3)
    estimate = identify(MODEL, data, BOUND, tolerance=1e-2)
    for name, place in (("a1", "inner_lower"), ("b0", "inner_upper")):
        end = getattr(estimate[name], place)
        held = [point for point in estimate.enclosure.witnesses if end in point]
        assert held
        pole, gain = held[0]
        # With the parameters as they are, some initial state keeps every error within the bound: one linear program.
        free = data.values("y") - lfilter([0, gain], [1, pole], data.values("u"))
        decay = (-pole) ** np.arange(100)
        limits = np.stack([(free[:100] - BOUND) / decay, (free[:100] + BOUND) / decay])
        assert limits[0].max() <= limits[1].min()
        assert np.abs(free[100:]).max() <= BOUND * (1 + 1e-6)


def test_results_do_not_depend_on_units_or_the_sign_of_the_channels():
    data, factor = record(), -1000.0
    scaled = Dataset.from_arrays(
        input={"u": data.values("u")}, output={"y": factor * data.values("y")}, sampling_time=1.0
    )
    one, other = (identify(MODEL, d, BOUND * scale, tolerance=1e-2) for d, scale in ((data, 1), (scaled, abs(factor))))
    assert one["a1"].lower == pytest.approx(other["a1"].lower, abs=2e-2 * one["a1"].width)
    assert one["b0"].lower * factor == pytest.approx(other["b0"].upper, abs=1e-3 * other["b0"].width)


def test_missing_samples_and_several_experiments():
    runs = []
    for seed in (1, 2):
        data = record(1500, seed)
        y = data.values("y").copy()
        y[np.random.default_rng(seed).choice(1500, 100, replace=False)] = np.nan
        runs.append(
            Dataset.from_arrays(input={"u": data.values("u")}, output={"y": y}, sampling_time=1.0, name=f"run{seed}")
        )
    estimate = identify(MODEL, Dataset.merge(runs), BOUND, tolerance=1e-2)
    assert estimate.windows
    assert {w.experiment for w in estimate.windows} == {0, 1}
    assert holds_truth(estimate)


def test_one_violation_in_a_hundred_thousand_samples_is_proven():
    data = changed(record(100_000), 54_321, 2.5 * BOUND)
    with pytest.raises(EmptyFeasibleSetError) as proof:
        identify(MODEL, data, BOUND)
    assert proof.value.least_bound > BOUND
    assert 54_321 in [k for _, k, _ in proof.value.samples]


def test_a_certificate_of_windows_is_about_the_whole_record(tmp_path: Path):
    data, file = record(), tmp_path / "proof.json"
    estimate = identify(MODEL, data, BOUND, tolerance=0.1, certificate=file)
    found = verify(file, data, MODEL, BOUND)
    assert found.intervals["a1"] == (estimate["a1"].lower, estimate["a1"].upper)
    inside = estimate.windows[0].last
    with pytest.raises(DataError, match="differs first"):
        verify(file, changed(data, inside, 1e-6), MODEL)
    with pytest.raises(DataError, match="the data lack"):
        verify(file, record(inside), MODEL)
    # The windows are part of the statement.
    content = json.loads(file.read_text())
    content["origin"]["windows"][0]["first"] -= 1
    file.write_text(json.dumps(content))
    with pytest.raises(DataError):
        verify(file, data, MODEL)


def test_the_least_bound_of_a_long_record():
    data = record(5000, 4)
    found = error_bound(MODEL, data)
    assert 0 < found.lower <= found.upper <= BOUND
    assert found.gap <= 1e-3 * found.upper
    with pytest.raises(EmptyFeasibleSetError):
        identify(MODEL, data, 0.99 * found.lower)
    assert identify(MODEL, data, found.upper * (1 + 1e-6), tolerance=1.0).reason is Reason.TIGHT


def test_bands_of_a_long_record_hold_the_response_of_the_truth():
    band = bode(identify(MODEL, record(), BOUND, tolerance=1e-2), frequencies=[0.1, 1.0])
    gain = np.abs(0.4 / (np.exp(1j * np.array([0.1, 1.0])) - 0.8))
    assert (band["gain"].lower <= gain).all()
    assert (gain <= band["gain"].upper).all()


def test_a_slow_pole_is_proven_on_as_many_samples_as_a_proof_can_hold(monkeypatch):
    monkeypatch.setattr(windowed_module, "MOST", 300)
    estimate = identify(MODEL, record(4000, 5, 0.97), BOUND, tolerance=1e-2)
    assert 0 < sum(map(len, estimate.windows)) <= 300
    assert holds_truth(estimate, {"a1": -0.97, "b0": 0.4})
    assert estimate.reason is Reason.WINDOWS


@pytest.mark.parametrize("seconds", [1e-3, 1.0])
def test_an_interrupt_at_any_moment_returns_what_is_proven(seconds):
    estimate = identify(MODEL, record(20_000), BOUND, seconds=seconds)
    assert estimate.reason is Reason.TIME
    assert holds_truth(estimate)


def test_where_no_run_stays_finite_all_samples_are_used(monkeypatch):
    def diverges(*_arguments):
        raise DataError("it diverges from every start")

    monkeypatch.setattr(windowed_module, "LONG", 250)
    monkeypatch.setattr(windowed_module, "FreeRuns", diverges)
    estimate = identify(MODEL, record(300), BOUND, tolerance=1e-2)
    assert not estimate.windows
    assert holds_truth(estimate)


@pytest.mark.parametrize("seconds", [np.inf, 3.0])
def test_a_point_that_fits_the_windows_alone_is_no_inner_end(monkeypatch, seconds):
    """Where no run is verified on every sample, nothing is known of how loose the windows are."""
    monkeypatch.setattr(windowed_module, "LONG", 250)
    monkeypatch.setattr(windowed_module, "_SHARE", 1.0)
    monkeypatch.setattr(windowed_module.WholeRecord, "holds", lambda *_arguments: False)
    estimate = identify(MODEL, record(300), BOUND, tolerance=1e-2, seconds=seconds)
    assert holds_truth(estimate)
    if estimate.windows:
        assert all(np.isnan([i.inner_lower, i.inner_upper]).all() for i in estimate)
        assert estimate.reason is not Reason.TIGHT
        assert estimate.enclosure is None or not estimate.enclosure.witnesses
    else:
        assert estimate.reason in (Reason.TIGHT, Reason.TIME)


def test_a_record_whose_least_squares_break_the_constraints_is_not_scanned(monkeypatch):
    """The least squares of a growing record are unstable; where no other run is found, all samples are used."""
    monkeypatch.setattr("smid.identification.windows.scan.constrained", lambda _problem, vector, _constraints: vector)
    u = np.ones(300)
    u[::7] = -1.0
    data = Dataset.from_arrays(input={"u": u}, output={"y": 1.01 ** np.arange(300.0)}, sampling_time=1.0)
    with pytest.raises(DataError, match="keeps the constraints"):
        Scan(bind(OutputError(na=2, nb=1, stable=True), data), data, {"y": 0.01})


def test_what_is_proven_empty_stays_so_where_no_least_bound_is_found(monkeypatch):
    def lost(*_arguments, **_settings):
        raise ModelError("no feasible point could be verified")

    monkeypatch.setattr("smid.identification.identify.error_bound", lost)
    with pytest.raises(EmptyFeasibleSetError) as proof:
        identify(MODEL, changed(record(200), 100, 2.5 * BOUND), BOUND)
    assert proof.value.least_bound is None


def test_a_place_before_the_first_equation_has_a_window_with_equations():
    (window,), _ = windowed(MODEL, record(), BOUND)._windows_of(np.array([[0, 0]]), 36)
    assert len(window) > MODEL.max_lag


def test_a_pole_that_follows_a_channel():
    rng = np.random.default_rng(0)
    truth, box = {"a0": 0.6, "a1": 0.2, "b": 0.5}, {"a0": [-1, 1], "a1": [-1, 1], "b": [-3, 3]}
    model = OwnModel(["w[t] = (a0 + a1*p[t-1])*w[t-1] + b*u[t-1]"], {"y": {"signal": "w"}}, ["u", "p"], box)
    u, p, w = rng.uniform(-1, 1, LONG), rng.uniform(-1, 1, LONG), np.zeros(LONG)
    for k in range(1, LONG):
        w[k] = (0.6 + 0.2 * p[k - 1]) * w[k - 1] + 0.5 * u[k - 1]
    y = w + rng.uniform(-BOUND, BOUND, LONG)
    data = Dataset.from_arrays(input={"u": u, "p": p}, output={"y": y}, sampling_time=1.0)
    found = identify(model, data, BOUND, tolerance=0.02)
    assert found.windows
    assert found.reason is Reason.TIGHT
    assert holds_truth(found, truth)


def test_windows_can_be_declined_and_are_not_for_every_model():
    data = record()
    assert has_windows(bind(MODEL, data), data)
    assert not has_windows(bind(MODEL, data), data.split(0.9)[0])
    whole = identify(MODEL, data, BOUND, windows=False, seconds=1.0)
    assert not whole.windows
    assert holds_truth(whole)


def test_a_pole_that_remembers_most_of_a_long_record_is_proven_to_a_percent_of_the_width() -> None:
    rng = np.random.default_rng(0)
    u = np.repeat(rng.uniform(-1, 1, 120), 50)
    w = lfilter([0.0, 0.002], [1.0, -0.998], u)
    y = w + rng.uniform(-0.05, 0.05, len(u))
    data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    found = identify(OutputError(stable=True), data, 0.05, tolerance=1e-2)
    assert found.reason is Reason.TIGHT
    for name, true in (("a1", -0.998), ("b0", 0.002)):
        assert found[name].lower <= true <= found[name].upper
        assert found[name].gap <= 1e-2 * found[name].width
