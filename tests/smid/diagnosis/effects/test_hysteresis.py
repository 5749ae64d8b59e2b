"""Plays between two ends follow relays of Preisach, wherever their range lies, and keep its ends."""

import re

import numpy as np
import pytest

from smid import OutputError
from smid.diagnosis.effects.check import cases
from smid.diagnosis.effects.hysteresis import EFFECT, describe
from smid.diagnosis.search.trial import fitted_base, try_effect
from smid.models import simulate
from tests.smid.diagnosis.lag_records import lag, record

LOW, HIGH = 1.0, 5.0


def relays(u: np.ndarray, count: int = 100) -> np.ndarray:
    """The mean of relays with all pairs of thresholds between LOW and HIGH, at first up where that is nearer."""
    levels = np.linspace(LOW, HIGH, count)
    up, down = (a[np.triu_indices(count)] for a in np.meshgrid(levels, levels))
    state, out = np.where(up + down < 2 * u[0], 1.0, -1.0), np.empty(len(u))
    for k, now in enumerate(u):
        state = np.where(up <= now, 1.0, np.where(down > now, -1.0, state))
        out[k] = (LOW + HIGH) / 2 + (HIGH - LOW) / 2 * state.mean()
    return out


@pytest.mark.parametrize("begun", [LOW, 3.0, 4.8])
def test_relays_are_followed_whose_ends_the_record_does_not_reach(begun: float) -> None:
    rng = np.random.default_rng(3)
    u = np.repeat(rng.uniform(LOW + 0.4, HIGH - 0.4, 60), 10)
    u[:10] = begun
    data = record(u, lag(0.2 * u + 0.8 * relays(u)), bound=0.02)
    used = (np.arange(len(u)) < 400,)
    base = fitted_base(OutputError(stable=True), data, used, "u", "y")
    trial = try_effect(EFFECT, base)
    assert trial is not None
    held = ~used[0]
    before, after = (np.sqrt(np.mean(f.residual(data, "y")[0][held] ** 2)) for f in (base.fit, trial.fit))
    assert trial.label == "Preisach at the input"
    assert after < 0.12 * before


def test_no_hysteresis_is_a_bias() -> None:
    u = np.repeat(np.random.default_rng(3).uniform(-1, 1, 60), 10)
    data = record(u, lag(u) + 0.3, bound=0.02)
    base = fitted_base(OutputError(stable=True), data, (np.ones(len(u), bool),), "u", "y")
    trial = try_effect(EFFECT, base)
    assert trial is not None
    assert np.std(trial.fit.residual(data, "y")[0]) > 2 * 0.02 / np.sqrt(3)


def test_a_loop_keeps_the_ends_of_the_range() -> None:
    case = cases()[0]
    for extension in EFFECT.extend(case.model, case.site):
        if not extension.label.endswith("at the input"):
            continue
        for start in extension.starts:
            model = extension.model
            span = case.site.span(case.site.input)
            low, high = (start.get(f"input_relay_{end}", e) for end, e in zip(("bottom", "top"), span, strict=True))
            sweep = np.concatenate([np.linspace(low, high, 50), np.linspace(high, low, 50), np.linspace(low, high, 50)])
            values = {p.name: start.get(p.name, case.model.values.get(p.name, 0.0)) for p in model.parameters}
            joined = simulate(model, {case.site.input: sweep}, values)[f"{case.site.input}_joined"]
            assert np.isclose(joined[99], low, rtol=0.02 * (high - low))
            assert np.isclose(joined[149], high, rtol=0.02 * (high - low))
            wide = abs(joined[24] + joined[25] - joined[74] - joined[75]) / 2
            assert wide > 0.01 * (high - low)
            told = re.search(r"a loop (\S+) ", describe({p: values[p] for p in start}, case.site))
            if extension.label.startswith("Preisach"):
                assert told is not None
                assert np.isclose(float(told[1]), wide, rtol=0.05)
