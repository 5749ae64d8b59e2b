"""Long records: thinned where nothing is lost, searched in windows, fitted and tested whole."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from relaxations.algebra.arrays import Array
from smid.data import Dataset
from smid.diagnosis import diagnose
from smid.diagnosis.long_record import MOST_SAMPLES, shorten, windows
from smid.fitting.fit import fit
from smid.models import Line, Measurement, Model, OutputError, Parameter, signal, simulate, t

N = 20_000
RATE = 0.001  # s


def _lag() -> Model:
    pole, gain = Parameter("pole", 0.1, 50, "1/s"), Parameter("gain", -10, 10)
    w, u = signal("w"), signal("u")
    line = Line(w[t], pole.symbol * (gain.symbol * u[t] - w[t]), rate=True)
    return Model("lag", (pole, gain), (line,), (Measurement("y", "w", "eta"),), sampling_time=RATE)


def _held(length: int, seed: int, n: int = N) -> Array:
    levels = np.random.default_rng(seed).uniform(-1, 1, n // length + 1)
    return np.repeat(levels, length)[:n]


def _record(model: Model, values: dict[str, float], u: Array, bound: float) -> Dataset:
    y = simulate(model, {"u": u}, values)["y"] + np.random.default_rng(9).uniform(-bound, bound, u.size)
    return Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=RATE)


def test_a_short_record_stays_as_it_is() -> None:
    data = _record(_lag(), {"pole": 2.0, "gain": 1.0}, _held(500, 1, 2000), 0.001)
    short = shorten(_lag(), data, 0.2, bounded=False)
    assert short.data is data
    assert short.searched is short.parts.seen
    assert short.said == ()


def test_a_slow_record_of_a_rate_is_thinned_as_far_as_needed() -> None:
    data = _record(_lag(), {"pole": 2.0, "gain": 1.0}, _held(500, 1), 1e-4)
    short = shorten(_lag(), data, 0.2, bounded=True)
    factor = -(-N * 4 // 5 // MOST_SAMPLES)
    assert short.data.sampling_time == pytest.approx(factor * RATE)
    assert short.searched is short.parts.seen
    # A noise bound holds for the samples that are left, as no filter has mixed them.
    assert short.data.values("y") == pytest.approx(data.values("y")[::factor])
    fitted = fit(replace(_lag(), sampling_time=factor * RATE), short.parts.seen).model.values
    assert fitted["pole"] == pytest.approx(2.0, rel=1e-2)


def test_what_is_fast_or_defined_by_its_samples_is_not_thinned() -> None:
    noisy = _record(_lag(), {"pole": 2.0, "gain": 1.0}, _held(500, 1), 0.5)
    discrete = _record(OutputError(), {"a1": -0.99, "b0": 0.01}, _held(500, 1), 1e-4)
    for model, data in ((_lag(), noisy), (OutputError(), discrete)):
        short = shorten(model, data, 0.2, bounded=False)
        assert short.data is data
        assert 0 < sum(run.n_samples for run in short.searched.experiments) <= MOST_SAMPLES


def test_windows_are_pieces_of_the_record_at_every_level() -> None:
    u = _held(50, 2)
    u[5000:] += 10.0
    u[10_000:] -= 20.0
    data = _record(OutputError(), {"a1": -0.8, "b0": 0.2}, u, 0.01)
    chosen = windows(data, ("u", "y"))
    for run in chosen.experiments:
        first = round(run.start_time / RATE)
        assert run.values["y"].tolist() == data.values("y")[first : first + run.n_samples].tolist()
    levels = {round(float(np.mean(run.values["u"])), -1) for run in chosen.experiments}
    assert levels >= {0.0, 10.0, -10.0}


def test_a_cause_found_in_windows_is_fitted_and_tested_on_the_whole_record() -> None:
    truth = OutputError(delay=3)
    data = _record(truth, {"a1": -0.8, "b0": 1.0}, _held(20, 3), 0.05)
    found = diagnose(
        OutputError(), data, 0.05, effects=["input_delay", "sensor_bias", "gain"], workers=1, certify=False
    )
    assert [cause.effect for cause in found.causes] == ["input_delay"]
    assert "windows" in str(found)
    assert found.gain.samples == N // 5
    assert found.gain.rmse_after < 1.02 * 0.05 / np.sqrt(3)
    # No worse than the true structure fitted to all that may be seen.
    best = fit(truth, shorten(truth, data, 0.2, bounded=True).parts.seen)
    assert found.model.values["a1"] == pytest.approx(best.model.values["a1"], abs=1e-4)
