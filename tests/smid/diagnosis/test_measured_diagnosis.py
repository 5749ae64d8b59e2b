"""Names on measured records, which may not be passed on: they lie beside the checkout or the tests are skipped."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.measured_cases import SERVO_RUNS, without
from smid import Dataset, OutputError
from smid.data import load_record
from smid.diagnosis import Verdict, diagnose

FOLDER = Path(__file__).resolve().parents[4] / "shared" / "data"


def record(name: str) -> Dataset:
    if not (FOLDER / name).is_dir():
        pytest.skip(f"no measured record at ../shared/data/{name}")
    return load_record(name, FOLDER)


def test_silverbox_has_a_hardening_spring_rather_than_coefficients_that_depend_on_the_level() -> None:
    data = record("silverbox").select("multisine").crop(0, 2000)
    effects = ["operating_point", "stiffness", "quadratic_drag"]
    found = diagnose(OutputError(2, 2, 0, offset=True), data, effects=effects, workers=1)
    assert found.causes[0].effect == "stiffness"
    assert found.gain.rmse_after < 0.05 * found.gain.rmse_before


def test_windows_of_a_long_record_begin_in_the_middle_of_a_swing() -> None:
    data = record("silverbox").select("multisine")
    found = diagnose(OutputError(2, 2, 0, offset=True), data, effects=["stiffness"], workers=1)
    assert [(cause.effect, cause.label) for cause in found.causes] == [("stiffness", "square and cube on w")]
    assert found.gain.rmse_after < 0.1 * found.gain.rmse_before


def test_servo_has_a_rate_limit() -> None:
    data = record("servo_rate_limit").select(SERVO_RUNS[::2])
    effects = ["rate_limit", "extra_lag"]
    found = diagnose(OutputError(1, 0, offset=True), data, effects=effects, workers=1)
    assert found.verdict is Verdict.NAMED
    assert found.causes[0].effect == "rate_limit"
    assert found.gain.rmse_after < 0.6 * found.gain.rmse_before


def test_nothing_less_likely_stands_in_for_a_lag_that_hardly_carries_over() -> None:
    """A lag at the input explains far more of what is fitted than of the test part: a rate limit is no way out."""
    data = record("daisy_heating_system")
    found = diagnose(OutputError(2, 1, offset=True), data, effects=["extra_lag", "rate_limit"], workers=1)
    assert "rate_limit" not in [cause.effect for cause in found.causes]
    assert found.unexplained


def test_what_halves_the_held_out_error_stands_beside_a_likelier_leader_that_does_not_carry_over() -> None:
    """Friction tells the arm's next sample best, and nothing of the free run; the thrust's dead zone is a curve."""
    data = without(record("quarter_drone"), "reference_angle").decimate(10, held="thrust")
    effects = ["input_curve", "stribeck_friction"]
    found = diagnose(OutputError(2, 1, offset=True), data, effects=effects, workers=1)
    assert [cause.effect for cause in found.causes] == ["input_curve"]
    assert found.gain.rmse_after < 0.5 * found.gain.rmse_before


def test_smooth_input_is_not_called_noisy() -> None:
    """White noise in the recorded gas rate cannot exceed what its own past leaves untold."""
    data = record("box_jenkins_gas_furnace")
    found = diagnose(OutputError(2, 1, offset=True), data, effects=["input_noise", "input_delay"], workers=1)
    assert "input_noise" not in [cause.effect for cause in found.causes]


def test_a_run_held_out_begins_where_it_fits() -> None:
    """Two runs of one linear plant: the second, unseen, starts far from the equilibrium of its first input."""
    rng = np.random.default_rng(3)
    runs, start = [], (0.0, 25.0)
    for level in start:
        u = rng.uniform(-1, 1, 200)
        w = np.empty(200)
        w[0] = level
        for k in range(1, 200):
            w[k] = 0.97 * w[k - 1] + u[k - 1]
        runs.append(Dataset.from_arrays(input={"u": u}, output={"y": w + 5}, sampling_time=1.0))
    first, second = runs
    data = first.with_experiments((replace(first.experiments[0], name="a"), replace(second.experiments[0], name="b")))
    base = OutputError(1, 0, offset=True)
    found = diagnose(base, data, effects=["input_delay"], test=("b",), workers=1)
    assert found.gain.rmse_before < 1e-3
