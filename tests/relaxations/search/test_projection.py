"""Private variables are eliminated: no feasible point is lost, and each point that is verified has one of them."""

import numpy as np
import pytest

from relaxations.algebra.polynomial import Polynomials
from relaxations.errors import ProblemError
from relaxations.problem.problem import PolynomialProblem
from relaxations.reductions.projection import Projection
from relaxations.search.hierarchy import intervals


def _random(rng: np.random.Generator) -> tuple[PolynomialProblem, float]:
    """Return ``x = c1 (u - v) + c2 (u - v)^2 + c3 v w`` with private v and w; and the centre u."""
    u, d, e = rng.uniform(-1, 1), rng.uniform(0.05, 0.5), rng.uniform(0.05, 0.5)
    c1, c2, c3, x, v, w = range(6)
    row = {(x,): 1.0, (c1,): -u, (c1, v): 1.0, (c2,): -u * u, (c2, v): 2 * u, (c2, v, v): -1.0, (c3, v, w): -1.0}
    low = rng.uniform(-2, 1, 3)
    high = low + rng.uniform(0.1, 2, 3)
    lower, upper = np.array([*low, -20.0, -d, -e]), np.array([*high, 20.0, d, e])
    names = ("c1", "c2", "c3", "x", "v", "w")
    return PolynomialProblem(names, lower, upper, Polynomials.from_terms([row]), Polynomials.empty()), u


@pytest.mark.parametrize("seed", range(30))
def test_outer_rows_hold_at_every_feasible_point_and_inner_rows_prove_one(seed: int) -> None:
    rng = np.random.default_rng(seed)
    problem, _ = _random(rng)
    projection = Projection.of(problem, [0, 1, 2])
    assert projection is not None
    assert projection.removed.tolist() == [4, 5]
    outer = projection.on(problem.lower, problem.upper)
    for _ in range(50):
        point = rng.uniform(problem.lower, problem.upper)
        point[3] -= problem.equalities.evaluate(point)[0]  # x follows
        assert outer.problem.inequalities.evaluate(point[:4]).min() >= -1e-12
        inner = projection.inner(problem.lower, problem.upper, point[:4])
        point[3] = rng.uniform(-3, 3)
        if inner.inequalities.evaluate(point[:4]).min() > 0:
            found = projection.recover(point[:4])
            assert abs(problem.equalities.evaluate(found)[0]) < 1e-12
            assert (found >= problem.lower).all()
            assert (found <= problem.upper).all()


def test_a_variable_of_two_equalities_is_not_private() -> None:
    c, x, y, v = range(4)
    rows = [{(x,): 1.0, (c, v, v): -1.0}, {(y,): 1.0, (c, v, v): 1.0}]
    lower, upper = np.array([0.0, -1, -1, -0.1]), np.array([1.0, 1, 1, 0.1])
    problem = PolynomialProblem(tuple("cxyv"), lower, upper, Polynomials.from_terms(rows), Polynomials.empty())
    assert Projection.of(problem, [0]) is None


def test_the_sparse_hierarchy_keeps_all_variables() -> None:
    problem, _ = _random(np.random.default_rng(0))
    with pytest.raises(ProblemError, match="the least order is 2"):
        intervals(problem, [0], method="sparse", order=1)
