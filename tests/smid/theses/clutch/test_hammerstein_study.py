"""The Hammerstein study: its three phases against oracles, and what the thesis prints against what it defines."""

import json
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import linprog, minimize_scalar

from relaxations.search.enclosure import Reason
from smid.data import DataError
from smid.data.bundled import load_clutch
from smid.models import ModelError
from smid.study.finished import finished
from smid.study.widths import width_study
from smid.theses.clutch.hammerstein.free_runs import free_runs
from smid.theses.clutch.hammerstein.intervals import order_study
from smid.theses.clutch.hammerstein.model import clutch_hammerstein
from smid.theses.clutch.hammerstein.printed import (
    PRINTED,
    PRINTED_NOISE_BOUND,
    printed_central_model,
    printed_model,
    printed_step_model,
)
from smid.theses.clutch.hammerstein.structures import choose_structure
from smid.theses.clutch.hammerstein_study import CENTRAL, RECORD, hammerstein_study
from tests.smid.theses.clutch.small_clutch_studies import PART, small_hammerstein_study


@pytest.fixture(scope="module")
def study():
    return small_hammerstein_study()


def least_bound_at(pole, current, pressure):
    """The least noise bound at a fixed pole: the free run is linear in the coefficients and in its start."""
    v, n = 0.01 * current, len(current)
    runs = np.zeros((n, 4))
    runs[0, 3] = 1.0
    for t in range(1, n):
        runs[t] = pole * runs[t - 1]
        runs[t, :3] += (1 - pole) * v[t - 1] ** np.array([5, 4, 3])
    scale = np.abs(runs).max(axis=0)
    rows = np.hstack([runs / scale, np.full((n, 1), -1.0)])
    mirrored = np.hstack([-runs / scale, np.full((n, 1), -1.0)])
    found = linprog(
        [0, 0, 0, 0, 1],
        np.vstack([rows, mirrored]),
        np.concatenate([pressure, -pressure]),
        bounds=[(None, None)] * 4 + [(0, None)],
    )
    return found.fun


def test_the_error_bound_encloses_that_of_linear_programs(study):
    current, pressure = study.part.values("current"), study.part.values("pressure")
    oracle = minimize_scalar(
        lambda pole: least_bound_at(pole, current, pressure),
        bounds=(0.8, 0.95),
        method="bounded",
        options={"xatol": 1e-7},
    )
    assert study.bound.lower <= oracle.fun * (1 + 1e-6)
    assert oracle.fun == pytest.approx(study.bound.upper, rel=2e-3)
    for pole in np.linspace(0.05, 0.99, 20):  # no pole elsewhere does better
        assert least_bound_at(pole, current, pressure) >= study.bound.lower * (1 - 1e-6)


def test_intervals_shrink_with_the_order_and_grow_with_the_noise_bound(study):
    low, high = study.orders.estimates
    for name in study.widths.names:
        assert low[name].lower <= high[name].lower <= high[name].upper <= low[name].upper
    for smaller, larger in pairwise(study.widths.estimates):
        for name in study.widths.names:
            inner = smaller[name].inner_lower, smaller[name].inner_upper
            assert larger[name].lower <= inner[0] <= inner[1] <= larger[name].upper
            assert smaller[name].width < larger[name].width


def test_the_interval_holds_every_pole_that_linear_programs_allow(study):
    current, pressure = study.part.values("current"), study.part.values("pressure")
    bound = study.orders.estimates[-1].noise_bound["pressure"]
    interval = study.estimate["alpha"]
    for pole in np.linspace(0.8, 0.95, 40):
        if least_bound_at(pole, current, pressure) < bound:
            assert interval.lower <= -pole <= interval.upper


def test_free_runs_are_those_of_a_loop_by_hand(study):
    model = study.estimate.model.values
    data = study.validation.data
    for k, run in enumerate(data.experiments):
        v, pressure = 0.01 * run.values["current"], run.values["pressure"]
        x = model["gamma1"] * v**5 + model["gamma2"] * v**4 + model["gamma3"] * v**3
        w = pressure.copy()
        for t in range(1, len(w)):
            w[t] = -model["alpha"] * w[t - 1] + (1 + model["alpha"]) * x[t - 1]
        rmse = np.sqrt(np.mean((pressure - w)[1:] ** 2))
        assert study.runs.rmse(CENTRAL)[k] == pytest.approx(rmse, rel=1e-9)


def test_no_model_beats_least_squares_on_the_part_itself(study):
    models = {name: validation.model for name, validation in study.runs.validations.items()}
    on_part = free_runs(models, study.part)
    errors = {name: on_part.rmse(name)[0] for name in models}
    assert errors["least squares, all powers"] <= 1.05 * min(errors.values())
    assert errors["least squares"] <= 1.05 * errors[CENTRAL]


def test_the_structure_needs_three_powers(study):
    bounds = {s.powers: s.bound for s in study.structures.structures if s.bound is not None}
    assert bounds[3,].lower > bounds[4, 3].lower > bounds[5, 4, 3].lower > bounds[5, 4, 3, 2, 1].lower
    assert study.structures.choice.powers == (5, 4, 3)
    two_poles = next(s for s in study.structures.structures if s.poles == 2)
    assert two_poles.bound is None
    assert two_poles.n_parameters == 5


def test_what_the_thesis_prints_contradicts_itself(study):
    printed = {p.name: p for p in PRINTED}
    assert [name for name, p in printed.items() if p.inverted] == ["gamma1"]
    assert all(p.outside > 0 for p in PRINTED)
    assert printed["alpha"].outside == pytest.approx(-0.62932623 + 0.651257)
    assert printed["beta"].model == pytest.approx(1 + printed["alpha"].model, abs=1e-7)
    for p in PRINTED:  # the central estimates are the centres, as printed
        assert p.central == pytest.approx((p.lower + p.upper) / 2, rel=2e-3)
    assert printed["beta"].upper > 1 + printed["alpha"].upper + 3e-5
    assert any("inverted" in finding for finding in study.printed.findings)


def test_the_thesis_parameters_lie_in_the_certified_intervals_of_their_own_data(study):
    known = study.printed.known
    assert known.noise_bound == {"pressure": PRINTED_NOISE_BOUND}
    for p in PRINTED:
        if p.name != "beta":
            interval = known[p.name]
            assert interval.lower <= p.central <= interval.upper
            assert interval.lower <= interval.inner_lower <= interval.inner_upper <= interval.upper
            assert interval.inner_upper - interval.inner_lower > 10 * abs(p.width)


def test_the_printed_models_are_those_of_the_equations():
    for model, column in ((printed_central_model(), "central"), (printed_model(), "model")):
        for p in PRINTED:
            if p.name != "beta":
                assert model.values[p.name] == getattr(p, column)
    current = np.full(400, 800.0)
    data = load_clutch("20C_step_a").crop(0, 400)
    run = data.experiments[0]
    data = data.with_experiments([replace(run, values={**run.values, "current": current})])
    found = free_runs({"HS20": printed_step_model()}, replace(data, outputs=("pressure",)))
    x = 7.31e-15 * 800**5 - 2.28e-11 * 800**4 + 2.36e-8 * 800**3 - 6.9e-6 * 800**2 + 5.77e-4 * 800
    assert found.validations["HS20"].simulated[0]["pressure"][-1] == pytest.approx(x / (1 - 0.9562))


def test_the_study_tells_its_tables_and_draws_its_figures(study):
    text = str(study)
    for words in ("Phase 1", "Phase 2", "Phase 3", "Choice of the structure", "thesis's HS20", "Conclusion"):
        assert words in text
    assert f"{PART[0]}:{PART[1]}" in study.part.source
    assert "proven; the sensor errs by at most 0.3 bar" in study.conclusion
    assert len(study.beside_thesis.rows) == 8
    found = json.loads(json.dumps(study.to_dict(), allow_nan=False))
    assert [e["order"] for e in found["orders"]["estimates"]] == [1, 2]
    assert len(study.plot().axes) == 2 * len(study.runs.records)
    assert len(study.runs.plot().axes) == 1
    assert len(study.widths.plot().axes) == 1
    assert len(study.printed.plot().axes) == 4


def test_an_interrupted_study_ends(study):
    with pytest.raises(KeyboardInterrupt):
        finished(replace(study.bound, reason=Reason.INTERRUPTED))
    assert finished(study.bound) is study.bound


@pytest.mark.parametrize(
    ("part", "cause"),
    [
        ((-1, 100), "-1:100 of 20C_ramp_a is refused: give at least 50"),
        ((100, 120), "100:120"),
        ((4990, 5100), "its 5001"),
        ((0, 60), "says too little of the model"),
    ],
)
def test_a_part_that_cannot_be_used_is_refused(part, cause):
    with pytest.raises(DataError, match=cause):
        hammerstein_study(load_clutch((RECORD, "20C_step_a")), part)


def test_records_that_lack_something_are_refused():
    with pytest.raises(DataError, match="20C_ramp_a"):
        hammerstein_study(load_clutch("20C_step_a"))
    with pytest.raises(DataError, match="pressure"):
        hammerstein_study(load_clutch((RECORD, "20C_step_a")).rename({"pressure": "p"}))


def test_settings_that_make_no_sense_are_refused(study):
    model = clutch_hammerstein()
    for orders, cause in (((0,), "order = 0"), ((), "no relaxation order"), ((1.5,), "order = 1.5"), ((True,), "True")):
        with pytest.raises(ModelError, match=cause):
            order_study(model, study.part, 1.0, orders)
    for factors, cause in (((0.9,), "factor = 0.9"), ((), "no noise bound"), ((float("nan"),), "factor = nan")):
        with pytest.raises(ModelError, match=cause):
            width_study(model, study.part, study.bound, factors)
    with pytest.raises(ModelError, match="nothing to simulate"):
        free_runs({}, study.part)
    with pytest.raises(ModelError, match="no structure with one pole"):
        choose_structure(study.part, study.part, [(2, (3,))])
