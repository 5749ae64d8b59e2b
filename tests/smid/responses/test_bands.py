"""Certified bands hold the response of every parameter vector that fits, and are hardly wider than they must be."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog

import smid
from benchmarks.bands import feasible_models, outside, random_problem, simulate
from smid import Dataset, ErrorsInVariables, ModelError, OutputError, Wiener, bode, identify, report, step
from smid.models import Line, signal, t
from tests.smid.responses.first_order_record import BOUND, U


@pytest.mark.parametrize(
    ("kind", "seed"),
    [("output error", 1), ("Hammerstein", 0), ("errors in variables", 2)],
)
def test_truth_and_sampled_models_that_fit_lie_in_the_bands(kind, seed):
    problem = random_problem(kind, seed)
    found = identify(problem.model, problem.data, problem.bounds)
    a, b = feasible_models(problem, found, 1000, seed)
    assert len(a) == 1000
    bands = step(found, [1, 5, 20]), bode(found, [0.0, 20.0])
    assert outside(problem, *bands, np.vstack([problem.a, a]), np.vstack([problem.b, b])) == 0
    # The check can fail: models whose gain is off by the width of the set do not lie inside.
    assert outside(problem, *bands, a, 1.5 * b) == 1000
    for band in (*bands[0].bands, *bands[1].bands):
        assert (band.lower <= band.inner_lower).all()
        assert (band.inner_upper <= band.upper).all()


def test_the_band_is_the_range_over_the_feasible_set(record, estimate):
    # At fixed a1 the outputs are linear in b0 and the first output; the rest is a scan.
    y, count, ends = record.values("y"), len(U), []
    for a1 in np.linspace(estimate["a1"].lower, estimate["a1"].upper, 200):
        driven = simulate(np.array([[a1]]), np.ones((1, 1)), 1, U[None], np.zeros((1, 1)))[0]
        columns = np.column_stack([(-a1) ** np.arange(count), driven])
        rows, room = np.vstack([columns, -columns]), np.concatenate([y + BOUND, BOUND - y])
        for sign in (1, -1):
            found = linprog([0, sign], rows, room, bounds=[(None, None)] * 2)
            if found.status == 0:
                ends.append((a1, found.x[1]))
    a, b = np.array(ends).T
    k = np.array([1, 2, 4, 8, 30])
    h = b[:, None] * (1 - (-a[:, None]) ** k) / (1 + a[:, None])
    band = step(estimate, k)["response"]
    width = h.max(axis=0) - h.min(axis=0)
    assert (band.lower <= h.min(axis=0) + 1e-9).all()
    assert (band.upper >= h.max(axis=0) - 1e-9).all()
    assert (band.upper - band.lower <= 1.06 * width).all()


def test_a_wiener_model_gives_the_band_of_its_linear_block():
    u = 0.5 * U[:5]
    x = simulate(np.array([[-0.5]]), np.array([[1.0]]), 1, u[None], np.zeros((1, 1)))[0]
    y = (np.sqrt(1 + 0.4 * x) - 1) / 0.2  # y + 0.1 y^2 = x
    data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    model = Wiener(inverse_powers=(2,), bounds={"alpha": (-0.9, 0), "s2": (0, 0.2)}, fixed={"beta": 1.0})
    band = step(identify(model, data, 0.02, order=2, rounds=1), [1, 2, 6])
    assert (band.input, band.output) == ("u", "x")
    truth = 2 * (1 - 0.5 ** np.array([1, 2, 6]))
    slack = 1e-12  # of the first sample, which is known
    assert (band["response"].lower < truth + slack).all()
    assert (truth < band["response"].upper + slack).all()
    assert (band["response"].upper - band["response"].lower < 1.5).all()


def test_a_pole_on_the_unit_circle_makes_the_band_infinite():
    # An integrator: the interval of a1 holds -1.
    w = np.concatenate([[0.0], np.cumsum(0.5 * U[:-1])])
    data = Dataset.from_arrays(input={"u": U}, output={"y": w}, sampling_time=1.0)
    found = identify(OutputError(), data, BOUND)
    assert found["a1"].lower < -1 < found["a1"].upper
    band = bode(found, [0.0, 1.0])
    assert np.isinf(band["gain"].upper[0])
    assert not np.isfinite(band["phase"].upper[0] - band["phase"].lower[0])
    assert np.isfinite(band["gain"].upper[1])
    assert not band.stable
    assert "No bound of the gain is proven at 1 of 2 points" in str(band)
    assert "Not every parameter vector that fits is proven to be stable" in str(band)
    assert np.isfinite(step(found, 5)["response"].upper).all()
    band.plot()


def test_what_is_known_is_no_coordinate(record):
    # One parameter is free, then none.
    one = step(identify(OutputError(fixed={"a1": -0.7}), record, 0.1), [1, 2])["response"]
    assert np.allclose(one.upper, one.upper[0] * np.array([1, 1.7]))
    known = identify(OutputError(fixed={"a1": -0.7, "b0": 0.5}, offset=True, bounds={"offset": (-1, 1)}), record, 0.2)
    none = step(known, [1, 2])["response"]
    assert np.allclose([none.lower, none.upper], [0.5, 0.85], rtol=1e-12)


def test_sample_zero_is_exact_and_gain_and_phase_agree_with_a_known_model(estimate):
    assert step(estimate, 1)["response"].upper == 0
    a1, b0 = estimate.parameters["a1"], estimate.parameters["b0"]
    w = np.array([0.5, 10.0, 31.0])
    response = b0 * np.exp(-0.1j * w) / (1 + a1 * np.exp(-0.1j * w))
    band = bode(estimate, w)
    assert np.allclose(band["gain"].centre, np.abs(response))
    assert np.allclose(band["phase"].centre, np.degrees(np.unwrap(np.angle(response))))
    assert band["gain"].unit == "bar/V"
    assert band.stable
    assert band.complete


def test_units_scale_the_band(record, estimate):
    other = Dataset.from_arrays(input={"u": U}, output={"y": 1000 * record.values("y")}, sampling_time=0.1)
    large = step(identify(OutputError(stable=True), other, 1000 * BOUND), [3, 9])["response"]
    band = step(estimate, [3, 9])["response"]
    assert np.allclose(large.lower, 1000 * band.lower, rtol=1e-3)
    assert np.allclose(large.upper, 1000 * band.upper, rtol=1e-3)


def test_what_is_proven_when_the_time_ends_is_certified(estimate):
    band = step(estimate, 30, seconds=1e-6)
    assert not band.complete
    assert "stopped early" in str(band)
    assert (band["response"].lower <= band["response"].centre).all()


def test_a_result_prints_draws_and_is_plain_data(estimate, tmp_path):
    band = step(estimate, 30, seconds=1)
    text = str(band)
    assert "Step response of y to u, 20 of 30 points" in text
    assert "response [bar/V] lower" in text
    assert len(band.to_pandas()) == 30
    assert json.loads(json.dumps(band.to_dict()))["schema"] == "smid.response-band/1"
    assert band.plot().axes[0].get_ylabel() == "response [bar/V]"
    page = report(bode(estimate, [1.0, 2.0]), tmp_path / "bode.html").read_text(encoding="utf-8")
    assert "Frequency response of y to u" in page
    with pytest.raises(KeyError, match="no band of 'gain': there is response"):
        band["gain"]


@pytest.mark.parametrize("samples", [0, -3, [-1, 2], [], 1.5, [0.5], 10**9])
def test_samples_that_make_no_sense_are_refused(estimate, samples):
    with pytest.raises(ModelError, match=r"give a count of at least 1, or whole numbers from 0 to 10000"):
        step(estimate, samples)


@pytest.mark.parametrize("frequencies", [[31.5], [-1.0], [], [np.nan], [[1.0]]])
def test_frequencies_out_of_range_are_refused(estimate, frequencies):
    with pytest.raises(ModelError, match=r"between 0 and the Nyquist frequency, 31.4159 rad/s"):
        bode(estimate, frequencies)
    bode(estimate, [np.pi / 0.1])


def test_an_estimate_without_proof_or_linear_block_is_refused(estimate):
    with pytest.raises(ModelError, match="the intervals of this estimate are not proven"):
        step(replace(estimate, enclosure=None))
    a1, b0 = estimate.model.parameter("a1").symbol, estimate.model.parameter("b0").symbol
    w, u = signal("w"), signal("u")
    curved = replace(estimate.model, lines=(Line(w[t], a1 * w[t - 1] ** 2 + b0 * u[t - 1]),))
    with pytest.raises(ModelError, match="no transfer function leads to"):
        step(replace(estimate, model=curved))


def test_the_command_prints_bands_and_names_mistakes(record, tmp_path, monkeypatch):
    from click.testing import CliRunner

    from smid.cli import main

    monkeypatch.chdir(tmp_path)
    rows = [f"{0.1 * k:.1f},{u},{y}" for k, (u, y) in enumerate(zip(U, record.values("y"), strict=True))]
    (tmp_path / "run.csv").write_text("\n".join(["time [s],u [V],y [bar]", *rows]) + "\n")
    (tmp_path / "model.toml").write_text('class = "OutputError"\nstable = true\n')
    line = "response run.csv --input u --output y --model model.toml --noise-bound 0.05"
    found = CliRunner().invoke(main, f"{line} --samples 3 --report r.html".split())
    assert found.exit_code == 0
    assert "Step response of y to u" in found.output
    found = CliRunner().invoke(main, f"{line} --bode --frequencies 1,2 --json -".split())
    assert json.loads(found.output)["response"]["at"] == [1, 2]
    for options, message in (
        ("--frequencies 1", "belongs to --bode"),
        ("--bode --frequencies 1,x", "is no list of numbers"),
        ("--bode --frequencies 99", "Nyquist"),
    ):
        found = CliRunner().invoke(main, f"{line} {options}".split())
        assert found.exit_code == 2
        assert message in found.output
        assert len(found.output.strip().splitlines()) == 1


def test_errors_in_variables_with_one_parameter_left():
    problem = random_problem("errors in variables", 2)
    poles = len(problem.a)
    fixed = {f"a{k + 1}": float(value) for k, value in enumerate(problem.a)}
    model = ErrorsInVariables(poles, len(problem.b) - 1, fixed=fixed)
    band = step(identify(model, problem.data, problem.bounds), [0, 1])["response"]
    assert band.lower[0] < problem.b[0] < band.upper[0]
    assert isinstance(smid.ResponseBand, type)


def test_missing_outputs_leave_a_band_that_holds_the_truth():
    rng = np.random.default_rng(5)
    u, w = np.repeat(rng.choice([-1.0, 1.0], 12), 5), np.zeros(60)
    for k in range(1, 60):
        w[k] = 0.8 * w[k - 1] + 0.3 * u[k - 1]
    y = w + rng.uniform(-0.05, 0.05, 60)
    y[[20, 21, 45]] = np.nan
    data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    found = smid.step(smid.identify(OutputError(stable=True), data, noise_bound=0.05), 10)
    band = found["response"]
    truth = np.concatenate([[0.0], np.cumsum(0.3 * 0.8 ** np.arange(9))])
    assert (band.lower <= truth).all()
    assert (truth <= band.upper).all()
    assert band.looseness < 0.5
