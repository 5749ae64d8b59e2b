"""A broken line is followed where the record stays away from zero, and keeps zero where it does not."""

import numpy as np
import pytest
import sympy

from smid import OutputError
from smid.diagnosis.effects.input_curve import EFFECT
from smid.diagnosis.search.trial import fitted_base, try_effect
from smid.models import Model, signal, t
from tests.smid.diagnosis.lag_records import lag, record

KNOTS, HEIGHTS = (2.0, 3.5, 5.0, 8.0), (0.0, 0.9, 3.3, 6.0)


def curved(model: Model, level: float) -> float:
    """Return what an input becomes."""
    (line,) = (line for line in model.lines if line.signal == "u_curved")
    known = {sympy.Symbol(name, real=True): value for name, value in model.values.items()}
    return float(line.expression.subs({signal("u")[t]: level, **known}).doit())


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_curve_that_begins_where_the_record_does_is_followed(side: float) -> None:
    u = np.repeat(np.random.default_rng(5).uniform(KNOTS[0], KNOTS[-1], 60), 8)
    data = record(side * u, lag(np.interp(u, KNOTS, HEIGHTS)), bound=0.02)
    used = (np.arange(len(u)) < 380,)
    base = fitted_base(OutputError(stable=True), data, used, "u", "y")
    trial = try_effect(EFFECT, base)
    assert trial is not None
    assert trial.label == "3 straight pieces"
    noise = 0.02 / np.sqrt(3)  # RMS of what is uniform within the bound
    assert np.sqrt(np.mean(trial.fit.residual(data, "y")[0][380:] ** 2)) < 1.1 * noise
    assert curved(trial.fit.model, side * KNOTS[0]) == pytest.approx(0.0, abs=0.05)


def test_zero_stays_zero_where_the_record_has_it() -> None:
    u = np.repeat(np.random.default_rng(5).uniform(-3, 5, 60), 8)
    data = record(u, lag(u), bound=0.02)
    base = fitted_base(OutputError(stable=True), data, (np.ones(len(u), bool),), "u", "y")
    for extension in EFFECT.extend(base.fit.model, base.site()):
        assert curved(extension.model.with_values(extension.starts[0]), 0.0) == 0.0
