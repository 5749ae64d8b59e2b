"""Designed inputs carry more information, keep their amplitude, and their information is what estimators reach."""

import numpy as np
import pytest

from smid.design import InputFamily, d_optimal, fisher_information, model_information, shrinking_input
from smid.models import ModelError, OutputError, Reactor
from smid.signals import TABLE_F1, constant, prbs
from smid.theses.hybrid.arm.exact_motion import exact_motion
from smid.theses.hybrid.inputs import arm_information, arm_sines, arm_tailored

H = 0.02


def test_the_bound_is_what_least_squares_reaches():
    u = prbs(200, seed=1, clock_period=3.0)
    values = {"tau": 2.0, "a": 1.3}
    model = Reactor(tau=None, a=None, sampling_time=0.5, substeps=4)
    told = model_information(model, {"u": u}, values, 0.01)

    def response(tau, a):
        decay = np.exp(-a / tau * 0.5)
        y = [0.0]
        for held in [u[0], *u[:-1]]:  # from one sample before the record
            y.append(decay * y[-1] + (1 - decay) * (1 / tau - 0.12) * tau / a * held)
        return np.array(y[1:])

    random = np.random.default_rng(2)
    slopes = np.stack(
        [
            (response(2.0 + 1e-6, 1.3) - response(2.0 - 1e-6, 1.3)) / 2e-6,
            (response(2.0, 1.3 + 1e-6) - response(2.0, 1.3 - 1e-6)) / 2e-6,
        ],
        axis=1,
    )
    begun = np.exp(-1.3 / 2.0 * 0.5 * np.arange(len(u)))[:, None]
    expected = fisher_information(slopes, ("tau", "a"), (2.0, 1.3), 0.01, nuisance=begun)
    np.testing.assert_allclose(told.relative, expected.relative, rtol=1e-3)
    errors = [
        np.linalg.lstsq(np.hstack([slopes, begun]), random.normal(0, 0.01, len(u)), rcond=None)[0][:2]
        for _ in range(2000)
    ]
    spread = np.std(errors, axis=0) / [2.0, 1.3]
    np.testing.assert_allclose(told.relative_deviations, spread, rtol=0.08)


def test_an_unknown_start_costs_information():
    u = prbs(60, seed=1)
    values = {"a1": -0.9, "b0": 0.3}
    known = model_information(OutputError(), {"u": u}, values, 0.1, unknown_start=False)
    unknown = model_information(OutputError(), {"u": u}, values, 0.1)
    assert np.linalg.eigvalsh(known.matrix - unknown.matrix).min() >= -1e-6
    assert unknown.log_determinant < known.log_determinant


def test_the_arms_slopes_predict_a_changed_motion():
    u = TABLE_F1["six_equal"].signal(300, H)
    told = arm_information(u, H, 1.0, names=("theta", "Wd"))
    # s' M s is the squared change of the angle, what start and speed explain taken away.
    step = 1e-5
    change = exact_motion(u, H, values={"Wd": 0.43 * (1 + step)})[:, 0] - exact_motion(u, H)[:, 0]
    moved = exact_motion(u, H, start=(0.0, 1e-6))[:, 0] - exact_motion(u, H)[:, 0]
    others = np.stack([np.ones(300), moved], axis=1)
    left = change - others @ np.linalg.lstsq(others, change, rcond=None)[0]
    assert told.relative[1, 1] * step**2 == pytest.approx(left @ left, rel=1e-2)


def test_a_constant_tells_no_dynamics():
    model = Reactor(tau=None, a=None, sampling_time=0.5)
    settled = model_information(
        model, {"u": constant(50, offset=0.5)}, {"tau": 2.0, "a": 1.0}, 0.01, initial={("w", 1): 0.38}
    )
    assert settled.log_determinant == -np.inf
    assert np.isinf(settled.relative_deviations).all()


def test_the_d_optimal_sum_beats_those_of_the_thesis_within_its_amplitude():
    family = arm_sines(250, H)

    def information(u):
        return arm_information(u, H, 0.001, names=("theta", "b", "Wd"))

    found = d_optimal(family, information, budget=150, seed=1)
    assert np.abs(found.input).max() <= 1 + 1e-12
    for sines in TABLE_F1.values():
        u = sines.signal(250, H)
        fitting = u / max(1.0, np.abs(u).max())
        assert found.information.log_determinant > information(fitting).log_determinant
    np.testing.assert_array_equal(
        d_optimal(family, information, budget=60).input, d_optimal(family, information, budget=60).input
    )


def test_the_shrinking_search_never_ends_worse_than_it_began():
    family = arm_tailored(200, H)
    start = (0.5, 1.5, 0.1, 0.05, 0.5, 0.3, 0.3)

    def widths(u):
        return {"flatness": float(np.abs(np.diff(u)).sum()), "power": 3.0 / float(u @ u), "never told": 7.0}

    found = shrinking_input(family, widths, budget=12, starts=[start])
    assert found.costs[0] == pytest.approx(sum(np.log(min(w, 1.0)) for w in widths(family.signal(start)).values()))
    assert sum(np.log(min(w, 1.0)) for w in found.widths.values()) == pytest.approx(found.costs.min())
    assert found.costs.min() < found.costs[0]
    assert "after 12 evaluated inputs" in str(found)


def test_bad_input_is_refused():
    family = InputFamily("level", lambda c: np.full(5, c[0]), ("level",), (0,), (1,), 1.0)
    with pytest.raises(ModelError, match="empty box"):
        InputFamily("none", lambda c: c, ("x",), (1,), (1,), 1.0)
    with pytest.raises(ModelError, match="as many lower"):
        InputFamily("none", lambda c: c, ("x",), (1, 2), (3,), 1.0)
    with pytest.raises(ModelError, match="amplitude"):
        InputFamily("none", lambda c: c, ("x",), (0,), (1,), 0.0)
    with pytest.raises(ModelError, match="2 samples for 3 unknowns"):
        fisher_information(np.eye(2), "ab", (1, 1), 1.0, nuisance=np.ones((2, 1)))
    with pytest.raises(ModelError, match="one column for each"):
        fisher_information(np.eye(3), "ab", (1, 1), 1.0)
    with pytest.raises(ModelError, match="deviation"):
        fisher_information(np.eye(2), "ab", (1, 1), 0.0)
    with pytest.raises(ModelError, match="no value zero"):
        fisher_information(np.eye(2), "ab", (1, 0), 1.0)
    with pytest.raises(ModelError, match="no value for b0"):
        model_information(OutputError(), {"u": np.ones(5)}, {"a1": 0.1}, 1.0)
    with pytest.raises(ModelError, match="diverges"):
        model_information(OutputError(), {"u": np.ones(9999)}, {"a1": -9.0, "b0": 1.0}, 1.0)
    with pytest.raises(ModelError, match="two generations"):
        d_optimal(family, lambda _: fisher_information(np.eye(2), "ab", (1, 1), 1.0), budget=3)
    with pytest.raises(ModelError, match="makes all parameters identifiable"):
        d_optimal(family, lambda _: fisher_information(np.ones((2, 2)), "ab", (1, 1), 1.0), budget=10)
    with pytest.raises(ModelError, match="is not above"):
        shrinking_input(family, lambda _: {"x": 1.0}, budget=1, starts=[(0.5,)])
