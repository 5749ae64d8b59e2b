"""Where inputs drive hidden states: no run with inputs in their range leaves the ranges."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from smid import Dataset, OwnModel
from smid.diagnosis.effects import EFFECTS
from smid.diagnosis.effects.effect import Site
from smid.diagnosis.proof.reached import reached, spans
from smid.models import simulate

LAG = OwnModel(["w[t] = p*w[t-1] + b*u[t-1]"], {"y": "w"}, ["u"], {"p": (-1, 1), "b": (-10, 10)})
U = np.repeat(np.random.default_rng(0).uniform(2.0, 5.0, 20), 4)
DATA = Dataset.from_arrays(input={"u": U}, output={"y": np.zeros(80)}, sampling_time=1.0)
DRIVEN = ("extra_lag", "rate_limit", "input_backlash", "hysteresis", "inner_curve")


def models(names: tuple[str, ...]) -> list:
    site = Site(DATA, "u", "y", (np.zeros(80),))
    found = [(e.name, own) for e in EFFECTS if e.name in names for own in e.extend(LAG, site)]
    return [pytest.param(own.model, id=f"{name} {own.label}") for name, own in found]


def at_rest(model) -> dict:
    values = {p.name: np.clip(0.5, p.lower, p.upper) for p in model.parameters}
    return simulate(model, {"u": U}, values, {name: [3.0] * 2 for name in model.states}, check=False)


@pytest.mark.parametrize("model", models(DRIVEN))
@settings(deadline=None, max_examples=20)
@given(seed=st.integers(0, 10_000))
def test_no_run_leaves_the_ranges(model, seed: int) -> None:
    rng = np.random.default_rng(seed)
    found = reached(model, spans(DATA), at_rest(model))
    values = {p.name: rng.choice([p.lower, p.upper, rng.uniform(p.lower, p.upper)]) for p in model.parameters}
    begin = {name: rng.uniform(*found.get(name, (0.0, 0.0)), 2) for name in model.states}
    u = rng.choice([U.min(), U.max(), rng.uniform(U.min(), U.max())], 80)
    with np.errstate(all="ignore"):
        run = simulate(model, {"u": u}, values, begin, check=False)
    for name, (low, high) in found.items():
        assert low <= np.nanmin(run[name]) <= np.nanmax(run[name]) <= high


@pytest.mark.parametrize("name", ["extra_lag", "rate_limit"])
def test_an_effect_of_unit_gain_stays_within_its_input(name: str) -> None:
    found = [reached(p.values[0], spans(DATA), at_rest(p.values[0])) for p in models((name,)) if "_u" not in p.id]
    own = [ends for one in found for state, ends in one.items() if state.startswith("u_")]
    assert own
    for ends in own:
        np.testing.assert_allclose(ends, (U.min(), U.max()), rtol=1e-5)


def test_what_grows_without_end_has_no_range() -> None:
    model = OwnModel(
        ["v[t] = v[t-1] + u[t-1]", "h[t] = 0.5*h[t-1] + v[t-1]", "w[t] = 0.5*w[t-1] + h[t-1]"], {"y": "w"}, ["u"], {}
    )
    assert not reached(model, spans(DATA), {name: np.ones(80) for name in "vh"})


def test_ranges_have_the_unit_of_the_input() -> None:
    model = OwnModel(
        ["v[t] = p*v[t-1] + (1 - p)*u[t]", "w[t] = 0.5*w[t-1] + v[t-1]"], {"y": "w"}, ["u"], {"p": (0, 0.9)}
    )
    (low, high), scale = reached(model, {"u": (2.0, 5.0)}, {"v": np.full(9, 3.0)})["v"], 1e3
    wide = reached(model, {"u": (2.0 * scale, 5.0 * scale)}, {"v": np.full(9, 3.0 * scale)})["v"]
    np.testing.assert_allclose(wide, (low * scale, high * scale))
