"""Solvers behind one call: the same certified bound from each, and errors before any work."""

import warnings
from functools import partial

import numpy as np
import pytest
import sympy

from relaxations import bounding, hierarchy
from relaxations.bounding import relax
from relaxations.certificate import certify
from relaxations.conic import multipliers
from relaxations.errors import ProblemError
from relaxations.hierarchy import Reason, intervals
from relaxations.problem import from_sympy
from relaxations.solvers import ConicSolution, Stop, available_solvers, solve
from relaxations.solvers.through_cvxpy import run


def product_problem():
    x, y, z = sympy.symbols("x y z")
    problem, _ = from_sympy(None, [1 - x - y], [x * y - z], [x, y, z], dict.fromkeys((x, y, z), (-1, 1)))
    return problem


def certified(relaxed, objective, run):
    scaled = relaxed.scaling.polynomials(objective)
    cost = np.zeros(relaxed.relaxation.n_moments)
    np.add.at(cost, relaxed.relaxation.moments_of(scaled), scaled.coefficients.mid)
    stop, _, _, dual = run(relaxed.program, cost[1:])
    assert stop in (Stop.SOLVED, Stop.INEXACT)
    return certify(relaxed.relaxation, scaled, multipliers(relaxed.relaxation, relaxed.program, dual)).bound


@pytest.fixture
def inexact_is_no_news():
    """cvxpy's warning of an inexact solution, which has a test of its own."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Solution may be inaccurate")
        yield


# Widths: lift order 1 has second-order cones, order 2 wider blocks; the rest facial reduction.
@pytest.mark.parametrize(("method", "order"), [("lift", 1), ("lift", 2), ("lift", 3), ("sparse", 2), ("textbook", 2)])
@pytest.mark.usefixtures("inexact_is_no_news")
def test_clarabel_through_cvxpy_certifies_what_clarabel_does(output_error, method, order):
    model = output_error(5, seed=1)
    relaxed = relax(model.problem, method, order)
    objective = model.problem.variable(0)
    straight = relaxed.bound(objective).bound
    through = certified(relaxed, objective, partial(run, "CLARABEL"))
    tolerance = 1e-2 if method == "textbook" else 1e-5
    assert through == pytest.approx(straight, abs=tolerance)
    assert max(straight, through) <= model.truth[0]


def test_an_inexact_stop_is_a_status_and_no_warning(output_error):
    model = output_error(5, seed=1)
    relaxed = relax(model.problem, "textbook", 2)
    certified(relaxed, model.problem.variable(0), partial(run, "CLARABEL"))


@pytest.mark.parametrize(("method", "order"), [("lift", 1), ("lift", 3), ("dense", 2)])
@pytest.mark.usefixtures("inexact_is_no_news")
def test_scs_certifies_what_clarabel_does(method, order):
    problem = product_problem()
    for k, sign in ((0, 1.0), (2, 1.0), (2, -1.0)):
        objective = problem.variable(k, sign)
        straight = relax(problem, method, order).bound(objective).bound
        through = relax(problem, method, order, "SCS").bound(objective).bound
        assert through == pytest.approx(straight, abs=2e-3)


def test_an_unknown_solver_is_refused_before_any_work(monkeypatch):
    def no_work(*_, **__):
        raise AssertionError("work was done")

    monkeypatch.setattr(hierarchy, "relax", no_work)
    monkeypatch.setattr(bounding, "solve", no_work)
    with pytest.raises(ProblemError, match=r"unknown solver 'mosec': choose one of clarabel, ") as caught:
        intervals(product_problem(), [0], solver="mosec")
    for name in available_solvers():
        assert name in str(caught.value)


def test_a_solver_that_cannot_treat_the_cones_proves_nothing_and_says_so():
    # OSQP knows no semidefinite cone.
    found = intervals(product_problem(), [2], method="dense", order=2, solver="OSQP", rounds=1)
    assert (found.intervals[0].lower, found.intervals[0].upper) == (-1.0, 1.0)
    assert all(s not in ("not solved", "optimal") for s in found.intervals[0].status)


@pytest.mark.parametrize("method", ["lift", "dense"])
def test_a_solver_that_answers_nan_proves_nothing(monkeypatch, method):
    def broken(program, objective, _solver):
        nan = np.full(program.n_rows, np.nan)
        return ConicSolution(Stop.FAILED, "broken", np.full(len(objective), np.nan), nan, 0.0)

    monkeypatch.setattr(bounding, "solve", broken)
    found = intervals(product_problem(), [2], method=method, order=2)
    assert (found.intervals[0].lower, found.intervals[0].upper) == (-1.0, 1.0)
    assert found.reason in (Reason.STALLED, Reason.ROUNDS, Reason.TIGHT)
    assert found.intervals[0].status == ("broken", "broken")


def test_a_solution_carries_the_status_the_moments_and_the_time():
    relaxed = relax(product_problem(), "lift", 1)
    cost = np.zeros(relaxed.relaxation.n_moments)
    solution = solve(relaxed.program, cost)
    assert solution.stop is Stop.SOLVED
    assert solution.status == "Solved"
    assert solution.moments[0] == 1.0
    assert solution.moments.shape == (relaxed.relaxation.n_moments,)
    assert solution.dual.shape == (relaxed.program.n_rows,)
    assert solution.seconds >= 0
