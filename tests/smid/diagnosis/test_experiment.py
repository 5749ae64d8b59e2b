"""The experiment that tells rivals apart asks for nothing new and keeps what it promises."""

import numpy as np
import pytest

from smid import OutputError, Parameter
from smid.diagnosis.experiment import separating_experiment
from smid.fitting.problem import Fit
from smid.models import Model, signal, simulate, t
from tests.smid.diagnosis.lag_records import lag, record, steps

VALUES = {"a1": -0.8, "b0": 0.5}


def made(model: Model, values: dict[str, float]) -> Fit:
    return Fit(model.with_values(values), (), (), 0.0, 0)


def less() -> Fit:
    """A gain of 0.7."""
    return made(OutputError(), VALUES | {"b0": 0.35})


def cut(at: float) -> Fit:
    """An input that acts up to a level only."""
    import sympy

    level = Parameter("level", 0, 10)
    limited = OutputError().insert_before("u", lambda x: sympy.Min(x, level.symbol), parameters=[level])
    return made(limited, VALUES | {"level": at})


@pytest.fixture
def data():
    u = np.where(steps(0) > 0, 1.0, 0.0)
    return record(u, lag(0.7 * u), heat=np.full(len(u), 30.0))


def test_the_difference_is_what_the_predictions_differ_by(data):
    found = separating_experiment({"gain": less(), "input_saturation": cut(0.7)}, data, "u", "y")
    first = simulate(OutputError(), {"u": found.values}, VALUES | {"b0": 0.35})["y"]
    second = lag(np.minimum(found.values, 0.7))
    assert found.difference == pytest.approx(np.sqrt(np.mean((first - second) ** 2)))
    assert f"{found.difference:.3g} bar RMS" in found.sentence


def test_it_stays_within_the_recorded_range_and_its_rivals(data):
    found = separating_experiment({"gain": less(), "input_saturation": cut(0.7)}, data, "u", "y")
    assert found.rivals == ("gain", "input_saturation")
    assert found.values.min() >= -1e-9
    assert found.values.max() <= 1 + 1e-9
    assert np.isfinite(found.values).all()
    assert found.signal in found.sentence
    assert "V" in found.sentence


def test_no_candidate_does_better(data):
    from smid.diagnosis.experiment import _candidates

    rivals = {"gain": less(), "input_saturation": cut(0.7)}
    found = separating_experiment(rivals, data, "u", "y")
    for values in _candidates(0.0, 1.0).values():
        runs = [simulate(f.model, {"u": values})["y"] for f in rivals.values()]
        assert np.sqrt(np.mean((runs[0] - runs[1]) ** 2)) <= found.difference * (1 + 1e-9)


def test_equal_models_differ_by_nothing(data):
    assert separating_experiment({"one": less(), "other": less()}, data, "u", "y").difference == 0.0


def test_a_model_that_runs_away_everywhere_separates_nothing(data):
    wild = made(OutputError(), {"a1": -50.0, "b0": 1.0})
    assert separating_experiment({"gain": less(), "wild": wild}, data, "u", "y") is None


def test_what_differs_by_another_channel_alone_is_told_apart():
    """At the mean of the heat both models are the same."""
    u = steps(0)
    heat = 30 + 10 * steps(1)
    data = record(u, lag(u), heat=heat)
    plain, mean = OutputError(), float(heat.mean())
    warmer = plain.insert_before("u", lambda x: x * (1 + (signal("heat")[t] - mean) / 20))
    found = separating_experiment({"gain": made(plain, VALUES), "scheduled": made(warmer, VALUES)}, data, "u", "y")
    moved = np.resize(heat, len(found.values)) - mean
    both = (
        simulate(plain, {"u": found.values}, VALUES)["y"],
        simulate(plain, {"u": found.values * (1 + moved / 20)}, VALUES)["y"],
    )
    assert found.difference == pytest.approx(np.sqrt(np.mean((both[0] - both[1]) ** 2)))
    assert found.difference > 0.1 * np.std(both[0])
