"""The relaxations: which variables complicate, which orders are refused, and no feasible point is cut off."""

from itertools import combinations

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from relaxations.algebra.polynomial import Polynomials
from relaxations.errors import ProblemError
from relaxations.moments import conic, facial, parametric_lift
from relaxations.moments.lasserre_hierarchy import lasserre
from relaxations.moments.moment import monomials_up_to
from relaxations.moments.parametric_lift import METHODS as LIFTS
from relaxations.moments.parametric_lift import MOST_COMPLICATING, complicating_variables, least_order, lift
from relaxations.problem.problem import from_sympy
from relaxations.proof.bounding import relax
from relaxations.reductions.scaling import Scaling
from relaxations.reductions.sparsity import cliques
from relaxations.search.hierarchy import intervals
from relaxations.search.minimum import minimise
from tests.relaxations.at_a_point import monomial_values, unit_problem, worst

# ---------------------------------------------------------------- complicating variables

edges = st.sets(st.tuples(st.integers(0, 6), st.integers(0, 6)).map(lambda e: tuple(sorted(e))), max_size=12)


@settings(max_examples=120, deadline=None, derandomize=True)
@given(edges)
def test_complicating_variables_are_a_least_vertex_cover(graph):
    problem = unit_problem(7, [{e: 1.0, (0,): 1.0} for e in graph] or [{(0,): 1.0}])
    found = set(complicating_variables(problem).tolist())
    assert all(set(e) & found if e[0] != e[1] else e[0] in found for e in graph)
    least = next(
        size
        for size in range(8)
        if any(
            all(u in c and v in c if u == v else u in c or v in c for u, v in graph)
            for c in combinations(range(7), size)
        )
    )
    assert len(found) == least


def test_a_monomial_of_high_degree_counts_all_its_pairs():
    problem = unit_problem(4, [{(0, 1, 2): 1.0, (3,): 1.0}])
    assert len(complicating_variables(problem)) == 2
    squared = unit_problem(4, [{(0, 0, 3): 1.0}])
    assert complicating_variables(squared).tolist() == [0]


def test_too_many_complicating_variables_are_refused_with_the_cure():
    n = MOST_COMPLICATING + 1
    squares = [{(k, k): 1.0} for k in range(n)]
    problem = unit_problem(n, [*squares, {(k, k): 1.0 for k in range(n)}])  # none occurs in one row alone
    assert complicating_variables(problem) is None
    with pytest.raises(ProblemError, match="choose method='sparse'"):
        lift(problem, 1)
    with pytest.raises(ProblemError, match="choose method='sparse'"):
        intervals(problem, [0], method="lift")


def test_the_models_complicate_by_their_pole_only(output_error, hammerstein):
    for model in (output_error(8), hammerstein(8)):
        assert complicating_variables(model.problem).tolist() == [0]


# ---------------------------------------------------------------- orders


@pytest.mark.parametrize(("degree", "least"), [(1, 1), (2, 1), (3, 2), (5, 3)])
def test_an_order_too_low_names_the_least_one(degree, least):
    problem = unit_problem(2, [{(0,) * degree: 1.0, (1,): -1.0}])
    complicating = complicating_variables(problem)
    assert least_order([problem.equalities], complicating) == least
    lift(problem, least)
    if least > 1:
        for build in (lambda: lift(problem, least - 1), lambda: lasserre(problem, least - 1)):
            with pytest.raises(ProblemError, match=f"the least order is {least}"):
                build()
        for method in ("lift", "sparse", "dense", "terms", "chordal", "textbook"):
            with pytest.raises(ProblemError, match=f"the least order is {least}"):
                intervals(problem, [0], method=method, order=least - 1)


def test_a_block_too_wide_for_memory_is_refused_before_it_is_built():
    with pytest.raises(ProblemError, match="lower the order, or choose"):
        lasserre(unit_problem(40), 3, "dense")


def test_a_lift_too_large_for_memory_is_refused_before_it_is_built(output_error, monkeypatch):
    problem = output_error(60).problem
    intervals(problem, [0], order=1, rounds=1, witnesses=False)
    monkeypatch.setattr(conic.os, "sysconf", lambda name: 1 if name == "SC_PAGE_SIZE" else 2_000_000)
    monkeypatch.setattr(parametric_lift, "assemble", lambda *_: pytest.fail("it was built"))
    message = r"of order 2 in a has 310 moments and \d+ terms.*has 0.002 GB: lower the order, or give fewer"
    for call in (
        lambda: intervals(problem, [0], order=2),
        lambda: minimise(problem, problem.variable(0), method="lift", order=2),
    ):
        with pytest.raises(ProblemError, match=message):
            call()


@pytest.mark.parametrize("method", LIFTS)
@pytest.mark.parametrize("order", [1, 2, 3])
def test_the_size_of_a_lift_is_known_before_it_is_built(output_error, hammerstein, monkeypatch, order, method):
    told = []
    monkeypatch.setattr(parametric_lift, "check_memory", lambda *given: told.append(given))
    square = unit_problem(4, [{(0, 1): 1.0, (2,): -1.0}], [{(): 1.0, (0, 3): -1.0}, {(): 1.0, (0, 0): -1.0, (3,): 0.5}])
    for problem in (output_error(6).problem, hammerstein(7).problem, square):
        relaxation = relax(problem, method, order).relaxation
        widths, terms, what, _ = told.pop()
        assert widths == {b.size: b.count for b in relaxation.blocks}
        made = len(relaxation.equality_row) + sum(len(b.block) for b in relaxation.blocks)
        assert made <= terms <= 1.2 * made  # where terms meet in one moment, one is left
        assert f" {relaxation.n_moments} moments" in what


# ---------------------------------------------------------------- validity


@pytest.mark.parametrize("method", LIFTS)
@pytest.mark.parametrize("order", [1, 2, 3])
def test_the_lift_cuts_off_no_feasible_point(output_error, hammerstein, order, method):
    for model in (output_error(6, seed=3), hammerstein(6, seed=4)):
        scaling = Scaling.of_box(model.problem)
        relaxation = lift(scaling.apply(model.problem), order, method)
        for point in model.sample(15, np.random.default_rng(5)):
            residual, eigenvalue = worst(relaxation, (point - scaling.centre) / scaling.scale)
            assert residual < 1e-12
            assert eigenvalue > -1e-12


@pytest.mark.parametrize("method", ["sparse", "dense", "terms", "chordal", "textbook"])
def test_lasserre_relaxations_cut_off_no_feasible_point(output_error, method):
    model = output_error(4, seed=6)
    relaxed = relax(model.problem, method, 2)
    for point in model.sample(15, np.random.default_rng(7)):
        t = (point - relaxed.scaling.centre) / relaxed.scaling.scale
        residual, eigenvalue = worst(relaxed.relaxation, t)
        assert residual < 1e-12
        assert eigenvalue > -1e-11


@pytest.mark.parametrize("method", [*LIFTS, "sparse", "dense", "terms", "chordal", "textbook"])
@settings(max_examples=25, deadline=None, derandomize=True)
@given(st.lists(st.floats(-1, 1), min_size=3, max_size=3))
def test_no_relaxation_cuts_off_a_point_of_a_mixed_problem(method, point):
    x = np.array(point)
    # Constraints that hold at the point by construction: z = x y, 1 - x^3 >= 0, an affine one with slack.
    x[2] = x[0] * x[1]
    slack = abs(x[0] - x[1] * x[1] + x[2])
    problem = unit_problem(
        3,
        [{(0, 1): 1.0, (2,): -1.0}],
        [{(): 1.0, (0, 0, 0): -1.0}, {(): slack, (0,): 1.0, (1, 1): -1.0, (2,): 1.0}],
    )
    relaxation = lift(problem, 2, method) if method in LIFTS else lasserre(problem, 2, method)
    residual, eigenvalue = worst(relaxation, x)
    assert residual < 1e-13
    assert eigenvalue > -1e-12


def test_a_point_that_violates_a_constraint_is_cut_off():
    problem = unit_problem(3, [{(0, 1): 1.0, (2,): -1.0}], [{(): 0.25, (0,): -1.0}])
    for relaxation in (lift(problem, 1), lasserre(problem, 1, "dense")):
        assert worst(relaxation, np.array([0.2, 0.5, 0.3]))[0] > 0.1
        assert worst(relaxation, np.array([0.5, 0.5, 0.25]))[1] < -0.1


def test_the_moment_zero_is_the_constant_and_variables_have_moments(output_error):
    problem = output_error(5).problem
    for method, order in (("lift", 1), ("lift", 2), ("sparse", 2), ("textbook", 1)):
        relaxation = relax(problem, method, order).relaxation
        assert (relaxation.monomials[0] == -1).all()
        t = np.random.default_rng(8).uniform(-1, 1, problem.n_variables)
        assert relaxation.first_order(monomial_values(relaxation, t)) == pytest.approx(t)


# ---------------------------------------------------------------- facial reduction and cliques


def test_facial_reduction_keeps_exactly_the_complement_of_the_multiples():
    equalities = Polynomials.from_terms([{(0, 1): 1.0, (2,): -1.0}, {(0,): 0.5, (1,): 1.0}])
    variables = (0, 1, 2)
    basis = monomials_up_to(variables, 2)
    v = facial.face_basis(facial.multiple_vectors(equalities, variables, 2))
    multiples = facial.multiple_vectors(equalities, variables, 2)
    assert len(multiples) == 1 + 4  # the first has degree 2: times 1 only; the second times 1, x0, x1, x2
    assert v.T @ v == pytest.approx(np.eye(v.shape[1]), abs=1e-12)
    assert multiples @ v == pytest.approx(0, abs=1e-12)
    assert v.shape == (len(basis), len(basis) - np.linalg.matrix_rank(multiples))


def test_independent_rows_span_what_all_rows_span():
    rng = np.random.default_rng(9)
    vectors = rng.normal(size=(4, 7))
    vectors = np.r_[vectors, rng.normal(size=(5, 4)) @ vectors]
    kept = facial.independent_rows(vectors)
    assert len(kept) == 4
    assert np.linalg.matrix_rank(vectors[kept]) == 4


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.lists(st.sets(st.integers(0, 7), min_size=1, max_size=3), min_size=1, max_size=8))
def test_every_constraint_lies_in_a_clique_and_the_cliques_run_into_each_other(groups):
    problem = unit_problem(8, [dict.fromkeys([(v,) for v in g], 1.0) for g in groups])
    found = [set(c) for c in cliques(problem)]
    assert set().union(*found) == set(range(8))
    assert all(any(g <= c for c in found) for g in groups)
    assert not any(a < b for a in found for b in found)
    # Chordal: a maximal spanning tree by intersection has, for each variable, its cliques connected.
    links = sorted(((len(a & b), i, j) for (i, a), (j, b) in combinations(enumerate(found), 2)), reverse=True)
    component, tree = list(range(len(found))), []
    for _, i, j in links:
        if component[i] != component[j]:
            component = [component[i] if c == component[j] else c for c in component]
            tree.append((i, j))
    for v in range(8):
        holding = {k for k, c in enumerate(found) if v in c}
        assert len([1 for i, j in tree if i in holding and j in holding]) == len(holding) - 1


def test_an_objective_across_cliques_must_be_known_to_the_relaxation():
    x = sympy.symbols("x0:3")
    problem, objective = from_sympy(x[0] * x[2], [], [x[0] - x[1], x[1] - x[2]], x, dict.fromkeys(x, (-1, 2)))
    with pytest.raises(ProblemError, match="raise the order"):
        relax(problem, "sparse", 1).bound(objective)
    known = relax(problem, "sparse", 1, objective=objective).bound(objective)
    assert known.bound <= 0
    assert known.bound > -1e-6  # the three are equal: x0 x2 is a square


def test_sparse_order_two_and_the_lift_agree(hammerstein):
    model = hammerstein(10, seed=1)
    lifted = relax(model.problem, "lift", 2)
    sparse = relax(model.problem, "sparse", 2)
    ends = {}
    for name, relaxed in (("lift", lifted), ("sparse", sparse)):
        low = relaxed.bound(model.problem.variable(0)).bound
        high = -relaxed.bound(model.problem.variable(0, -1.0)).bound
        ends[name] = low, high
        assert low <= model.truth[0] <= high
    assert sparse.relaxation.largest_block > lifted.relaxation.largest_block
    width = ends["lift"][1] - ends["lift"][0]
    assert ends["sparse"] == pytest.approx(ends["lift"], abs=1e-4 * width)
