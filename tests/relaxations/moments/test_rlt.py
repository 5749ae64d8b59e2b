"""The linear variant of the lift: sound, primal meets dual, and never tighter than what is true or than the lift."""

import numpy as np
import pytest

from relaxations import check
from relaxations.errors import ProblemError
from relaxations.library import load, names
from relaxations.moments.parametric_lift import complicating_variables, least_order
from relaxations.proof.bounding import relax
from relaxations.proof.certificate_file import write_certificate
from relaxations.proof.proof_steps import Bound
from relaxations.search.enclosure import Reason
from relaxations.search.hierarchy import intervals
from relaxations.solvers import solve

SOLVERS = ("clarabel", "highs")


def with_objective(name):
    """Return a named problem whose objective is lifted too: only points near the optimum are left, and it stays."""
    known = load(name)
    return known.problem.with_inequalities(known.objective.below(known.optimum + max(1.0, abs(known.optimum))))


def lifted(name):
    """Return the least order of the lift of a small named problem with a box; zero where it does not apply."""
    if not load(name).is_bounded or load(name).problem.n_variables > 17:
        return 0
    problem = with_objective(name)
    complicating = complicating_variables(problem, 2)
    return 0 if complicating is None else least_order([problem.equalities, problem.inequalities], complicating)


LIFTED = {name: order for name in names() if (order := lifted(name))}


def test_there_are_named_problems_for_the_lift():
    assert len(LIFTED) >= 8


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("name", LIFTED)
def test_no_bound_lies_above_a_known_optimum(name, solver):
    known = load(name)
    bound = relax(with_objective(name), "rlt", LIFTED[name], solver).bound(known.objective).bound
    assert bound <= known.optimum + 1e-7 * max(1.0, abs(known.optimum))


@pytest.mark.parametrize("seed", range(2))
def test_random_sets_hold_the_truth_and_no_interval_is_tighter_than_their_points(output_error, seed):
    model = output_error(8, seed=seed, pole=(-0.8, 0.4)[seed])
    points = model.sample(80, np.random.default_rng(seed))
    found = intervals(model.problem, [0, 1], method="rlt", solver="highs")
    lift = intervals(model.problem, [0, 1], method="lift")
    assert found.method == "rlt"
    for k, (own, other) in enumerate(zip(found.intervals, lift.intervals, strict=True)):
        assert own.lower <= model.truth[k] <= own.upper
        assert own.lower <= points[:, k].min()
        assert points[:, k].max() <= own.upper
        # The true range is wider than what the witnesses of the lift span.
        assert own.lower <= other.inner_lower
        assert other.inner_upper <= own.upper
        assert own.gap <= 1e-3 * own.width  # it comes as far by contraction


@pytest.mark.parametrize("order", [1, 2])
def test_with_one_complicating_variable_the_lift_is_at_least_as_tight(output_error, hammerstein, order):
    for model in (output_error(12, seed=5), hammerstein(9, seed=6)):
        relaxed = {method: relax(model.problem, method, order) for method in ("lift", "rlt")}
        for k in (0, 1):
            for sign in (1.0, -1.0):
                objective = model.problem.variable(k, sign)
                width = model.problem.upper[k] - model.problem.lower[k]
                bounds = {method: own.bound(objective).bound for method, own in relaxed.items()}
                assert bounds["lift"] >= bounds["rlt"] - 1e-6 * width


@pytest.mark.parametrize("solver", SOLVERS)
def test_primal_meets_dual(output_error, solver):
    model = output_error(12, seed=7)
    for order in (1, 2):
        relaxed = relax(model.problem, "rlt", order, solver)
        cost = np.zeros(relaxed.relaxation.n_moments)
        cost[
            int(np.flatnonzero((relaxed.relaxation.degrees == 1) & (relaxed.relaxation.monomials.max(axis=1) == 0))[0])
        ] = 1
        solution = solve(relaxed.program, cost, solver)
        rows = relaxed.program
        slack = rows.rhs - rows.matrix @ solution.moments[1:]
        assert abs(slack[: rows.cones.zero]).max() < 1e-7
        assert slack[rows.cones.zero :].min() > -1e-7
        dual = -rows.rhs @ solution.dual - np.abs(cost[1:] + rows.matrix.T @ solution.dual).sum()
        assert cost @ solution.moments == pytest.approx(dual, abs=1e-6)


def test_highs_proves_an_empty_set_by_a_ray(output_error):
    model = output_error(15, seed=2)
    lower, upper = model.problem.lower.copy(), model.problem.upper.copy()
    lower[2:], upper[2:] = -0.02, 0.02
    found = intervals(model.problem.with_box(lower, upper), [0], method="rlt", solver="highs", witnesses=False)
    assert found.reason is Reason.EMPTY
    assert found.empty.weights.sum() == pytest.approx(1)


def test_highs_refuses_semidefinite_blocks_with_the_cure(output_error):
    with pytest.raises(ProblemError, match=r"solves linear programs.*choose method='rlt', or solver='clarabel'"):
        intervals(output_error(5).problem, [0], solver="highs")


def test_its_proof_can_be_written(tmp_path, output_error):
    model, steps = output_error(5, seed=3), []
    for order in (1, 2):
        relaxed, objective = relax(model.problem, "rlt", order), model.problem.variable(0)
        steps.append(Bound.of(relaxed, objective, relaxed.bound(objective)))
    write_certificate(tmp_path / "c.json", model.problem, steps)
    theorems = check.check(check.read(tmp_path / "c.json"))
    assert [float(t.bound) for t in theorems] == [step.certificate.bound for step in steps]
