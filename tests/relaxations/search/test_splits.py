"""Splits by symmetry and by terms: what they are by definition, what they may lose, and what they never may."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from relaxations import check
from relaxations.algebra.polynomial import Polynomials
from relaxations.errors import ProblemError
from relaxations.library import load
from relaxations.moments.facial import face_basis, vectors_within
from relaxations.moments.lasserre_hierarchy import lasserre, plan
from relaxations.moments.symmetry import classes, sign_symmetries
from relaxations.points.extraction import minimisers
from relaxations.proof.bounding import relax
from relaxations.proof.certificate_file import write_certificate
from relaxations.proof.proof_steps import Bound
from relaxations.search.minimum import MinimumReason, minimise
from tests.relaxations.at_a_point import unit_problem, worst

N = 4
STABLE = 99  # steps, of which a few suffice
monomials = st.lists(st.integers(0, N - 1), max_size=4).map(lambda m: tuple(sorted(m)))
members = st.dictionaries(monomials, st.sampled_from([-1.5, 1.0, 2.0]), min_size=1, max_size=3)


def flipped(terms, signs):
    return {m: c * np.prod(signs[list(m)]) for m, c in terms.items()}


def symmetric(seed, equality=True):
    """Return a random quartic problem that one change of signs leaves as it is, its equality up to the sign."""
    rng = np.random.default_rng(seed)
    signs = np.array([-1, -1, 1, rng.choice([-1, 1])])

    def some(count, parity=1):
        own = [tuple(sorted(rng.integers(0, N, rng.integers(1, 5)))) for _ in range(40)]
        kept = [m for m in dict.fromkeys(own) if np.prod(signs[list(m)]) == parity][:count]
        return {m: float(rng.normal()) for m in kept}

    equalities = [some(3, -1)] if equality else []
    problem = unit_problem(N, equalities, [{(): 2.0, **some(2)}, {(): 3.0, **some(3)}])
    return problem, Polynomials.from_terms([some(7)])


# ---------------------------------------------------------------- sign symmetry


@settings(max_examples=150, deadline=None, derandomize=True)
@given(members, st.lists(members, max_size=2), st.lists(members, max_size=2))
def test_sign_symmetries_are_all_changes_that_leave_the_problem_as_it_is(objective, equalities, inequalities):
    problem = unit_problem(N, equalities, inequalities)
    generators = sign_symmetries(problem, Polynomials.from_terms([objective]))
    spanned = {
        tuple((-1) ** (np.array(use, dtype=int) @ generators)) for use in product((0, 1), repeat=len(generators))
    }
    expected = set()
    for signs in product((1, -1), repeat=N):
        s = np.array(signs)
        kept = all(flipped(g, s) == g for g in (objective, *inequalities))
        if kept and all(flipped(h, s) in (h, {m: -c for m, c in h.items()}) for h in equalities):
            expected.add(signs)
    assert spanned == expected
    assert len(spanned) == 2 ** len(generators)


def test_monomials_of_a_class_change_their_signs_together():
    signs = np.array([[True, True, False, False], [False, True, False, True]])
    factors = np.array([[-1, -1], [-1, 0], [-1, 1], [-1, 3], [0, 3], [2, 2], [0, 1], [1, 3]])
    own = classes(factors, signs)
    change = [tuple((signs[:, [v for v in m if v >= 0]].sum(axis=1) % 2).tolist()) for m in factors.tolist()]
    assert all((own[i] == own[j]) == (change[i] == change[j]) for i in range(8) for j in range(8))
    assert own[0] == 0


@pytest.mark.parametrize("method", ["sparse", "dense"])
@pytest.mark.parametrize("seed", range(6))
def test_symmetry_loses_nothing(method, seed):
    problem, objective = symmetric(seed)
    # Nothing is left as it is where every variable is an objective too.
    variables = Polynomials.variables(np.arange(N))
    whole = relax(problem, method, 2, objective=Polynomials.join([objective, variables]))
    split = relax(problem, method, 2, objective=objective)
    assert split.relaxation.n_moments < whole.relaxation.n_moments
    assert split.relaxation.largest_block < whole.relaxation.largest_block
    expected = whole.bound(objective).bound
    assert np.isfinite(expected)
    assert split.bound(objective).bound == pytest.approx(expected, abs=2e-5)


def test_without_the_objective_nothing_is_assumed():
    problem, objective = symmetric(0)
    relaxed = relax(problem, "dense", 2)
    bounds = [relaxed.bound(problem.variable(k, sign)).bound for k in range(N) for sign in (1, -1)]
    assert np.isfinite(bounds).all()
    # The symmetric objective would leave no moment of x0 alone.
    known = relax(problem, "dense", 2, objective=objective)
    with pytest.raises(ProblemError, match="name the objective when it is built"):
        known.bound(problem.variable(0))
    both = relax(problem, "dense", 2, objective=Polynomials.join([objective, problem.variable(0)]))
    assert both.bound(problem.variable(0)).bound == pytest.approx(bounds[0], abs=1e-6)


def test_a_box_off_centre_has_no_symmetry():
    problem = unit_problem(2, [], [{(): 1.0, (0, 0): -1.0}])
    objective = Polynomials.from_terms([{(0, 0, 0, 0): 1.0, (0, 1): -1.0}])
    shifted = problem.with_box(np.array([-1.0, -1.0]), np.array([1.0, 0.9]))
    sizes = [relax(p, "dense", 2, objective=objective).relaxation.n_moments for p in (problem, shifted)]
    assert sizes[0] < sizes[1] == 15


def test_minimisers_are_extracted_from_split_moments():
    objective = Polynomials.from_terms([{(0,) * 4: 1.0, (0, 0): -0.5, (0, 1): -0.125, (1, 1): 0.25}])
    relaxed = relax(unit_problem(2), "dense", 2, objective=objective)
    certified = relaxed.bound(objective)
    assert certified.point == pytest.approx([0, 0])  # the mean of a point and its mirror image
    points = minimisers(relaxed.relaxation, certified.moments)
    assert len(points) == 2
    assert points[0] == pytest.approx(-points[1], abs=1e-3)
    assert objective.evaluate(points[0])[0] == pytest.approx(certified.bound, abs=1e-5)


# ---------------------------------------------------------------- term sparsity


@pytest.mark.parametrize("method", ["terms", "chordal"])
@pytest.mark.parametrize("seed", range(3))
def test_steps_tighten_and_block_closures_end_at_the_whole(method, seed):
    problem, objective = symmetric(seed)
    whole = relax(problem, "sparse", 2, objective=objective).bound(objective).bound
    bounds = [relax(problem, method, 2, objective=objective, steps=k).bound(objective).bound for k in (1, 2, STABLE)]
    assert all(a <= b + 1e-5 for a, b in zip(bounds, [*bounds[1:], whole], strict=True))
    if method == "terms":
        assert bounds[-1] == pytest.approx(whole, abs=2e-5)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(members, st.lists(members, max_size=2))
def test_stable_block_closures_are_the_classes_of_sign_symmetry(objective, inequalities):
    # At an order high enough: three for quartic problems in four variables.
    problem, goal = unit_problem(N, [], inequalities), Polynomials.from_terms([objective])
    by_symmetry, by_terms = (plan(problem, 3, m, goal, s) for m, s in (("sparse", 1), ("terms", STABLE)))
    for (_, one), (_, other) in zip(by_symmetry, by_terms, strict=True):
        for mine, theirs in zip(one.blocks, other.blocks, strict=True):
            assert {tuple(b.tolist()) for b in mine} == {tuple(b.tolist()) for b in theirs}


def test_at_a_low_order_block_closures_are_finer_and_lose_nothing():
    # x0 x1 and x6 x7 keep their signs together, but no product of two terms of degree two shows it at order 2.
    terms = [(0, 1, 2, 3), (3, 4, 5, 6), (2, 4, 5, 7)]
    problem, goal = unit_problem(8), Polynomials.from_terms([{m: 1.0 for m in terms}])
    by_symmetry, by_terms = (relax(problem, m, 2, objective=goal, steps=STABLE) for m in ("dense", "terms"))
    assert by_terms.relaxation.n_moments < by_symmetry.relaxation.n_moments
    assert by_terms.bound(goal).bound == pytest.approx(by_symmetry.bound(goal).bound, abs=1e-6)


@settings(max_examples=25, deadline=None, derandomize=True)
@given(st.lists(members, min_size=1, max_size=3), st.integers(1, 3))
def test_each_step_and_each_closure_holds_the_one_before(inequalities, steps):
    problem, goal = unit_problem(N, inequalities[1:], inequalities[:1]), Polynomials.from_terms([inequalities[-1]])
    for method in ("terms", "chordal"):
        before, after = (plan(problem, 2, method, goal, s) for s in (steps, steps + 1))
        for (_, less), (_, more) in zip(before, after, strict=True):
            assert set(less.multiples) <= set(more.multiples)
            for mine, theirs in zip(less.blocks, more.blocks, strict=True):
                assert all(any(set(b) <= set(c) for c in theirs) for b in mine)
                assert set(np.concatenate(mine)) == set(np.concatenate(theirs)) == set(range(max(map(max, mine)) + 1))


@pytest.mark.parametrize("method", ["sparse", "dense", "terms", "chordal"])
@settings(max_examples=20, deadline=None, derandomize=True)
@given(st.lists(st.floats(-1, 1), min_size=3, max_size=3), st.integers(1, 3))
def test_no_split_cuts_off_a_feasible_point(method, point, steps):
    x = np.array(point)
    x[2] = x[0] * x[1]
    slack = abs(x[0] * x[2] - x[1] * x[1])
    # x0 and x2 may change their signs: z = x y changes its own, the others keep it.
    problem = unit_problem(3, [{(0, 1): 1.0, (2,): -1.0}], [{(): slack, (0, 2): 1.0, (1, 1): -1.0}])
    objective = Polynomials.from_terms([{(0, 0, 1): 1.0, (0, 2): -1.0}])
    residual, eigenvalue = worst(lasserre(problem, 2, method, objective, steps), x)
    assert residual < 1e-13
    assert eigenvalue > -1e-12


@pytest.mark.parametrize("method", ["terms", "chordal"])
@pytest.mark.parametrize("name", ["gms_Bex2_1_2", "gms_Bex9_1_4", "gms_Bst_e07", "gms_st_e09", "spop_nonscomp_8"])
def test_no_bound_lies_above_a_known_optimum(method, name):
    case = load(name)
    sparse = relax(case.problem, "sparse", 2, objective=case.objective).bound(case.objective).bound
    size = max(1.0, abs(case.optimum))
    for steps in (1, STABLE):
        bound = relax(case.problem, method, 2, objective=case.objective, steps=steps).bound(case.objective).bound
        assert bound <= case.optimum + 1e-7 * size
        assert bound <= sparse + 2e-5 * size
    if method == "terms":
        assert bound == pytest.approx(sparse, abs=2e-6 * size)


def test_terms_without_an_objective_serve_every_variable():
    problem, _ = symmetric(1)
    relaxed = relax(problem, "terms", 2, steps=STABLE)
    for k in range(N):
        assert -1 - 1e-6 < relaxed.bound(problem.variable(k)).bound <= 1


def test_a_wrong_number_of_steps_is_refused():
    with pytest.raises(ProblemError, match="steps is 0: at least one"):
        lasserre(unit_problem(2), 1, "terms", steps=0)


def test_orders_for_other_cliques_are_refused():
    with pytest.raises(ProblemError, match="3 orders were given for 2 cliques"):
        lasserre(unit_problem(2), (1, 2, 2))


def test_a_basis_too_long_to_look_for_terms_in_is_refused():
    together = unit_problem(40, [], [{(k,): 1.0 for k in range(40)}])
    with pytest.raises(ProblemError, match="lower the order"):
        lasserre(together, 3, "terms", together.variable(0))


@pytest.mark.parametrize("method", ["sparse", "terms", "chordal"])
def test_the_minimum_of_a_symmetric_problem_is_found(method):
    # Six double wells in a ring that push their neighbours away: a point and its mirror image are best.
    n = 6
    terms = {}
    for k in range(n):
        terms |= {(k,) * 4: 1.0, (k, k): -1.0, tuple(sorted((k, (k + 1) % n))): 0.25}
    problem, objective = unit_problem(n), Polynomials.from_terms([terms])
    found = minimise(problem, objective, method=method)
    assert found.reason is MinimumReason.TIGHT
    # All of one size t, signs alternating: n (t^4 - 5/4 t^2).
    assert found.upper == pytest.approx(-n * 0.390625, abs=1e-6)


@pytest.mark.parametrize("method", ["dense", "terms", "chordal"])
def test_the_certificate_of_a_split_relaxation_is_checked_in_fractions(tmp_path, method):
    problem, objective = symmetric(2)
    relaxed = relax(problem, method, 2, objective=objective)
    certified = relaxed.bound(objective)
    write_certificate(tmp_path / "certificate.json", relaxed.problem, [Bound.of(relaxed, objective, certified)])
    (theorem,) = check.check(check.read(tmp_path / "certificate.json"))
    assert theorem.bound == certified.bound


def test_null_vectors_of_a_part_are_those_that_live_on_it():
    vectors = np.array([[1.0, 0.0, 2.0, 0.0], [0.0, 1.0, 3.0, 0.0]])
    part = np.array([0, 2, 3])
    face = face_basis(vectors_within(vectors, part))
    assert face.shape == (3, 2)
    assert vectors[0, part] @ face == pytest.approx(0)
