"""Solvers behind one call: the same certified bound from each, and errors before any work."""

import warnings

import numpy as np
import pytest
import sympy
from scipy import sparse

from relaxations.algebra.polynomial import Polynomials
from relaxations.errors import ProblemError
from relaxations.library import load
from relaxations.moments.conic import Cones, ConicProgram, multipliers
from relaxations.problem.problem import from_sympy
from relaxations.proof import bounding
from relaxations.proof.bounding import relax
from relaxations.proof.certificate import certify
from relaxations.search.enclosure import Reason
from relaxations.search.hierarchy import intervals
from relaxations.solvers import (
    Attempt,
    ConicSolution,
    Stop,
    attempts,
    available_solvers,
    back_ends,
    clarabel,
    interface,
    solve,
)
from relaxations.solvers.back_ends import ALL_CONES, DIRECT, BackEnd
from relaxations.solvers.scs import _rows
from relaxations.solvers.sdpa import _in_full
from relaxations.solvers.through_cvxpy import run


def product_problem():
    x, y, z = sympy.symbols("x y z")
    problem, _ = from_sympy(None, [1 - x - y], [x * y - z], [x, y, z], dict.fromkeys((x, y, z), (-1, 1)))
    return problem


def scaled_cost(relaxed, objective):
    scaled = relaxed.scaling.polynomials(objective)
    cost = np.zeros(relaxed.relaxation.n_moments)
    np.add.at(cost, relaxed.relaxation.moments_of(scaled.factors), scaled.coefficients.mid)
    return scaled, cost


def certified(relaxed, objective, solve_it):
    """Certify what ``solve_it(program, cost)`` answers."""
    scaled, cost = scaled_cost(relaxed, objective)
    solution = solve_it(relaxed.program, cost)
    assert solution.stop in (Stop.SOLVED, Stop.INEXACT)
    assert solution.dual.shape == (relaxed.program.n_rows,)
    assert solution.moments.shape == cost.shape
    return certify(relaxed.relaxation, scaled, multipliers(relaxed.relaxation, relaxed.program, solution.dual)).bound


def through_cvxpy(program, cost):
    stop, status, x, dual = run("CLARABEL", program, cost[1:])
    return ConicSolution(stop, status, np.r_[1.0, x], dual, 0.0)


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
    through = certified(relaxed, objective, through_cvxpy)
    tolerance = 1e-2 if method == "textbook" else 1e-5
    assert through == pytest.approx(straight, abs=tolerance)
    assert max(straight, through) <= model.truth[0]


def test_an_inexact_stop_is_a_status_and_no_warning(output_error):
    model = output_error(5, seed=1)
    relaxed = relax(model.problem, "textbook", 2)
    certified(relaxed, model.problem.variable(0), through_cvxpy)


def every_way():
    """Return each back end of ours for all cones with each of its settings; HiGHS has tests beside its relaxation."""
    return [(b, Attempt(b.name, setting)) for b in DIRECT if b.cones == ALL_CONES for setting in ("", *b.settings)]


# Widths: order 1 of the lift has second-order cones, order 2 and 3 wider blocks; a published problem has the rest.
PROGRAMS = {
    "product, lift 1": lambda: (product_problem(), "lift", 1, -1.0),
    "product, lift 3": lambda: (product_problem(), "lift", 3, -1.0),
    "product, dense 2": lambda: (product_problem(), "dense", 2, -1.0),
}


@pytest.mark.parametrize("way", every_way(), ids=lambda way: str(way[1]))
@pytest.mark.parametrize("name", PROGRAMS)
def test_every_back_end_certifies_the_optimum_within_its_accuracy(way, name):
    own, attempt = way
    if not own.installed:
        pytest.skip(f"{own.name} is not installed: {own.install}")
    problem, method, order, optimum = PROGRAMS[name]()
    bound = certified(relax(problem, method, order), problem.variable(2), lambda *given: solve(*given, attempt))
    assert optimum - 2 * own.accuracy <= bound <= optimum  # z has coefficient 1


@pytest.mark.parametrize("way", every_way(), ids=lambda way: str(way[1]))
@pytest.mark.parametrize(("name", "method", "order"), [("gms_st_e01", "textbook", 2), ("gms_Bst_bpv2", "sparse", 2)])
def test_every_back_end_stays_below_a_published_optimum(way, name, method, order):
    own, attempt = way
    if not own.installed:
        pytest.skip(f"{own.name} is not installed: {own.install}")
    case = load(name)
    relaxed = relax(case.problem, method, order, objective=case.objective)
    _, cost = scaled_cost(relaxed, case.objective)
    bound = certified(relaxed, case.objective, lambda *given: solve(*given, attempt))
    slack = 1e-7 * max(1.0, abs(case.optimum))  # the digits that the optimum is known to
    assert case.optimum - 2 * own.accuracy * np.abs(cost[1:]).sum() - slack <= bound <= case.optimum + slack


@pytest.mark.parametrize("way", every_way(), ids=lambda way: str(way[1]))
def test_every_back_end_leads_to_a_proof_that_a_set_is_empty(way):
    own, attempt = way
    if not own.installed:
        pytest.skip(f"{own.name} is not installed: {own.install}")
    x, y, z = sympy.symbols("x y z")
    problem, _ = from_sympy(None, [x**2 + y**2 - 3], [x * y - z], [x, y, z], dict.fromkeys((x, y, z), (-1, 1)))
    for method, order in (("lift", 1), ("dense", 2)):
        relaxed = relax(problem, method, order)
        _, cost = scaled_cost(relaxed, problem.variable(2))
        solution = solve(relaxed.program, cost, attempt)
        # Where the solver's arithmetic ends short of a ray, other settings are tried: the proof is what is promised.
        if solution.stop is Stop.INFEASIBLE:
            ray = multipliers(relaxed.relaxation, relaxed.program, solution.dual / np.abs(solution.dual).max())
            assert certify(relaxed.relaxation, Polynomials.from_terms([{}]), ray).bound > 0
        assert intervals(problem, [2], method=method, order=order, solver=own.name).empty is not None


def test_moments_within_their_box_rescue_a_diverging_dual():
    """As it stands the dual of this program has no optimum, and Clarabel ends far from any (a bound near -222)."""
    case = load("gms_Bex9_1_4")
    relaxed = relax(case.problem, "sparse", 2, objective=case.objective)
    bound = certified(relaxed, case.objective, lambda *given: solve(*given, Attempt("clarabel", "boxed")))
    assert case.optimum - 1e-3 <= bound <= case.optimum


def test_what_is_tried_begins_with_what_was_asked_for():
    assert attempts("clarabel")[:3] == (
        Attempt("clarabel"),
        Attempt("clarabel", "boxed"),
        Attempt("clarabel", "regularised"),
    )
    own, first, *_ = attempts("SCS")
    assert (own, first) == (Attempt("scs"), Attempt("clarabel", "boxed"))
    assert all(b.installed for a in attempts("scs") for b in DIRECT if b.name == a.solver)


def test_the_table_says_what_each_solver_takes():
    table = {b.name: b for b in back_ends()}
    assert {"clarabel", "sdpa", "scs"} <= set(table)
    assert table["clarabel"].installed
    assert "semidefinite" in table["scs"].cones
    assert "semidefinite" not in table["SCIPY"].cones
    assert table["SCIPY"].reached == "through cvxpy"
    assert set(available_solvers()) == {b.name for b in table.values() if b.installed}


def test_a_solver_that_is_not_installed_is_refused_with_the_line_that_installs_it(monkeypatch):
    absent = BackEnd("absent", "absent", "no_such_library", (), "", 0.0, (), "pip install absent-solver")
    monkeypatch.setattr(interface, "DIRECT", (absent, *DIRECT))
    with pytest.raises(
        ProblemError, match=r"'absent' is not installed: pip install absent-solver, or choose.*clarabel"
    ):
        intervals(product_problem(), [0], solver="absent")


def test_rows_for_sdpa_and_scs_hold_the_matrix_that_ours_do():
    matrix = np.array([[1.0, 2.0, 3.0], [2.0, 4.0, 5.0], [3.0, 5.0, 6.0]])
    j, i = np.tril_indices(3)
    ours = np.r_[7.0, 8.0, [1 + 4, 1 - 4, 2 * 2], matrix[i, j] * np.where(i == j, 1.0, np.sqrt(2.0))]
    cones = Cones(1, 1, (3,), (3,))
    full, widths = _in_full(cones)
    assert widths == (2, 3)
    assert full @ ours == pytest.approx(np.r_[7.0, 8.0, matrix[:2, :2].ravel(), matrix.ravel()])
    program = ConicProgram(sparse.csc_matrix((11, 1)), ours, cones, ())
    column_wise = matrix.T[np.triu_indices(3)] * np.where(np.eye(3)[np.triu_indices(3)] == 1, 1.0, np.sqrt(2.0))
    assert ours[_rows(program)] == pytest.approx(np.r_[ours[:5], column_wise])


def test_an_unknown_solver_is_refused_before_any_work(monkeypatch):
    def no_work(*_, **__):
        raise AssertionError("work was done")

    monkeypatch.setattr("relaxations.search.by_rounds.relax", no_work)
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
    assert all(word.startswith("broken") for word in found.intervals[0].status)


def test_a_solver_that_panics_has_failed_and_an_interrupt_has_not(monkeypatch):
    class PanicException(BaseException):  # as Clarabel's, which Python cannot import
        pass

    class Panicking:
        def __init__(self, *_):
            pass

        def set_termination_callback(self, _):
            pass

        def solve(self):
            raise failure("Eigval error")

    monkeypatch.setattr(clarabel.clarabel, "DefaultSolver", Panicking)
    relaxed = relax(product_problem(), "dense", 2)
    failure = PanicException
    solution = solve(relaxed.program, np.zeros(relaxed.relaxation.n_moments))
    assert (solution.stop, solution.status) == (Stop.FAILED, "Panic")
    assert np.isnan(solution.dual).all()
    failure = KeyboardInterrupt
    with pytest.raises(KeyboardInterrupt):
        solve(relaxed.program, np.zeros(relaxed.relaxation.n_moments))


def test_a_solution_carries_the_status_the_moments_and_the_time():
    relaxed = relax(product_problem(), "lift", 1)
    cost = np.zeros(relaxed.relaxation.n_moments)
    solution = solve(relaxed.program, cost)
    assert solution.stop in Stop
    assert solution.status
    assert solution.seconds > 0
    assert solution.moments[0] == 1.0
    assert solution.moments.shape == (relaxed.relaxation.n_moments,)
    assert solution.dual.shape == (relaxed.program.n_rows,)
    assert solution.seconds >= 0
