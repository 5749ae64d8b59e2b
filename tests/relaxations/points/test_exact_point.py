"""A point is proven in fractions where constraints hold only exactly, and never where one fails."""

from fractions import Fraction

import numpy as np
import pytest
import sympy
from hypothesis import given
from hypothesis import strategies as st

from relaxations.library import load
from relaxations.points.exact_point import exact_point
from relaxations.points.witness import definition_order, verify
from relaxations.problem.problem import from_sympy
from relaxations.search.minimum import minimise


@given(st.integers(0, 10**6))
def test_a_vertex_of_a_transport_network_is_feasible_exactly(seed):
    """What leaves the sources arrives at the sinks: the equalities depend on each other, and share their variables."""
    rng = np.random.default_rng(seed)
    flow = rng.integers(0, 4, (3, 4)) * rng.integers(0, 2, (3, 4))  # degenerate: many flows are zero
    x = sympy.symbols("x0:3(0:4)")
    grid = np.array(x, dtype=object).reshape(3, 4)
    equal = [*(grid.sum(axis=1) - flow.sum(axis=1)), *(grid.sum(axis=0) - flow.sum(axis=0))]
    cost = rng.integers(1, 9, 12).tolist()
    objective = sum(c * v for c, v in zip(cost, x, strict=True))
    problem, cost_row = from_sympy(objective, [], equal, x, {v: (0, 5) for v in x})
    nearly = np.clip(flow.ravel() + 1e-10 * rng.uniform(-1, 1, 12), 0, 5)
    assert definition_order(problem.equalities) is None
    found = exact_point(problem, cost_row, nearly)
    assert found is not None
    sums = found.point.reshape(3, 4)
    assert sums.sum(axis=1) == pytest.approx(flow.sum(axis=1), abs=1e-14)
    assert sums.sum(axis=0) == pytest.approx(flow.sum(axis=0), abs=1e-14)
    assert ((found.point == 0) == (flow.ravel() == 0)).all()
    value = sum(c * Fraction(v) for c, v in zip(cost, found.point.tolist(), strict=True))
    assert value - Fraction(1, 10**12) <= Fraction(found.value) <= value + Fraction(1, 10**12)


x, y, z = sympy.symbols("x y z")
BOX = {x: (0, 2), y: (0, 2), z: (0, 2)}


@pytest.mark.parametrize(
    ("inequalities", "equalities", "point"),
    [
        ([], [x + y - 1, x + y - 1 - sympy.Rational(1, 2**40)], (0.5, 0.5, 0.0)),  # no point at all
        ([x + y - 2, -(x + y) + 2 - sympy.Rational(1, 2**40)], [], (1.0, 1.0, 0.0)),
        ([x - y - 1], [x - y - sympy.Rational(1, 2)], (1.5, 1.0, 0.0)),
        ([], [x + y - 5], (2.0, 3.0, 0.0)),  # outside of the box
        ([], [x * y - 1, x + y - z], (2.0, 0.25, 2.25)),
    ],
)
def test_a_point_where_a_constraint_fails_is_no_witness(inequalities, equalities, point):
    problem, objective = from_sympy(x, inequalities, equalities, [x, y, z], BOX)
    assert exact_point(problem, objective, np.array(point)) is None


def test_what_is_nearly_active_is_made_active():
    """Two constraints leave one point, and a third holds there with equality: no interval around it is feasible."""
    constraints = [3 * x + y - 4, 4 - 3 * x - y, x * z - y * z, 2 * x - y - 1]
    problem, objective = from_sympy(x - y, constraints, [z**2 - z], [x, y, z], BOX)
    nearly = np.array([1.0 + 1e-10, 1.0 - 2e-10, 1.0])
    assert verify(problem, objective, nearly) is None
    found = exact_point(problem, objective, nearly)
    assert found is not None
    assert found.point == pytest.approx([1.0, 1.0, 1.0], abs=1e-15)
    assert abs(found.value) < 1e-15


@pytest.mark.parametrize("name", ["gms_Bex9_1_1", "gms_Bst_bpv1", "gms_gbd"])
def test_the_minimum_of_a_named_problem_is_reached_at_a_proven_point(name):
    case = load(name)
    found = minimise(case.problem, case.objective)
    assert found.lower <= case.optimum <= found.upper + 1e-9
    assert found.gap < 1e-5
