"""A relaxation method and a conic solver from outside the package: given as objects, or named by entry points."""

import importlib
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import pytest

from relaxations.algebra.polynomial import Polynomials
from relaxations.errors import ProblemError
from relaxations.formats.expressions import problem_of, variables
from relaxations.library import load
from relaxations.moments.moment import assemble, localise, monomials_up_to
from relaxations.proof import Cuts, Lift, Sparse, method, method_names, write_certificate
from relaxations.search import intervals, minimise
from relaxations.solvers import BackEnd, Stop, available_solvers, solve
from smid import Dataset, OutputError, error_bound, identify

table = importlib.import_module("relaxations.solvers.back_ends")  # the package shows a function under this name
NOTHING = np.zeros(0, dtype=np.int64)


@dataclass(frozen=True)
class McCormick:
    """The linear relaxation of G. P. McCormick (1976): products of two box ends are nonnegative."""

    order: int | None = None
    name: str = "mccormick"

    def orders(self, problem):
        if problem.degree > 2:
            raise ProblemError("McCormick's relaxation is for products of two variables")
        return 1, 1

    def check(self, problem, order):
        """Refuse nothing: it is small."""

    def build(self, problem, order, objective, steps):  # noqa: ARG002
        n, signs = problem.n_variables, (1.0, -1.0)
        rows = [{(): 1.0, (i,): s} for i in range(n) for s in signs] + [{(): 1.0, (i, i): -1.0} for i in range(n)]
        for i, j in combinations(range(n), 2):
            rows += [{(): 1.0, (i,): s, (j,): t, (i, j): s * t} for s in signs for t in signs]
        nonnegative = [Polynomials.from_terms(rows), problem.inequalities, Polynomials.from_terms([{(): 1.0}])]
        one = monomials_up_to(NOTHING, 0)
        return assemble(
            self.name, order, n, NOTHING, [problem.equalities], [localise(Polynomials.join(nonnegative), one)]
        )


def rounded(name, program, objective):
    """Answer as the default solver does, with three digits."""
    found = solve(program, np.concatenate([[0.0], objective]))
    return found.stop, f"{name}: {found.status}", found.moments[1:], np.round(found.dual, 3)


ROUGH = BackEnd("rough", run=rounded)


class EntryPoint:
    """What importlib.metadata gives for a line under [project.entry-points]."""

    def __init__(self, name, found):
        self.name, self.found = name, found

    def load(self):
        return self.found


@pytest.fixture
def hyperbola():
    x, y = variables("x y")
    return problem_of(x + y, [x * y == 1, x >= 0, x <= 2, y >= 0, y <= 4])


@pytest.fixture
def data():
    y = [0.0, 1, 0.5, 1.3, 1.6, 0.8, 0.4, 1.2]
    return Dataset.from_arrays(input={"u": [1.0, 0, 1, 1, 0, 0, 1, 0]}, output={"y": y}, sampling_time=1.0)


def test_a_method_of_an_outsider_bounds_variables(hyperbola):
    found = intervals(hyperbola[0], [0, 1], method=McCormick())
    assert found.method == "mccormick"
    assert found.largest_block == 1
    (x, y) = found.intervals
    assert x.lower <= 0.25 <= x.lower + 1e-6
    assert y.lower <= 0.5 <= y.lower + 1e-6


def test_a_method_of_an_outsider_bounds_in_other_processes(hyperbola):
    with ProcessPoolExecutor(1) as pool:
        found = intervals(hyperbola[0], [0], method=McCormick(), executor=pool)
    assert found.intervals[0].lower == intervals(hyperbola[0], [0], method=McCormick()).intervals[0].lower


def test_a_method_of_an_outsider_encloses_a_minimum_by_branches(hyperbola):
    found = minimise(*hyperbola, method=McCormick(), tolerance=1e-3)
    assert found.lower <= 2 <= found.upper
    assert found.gap < 1e-2
    assert found.nodes > 0


def test_a_method_of_an_outsider_identifies_a_model(data):
    model = OutputError(stable=True)
    by_lift, found = (identify(model, data, 0.1, method=chosen) for chosen in ("lift", McCormick()))
    for own, best in zip(found.intervals, by_lift.intervals, strict=True):
        assert own.lower <= best.inner_lower
        assert own.upper >= best.inner_upper
    bound = error_bound(model, data, method=McCormick())
    assert bound.lower <= error_bound(model, data).upper


def test_a_package_names_a_method_by_an_entry_point(hyperbola, monkeypatch):
    points = [EntryPoint("mccormick", McCormick())]
    monkeypatch.setattr(method, "entry_points", lambda group: points if group == "relaxations.methods" else [])
    method._entry_points.cache_clear()
    try:
        assert method_names()[-1] == "mccormick"
        assert intervals(hyperbola[0], [0], method="mccormick").method == "mccormick"
        with pytest.raises(ProblemError, match="textbook, mccormick"):
            intervals(hyperbola[0], [0], method="taylor")
    finally:
        method._entry_points.cache_clear()


def test_a_method_refuses_what_it_cannot_bound():
    x, y = variables("x y")
    problem, _ = problem_of(x, [x * y**2 == 1, x >= 0, x <= 2, y >= 0, y <= 4])
    with pytest.raises(ProblemError, match="products of two variables"):
        intervals(problem, [0], method=McCormick())


@pytest.mark.parametrize("wrong", [3, McCormick, None, object()])
def test_what_is_no_method_is_refused(hyperbola, wrong):
    with pytest.raises(ProblemError, match="is no relaxation method: give a short name"):
        intervals(hyperbola[0], [0], method=wrong)


def test_a_short_name_and_a_method_object_mean_the_same(hyperbola, data):
    problem, objective = hyperbola
    for name, chosen in (("lift", Lift(order=1)), ("sparse", Sparse(order=1))):
        by_name = intervals(problem, [0], method=name, order=1)
        by_object = intervals(problem, [0], method=chosen)
        assert by_name.intervals == by_object.intervals
        assert (
            minimise(problem, objective, method=name, order=1).lower
            == minimise(problem, objective, method=chosen).lower
        )
    cuts = [identify(OutputError(stable=True), data, 0.1, method=chosen).intervals for chosen in ("benders", Cuts())]
    assert cuts[0] == cuts[1]


def test_a_rough_solver_of_an_outsider_gives_true_bounds(data):
    model = OutputError(stable=True)
    found, best = identify(model, data, 0.1, solver=ROUGH), identify(model, data, 0.1)
    assert any("rough: " in status for i in found.enclosure.intervals for status in i.status)
    for own, other in zip(found.intervals, best.intervals, strict=True):
        assert own.lower <= other.inner_lower
        assert own.upper >= other.inner_upper


def test_a_rough_solver_of_an_outsider_serves_cuts_and_minima(hyperbola):
    assert intervals(hyperbola[0], [0], method="benders", solver=ROUGH).intervals[0].lower <= 0.25
    case = load("gms_st_e01")
    assert minimise(case.problem, case.objective, solver=ROUGH).lower <= case.optimum + 1e-6


def test_a_solver_that_lies_proves_nothing_false(hyperbola):
    generator = np.random.default_rng(0)

    def lie(name, program, objective):
        return Stop.SOLVED, name, generator.normal(size=len(objective)), generator.normal(size=program.n_rows)

    found = intervals(hyperbola[0], [0, 1], solver=BackEnd("liar", run=lie), rounds=2)
    assert found.intervals[0].lower <= 0.25
    assert found.intervals[1].upper >= 4 - 1e-9


def test_a_package_names_a_solver_by_an_entry_point(hyperbola, monkeypatch):
    monkeypatch.setattr(table, "entry_points", lambda **_: [EntryPoint("rough", ROUGH)])
    table.from_packages.cache_clear()
    try:
        assert "rough" in available_solvers()
        found = intervals(hyperbola[0], [0], solver="Rough")
        assert found.intervals[0].lower <= 0.25
    finally:
        table.from_packages.cache_clear()


def test_the_proof_by_a_solver_of_an_outsider_is_written_and_checked(hyperbola, tmp_path):
    steps = []
    intervals(hyperbola[0], [0], solver=ROUGH, record=steps.append)
    write_certificate(tmp_path / "proof.json", hyperbola[0], steps)
    assert (tmp_path / "proof.json").exists()
