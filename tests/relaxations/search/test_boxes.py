"""Boxes for variables that have none: derived and true, or told to be missing."""

import numpy as np
import pytest
from scipy.optimize import linprog

from relaxations.algebra.polynomial import Polynomials
from relaxations.problem.problem import PolynomialProblem
from relaxations.proof import bounding
from relaxations.search.boxes import derive_box
from relaxations.search.hierarchy import intervals


def without_bounds(model, loose, half=False):
    lower, upper = model.problem.lower.copy(), model.problem.upper.copy()
    upper[loose] = np.inf
    if not half:
        lower[loose] = -np.inf
    return model.problem.with_box(lower, upper)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("magnitude", [0.01, 1.0, 300.0])
def test_a_derived_box_holds_every_feasible_gain(output_error, seed, magnitude):
    model = output_error(15, seed=seed)
    problem = without_bounds(model, [1])
    found = derive_box(problem, np.full(problem.n_variables, magnitude))
    assert found.derived == ("b1",)
    assert found.unbounded == ()
    # The oracle's box of [-5, 5] is inactive, so that its linear programs say what is true without a box.
    low, high = model.linear_interval(0, model.pole_interval())
    assert -5 < low < high < 5
    assert found.problem.lower[1] <= low
    assert found.problem.upper[1] >= high
    assert np.isfinite(found.problem.upper[1] - found.problem.lower[1])
    assert (found.problem.lower[2:] == problem.lower[2:]).all()


def test_intervals_on_a_derived_box_are_those_on_a_wide_one(output_error):
    model = output_error(15, seed=1)
    problem = without_bounds(model, [1])
    derived = derive_box(problem, np.ones(problem.n_variables)).problem
    for one, two in zip(intervals(derived, [0, 1]).intervals, intervals(model.problem, [0, 1]).intervals, strict=True):
        assert one.lower == pytest.approx(two.lower, abs=3e-4 * two.width)
        assert one.upper == pytest.approx(two.upper, abs=3e-4 * two.width)


def test_a_derived_box_agrees_with_scip(output_error):
    scip = pytest.importorskip("pyscipopt", reason="pyscipopt is not installed")
    model = output_error(10, seed=2)
    problem = without_bounds(model, [1])
    found = derive_box(problem, np.ones(problem.n_variables)).problem
    for sense in ("minimize", "maximize"):
        m = scip.Model()
        m.hideOutput()
        x = [
            m.addVar(lb=None if np.isinf(a) else a, ub=None if np.isinf(b) else b)
            for a, b in zip(problem.lower.tolist(), problem.upper.tolist(), strict=True)
        ]
        p = problem.equalities
        for row in range(p.n_rows):
            terms = []
            for c, factor in zip(p.coefficients.mid[p.rows == row], p.factors[p.rows == row], strict=True):
                term = float(c)
                for v in factor:
                    term = term * x[v] if v >= 0 else term
                terms.append(term)
            m.addCons(scip.quicksum(terms) == 0)
        m.setObjective(x[1], sense)
        m.optimize()
        assert m.getStatus() == "optimal"
        assert found.lower[1] - 1e-5 <= m.getObjVal() <= found.upper[1] + 1e-5


def test_a_half_open_box_keeps_its_finite_end(output_error):
    model = output_error(12, seed=3)
    lower = model.problem.lower.copy()
    lower[1] = 0.5
    problem = without_bounds(model, [1], half=True).with_box(lower, without_bounds(model, [1]).upper)
    found = derive_box(problem, np.ones(problem.n_variables))
    assert found.derived == ("b1",)
    assert found.problem.lower[1] == 0.5
    assert found.problem.upper[1] >= model.truth[1]


def test_several_unbounded_gains_of_a_model_that_is_linear(hammerstein):
    model = hammerstein(12, seed=1, powers=2)
    poles = [CLUTCH - 0.05, CLUTCH + 0.05]
    lower, upper = model.problem.lower.copy(), model.problem.upper.copy()
    lower[0], upper[0] = poles
    lower[1:3], upper[1:3] = -np.inf, np.inf
    problem = model.problem.with_box(lower, upper)
    found = derive_box(problem, np.ones(problem.n_variables))
    assert found.derived == ("b1", "b2")
    # At fixed poles, without a box.
    for pole in np.linspace(*poles, 7):
        g = model.responses(pole)
        for k in (0, 1):
            for sign in (1, -1):
                cost = np.zeros(3)
                cost[1 + k] = sign
                end = linprog(
                    cost,
                    A_ub=np.r_[g, -g],
                    b_ub=np.r_[model.y + model.noise_bound, model.noise_bound - model.y],
                    bounds=(None, None),
                )
                if end.status == 0:
                    assert found.problem.lower[1 + k] <= sign * end.fun + 1e-9
                    assert sign * end.fun - 1e-9 <= found.problem.upper[1 + k]


CLUTCH = -0.65142


def silent_gain(model):
    """Return the problem with an input that is zero and a gain without bounds."""
    p = model.problem.equalities
    gain = (p.factors == 1).any(axis=1)
    silent = Polynomials(p.n_rows, p.rows[~gain], p.factors[~gain], p.coefficients[~gain])
    lower, upper = model.problem.lower.copy(), model.problem.upper.copy()
    lower[1], upper[1] = -np.inf, np.inf
    return PolynomialProblem(model.problem.names, lower, upper, silent, Polynomials.empty())


def test_a_gain_without_input_is_reported_unbounded(output_error):
    problem = silent_gain(output_error(10))
    found = derive_box(problem, np.ones(problem.n_variables))
    assert found.unbounded == ("b1",)
    assert found.derived == ()
    assert found.problem is problem


def test_a_product_of_unbounded_variables_is_reported_not_guessed():
    problem = PolynomialProblem(
        ("x", "y"),
        np.full(2, -np.inf),
        np.full(2, np.inf),
        Polynomials.from_terms([{(0, 1): 1.0, (): -1.0}]),
        Polynomials.empty(),
    )
    found = derive_box(problem, np.ones(2))
    assert found.unbounded == ("x", "y")
    assert found.problem is problem


def test_a_finite_box_is_left_alone(output_error):
    problem = output_error(5).problem
    assert derive_box(problem, np.ones(problem.n_variables)).problem is problem


def test_a_plain_polytope_is_boxed():
    # |x + y| <= 1, |x - y| <= 3
    problem = PolynomialProblem(
        ("x", "y"),
        np.full(2, -np.inf),
        np.full(2, np.inf),
        Polynomials.empty(),
        Polynomials.from_terms(
            [{(): c, (0,): s, (1,): s * r} for c, r in ((1.0, 1.0), (3.0, -1.0)) for s in (1.0, -1.0)]
        ),
    )
    found = derive_box(problem, np.ones(2))
    assert found.derived == ("x", "y")
    assert (found.problem.upper >= 2).all()
    assert (found.problem.lower <= -2).all()
    assert found.problem.upper.max() < 2.01


@pytest.mark.parametrize("failure", [KeyboardInterrupt, MemoryError])
@pytest.mark.parametrize("call", [1, 2, 3])
def test_an_interruption_is_not_mistaken_for_an_unbounded_variable(output_error, monkeypatch, failure, call):
    problem = silent_gain(output_error(10))
    real, calls = bounding.solve, []

    def fails_at_last(*arguments):
        calls.append(1)
        if len(calls) == call:
            raise failure
        return real(*arguments)

    monkeypatch.setattr(bounding, "solve", fails_at_last)
    with pytest.raises(failure):
        derive_box(problem, np.ones(problem.n_variables))


def test_a_latent_whose_box_leaves_out_zero_is_scaled_rightly():
    # x = 3 z with z in [1, 2].
    problem = PolynomialProblem(
        ("x", "z"),
        np.array([-np.inf, 1.0]),
        np.array([np.inf, 2.0]),
        Polynomials.from_terms([{(0,): 1.0, (1,): -3.0}]),
        Polynomials.empty(),
    )
    found = derive_box(problem, np.ones(2))
    assert found.derived == ("x",)
    assert found.problem.lower[0] <= 3
    assert found.problem.upper[0] >= 6
