"""Presolve: no feasible point is cut off, every bound is a step that the checker accepts, and oracles agree."""

import json
from fractions import Fraction
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from relaxations import check
from relaxations.errors import ProblemError
from relaxations.formats.expressions import minimise as minimise_typed
from relaxations.formats.expressions import problem_of, stated_problem, variables
from relaxations.proof.certificate_file import write_certificate
from relaxations.search.minimum import MinimumReason, minimise
from relaxations.search.presolve import presolve

x, y, z = variables("x y z")
FREE = (None, None)
seeds = given(st.integers(0, 10**6))


def presolved(constraints, box, file=None):
    """Return the problem after presolve; its steps must be accepted, and prove no more than the box says."""
    problem, _ = stated_problem(x, constraints, box)
    steps = []
    smaller = presolve(problem, steps.append)
    if file is not None and steps:
        write_certificate(file, problem, steps)  # refuses what the checker does
        if smaller is not None:
            proven = check.read(file)
            ends = {}
            for theorem in check.check(proven):
                k, slope = theorem.single
                ends.setdefault((k, slope > 0), []).append(theorem.bound / slope)
            for (k, below), values in ends.items():
                if below:
                    assert max(values) >= Fraction(smaller.lower[k])
                else:
                    assert min(values) <= Fraction(smaller.upper[k])
    return smaller


def test_a_disc_off_centre_bounds_its_variables(tmp_path):
    found = presolved([(x - 1) ** 2 + (y + 0.5) ** 2 <= 2.25], {"x": FREE, "y": FREE}, tmp_path / "c.json")
    np.testing.assert_allclose(found.lower, [-0.5, -2.0], atol=1e-9)
    np.testing.assert_allclose(found.upper, [2.5, 1.0], atol=1e-9)
    assert (found.lower <= [-0.5, -2.0]).all()
    assert (found.upper >= [2.5, 1.0]).all()


def test_a_square_that_equals_its_root_is_zero_or_one(tmp_path):
    found = presolved([x**2 == x, y == 1], {"x": FREE, "y": FREE}, tmp_path / "c.json")
    assert -1e-9 < found.lower[0] <= 0
    assert 1 <= found.upper[0] < 1 + 1e-9
    assert found.lower[1] == found.upper[1] == 1


@seeds
@settings(max_examples=40, deadline=None)
def test_an_ellipsoid_bounds_as_its_matrix_says(tmp_path_factory, seed):
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(3, 3)) * 10.0 ** rng.uniform(-2, 2, 3)
    matrix, middle = root @ root.T + 0.01 * np.diag(np.diag(root @ root.T)), rng.normal(size=3) * 5
    own = [v - float(m) for v, m in zip((x, y, z), middle, strict=True)]
    form = sum(float(matrix[i, j]) * own[i] * own[j] for i in range(3) for j in range(3))
    constraints = [form <= float(rng.uniform(0.1, 10))]
    problem, _ = stated_problem(x, constraints, {"x": FREE, "y": FREE, "z": FREE})
    radius = float(problem.inequalities.evaluate(middle)[0])
    file = tmp_path_factory.mktemp("proof") / "c.json"
    if problem.inequalities.coefficients.rad.any():  # a coefficient that no float equals leaves no exact square
        return
    found = presolved(constraints, {"x": FREE, "y": FREE, "z": FREE}, file)
    reach = np.sqrt(radius * np.diag(np.linalg.inv(matrix)))
    np.testing.assert_allclose(found.lower, middle - reach, rtol=1e-5, atol=1e-5 * reach.max())
    np.testing.assert_allclose(found.upper, middle + reach, rtol=1e-5, atol=1e-5 * reach.max())


@seeds
@settings(max_examples=60, deadline=None)
def test_no_feasible_point_is_cut_off(tmp_path_factory, seed):
    """Rows are drawn through a point of fractions, which must stay inside exactly."""
    rng = np.random.default_rng(seed)
    own = (x, y, z)
    point = [Fraction(int(rng.integers(-9, 10)), int(rng.integers(1, 8))) for _ in own]
    at = dict(zip("xyz", point, strict=True))
    constraints = []
    for _ in range(rng.integers(1, 5)):
        form = sum((Fraction(int(c), 3) * v for c, v in zip(rng.integers(-3, 4, 3), own, strict=True)), 0 * x)
        kind = rng.integers(4)
        if kind == 1:
            form = form + Fraction(int(rng.integers(-3, 4)), 3) * own[rng.integers(3)] * own[rng.integers(3)]
        if kind == 2:
            form = form - sum(int(c) * v**2 for c, v in zip(rng.integers(0, 4, 3), own, strict=True))
        slack = 0 if kind == 3 or rng.random() < 0.3 else Fraction(int(rng.integers(0, 5)), 7)
        value = sum(c * np.prod([at[v] for v in m] or [Fraction(1)]) for m, c in form.terms.items())
        constraints.append(form == value if kind == 3 else form >= value - slack)
    wide = {
        name: (None if rng.random() < 0.3 else value - int(rng.integers(0, 9)),
               None if rng.random() < 0.3 else value + int(rng.integers(0, 9)))
        for name, value in at.items()
    }  # fmt: skip
    found = presolved(constraints, wide, tmp_path_factory.mktemp("proof") / "c.json")
    assert found is not None
    assert all(Fraction(low) <= v for low, v in zip(found.lower.tolist(), point, strict=True) if np.isfinite(low))
    assert all(v <= Fraction(up) for up, v in zip(found.upper.tolist(), point, strict=True) if np.isfinite(up))


@pytest.mark.parametrize(
    "constraints",
    [
        [x + y <= 1, x >= 2, y >= 0],
        [x**2 + y**2 <= 1, x >= 2],
        [x**2 + y**2 <= -1],
        [x + y == 1, x + y == 2],
        [3 * x == 1, 3 * x == Fraction(101, 100)],
    ],
)
def test_an_empty_box_is_proven_empty(tmp_path, constraints):
    problem, objective = stated_problem(x, constraints, {"x": FREE, "y": (Fraction(-5), Fraction(5))})
    found = minimise(problem, objective, certificate=tmp_path / "c.json")
    assert found.reason is MinimumReason.EMPTY
    assert any(theorem.empty for theorem in check.check(check.read(tmp_path / "c.json")))


@pytest.mark.parametrize(
    "constraints",
    [
        [x**2 + y**2 <= 0],
        [(x - Fraction(1, 4)) ** 2 + y**2 <= 0, x + y <= Fraction(1, 4)],
        [x + y == 0, x - y == 0],
    ],
)
def test_a_set_of_one_point_is_not_empty(constraints):
    problem, objective = stated_problem(x, constraints, {"x": (-1, 1), "y": (-1, 1)})
    found = presolve(problem)
    assert found is not None
    assert minimise(problem, objective).lower <= 0.25


@pytest.mark.parametrize(
    "constraints",
    [[y >= x**2], [x**2 - y**2 <= 1], [x * y == 1], [(x + y) ** 2 <= 1], [x**2 + y**2 >= 1], [x + y <= 1, x >= 0]],
)
def test_a_set_without_a_box_is_refused(constraints):
    problem, objective = stated_problem(x, constraints, {"x": FREE, "y": FREE})
    with pytest.raises(ProblemError, match="has no finite box"):
        minimise(problem, objective)


@pytest.mark.parametrize(("rows", "least"), [([x == 2, y == 3], 6), ([3 * x == 1, y**2 <= 1], -1 / 3)])
def test_fixed_variables_are_fixed(tmp_path, rows, least):
    problem, objective = stated_problem(x * y, [*rows, x * y <= 7], {"x": FREE, "y": FREE})
    found = minimise(problem, objective, certificate=tmp_path / "c.json")
    assert found.lower <= least == pytest.approx(found.lower, abs=1e-6)
    assert found.upper == pytest.approx(least, abs=1e-6)


def test_rows_bound_variables_that_have_one_end(tmp_path):
    found = presolved([3 * x + 2 * y <= 6], {"x": (0, None), "y": (0, None)}, tmp_path / "c.json")
    np.testing.assert_allclose(found.upper, [2.0, 3.0], atol=1e-12)


# ---------------------------------------------------------------- the checker


def written(tmp_path):
    """Return a file that derives the box of a disc."""
    problem, _ = stated_problem(x, [(x - 1) ** 2 + y**2 <= 1], {"x": FREE, "y": FREE})
    steps = []
    presolve(problem, steps.append)
    write_certificate(tmp_path / "c.json", problem, steps)
    return json.loads((tmp_path / "c.json").read_text())


def test_a_variable_without_a_box_must_cancel(tmp_path):
    document = written(tmp_path)
    document["steps"][0]["products"][1]["factor"][1][1] = "1/3"
    with pytest.raises(check.Refused, match="has no finite box"):
        check.check(document)


@pytest.mark.parametrize("kind", ["above", "below", "inside"])
def test_a_factor_of_a_box_needs_its_end(tmp_path, kind):
    document = written(tmp_path)
    document["steps"][0]["products"].append({"of": [[kind, 0]], "weight": "1", "basis": [[]], "factor": [["1"]]})
    with pytest.raises(check.Refused, match="has no finite box"):
        check.check(document)


def test_a_bound_beyond_what_follows_is_refused(tmp_path):
    document = written(tmp_path)
    document["steps"][0]["bound"] = float(float.fromhex(document["steps"][0]["bound"]) + 1e-6).hex()
    with pytest.raises(check.Refused, match="bound <="):
        check.check(document)


# ---------------------------------------------------------------- minima


@seeds
@settings(max_examples=25, deadline=None)
def test_the_minimum_of_a_concave_quadratic_is_at_a_vertex(tmp_path_factory, seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 6))
    own = variables(" ".join(f"v{k}" for k in range(n)))
    root, slope = rng.integers(-3, 4, (n, n)), rng.integers(-5, 6, n)
    matrix = -(root @ root.T)
    cost = sum(float(matrix[i, j]) * own[i] * own[j] for i in range(n) for j in range(n))
    cost = cost + sum(float(c) * v for c, v in zip(slope, own, strict=True))
    file = tmp_path_factory.mktemp("proof") / "c.json"
    found = minimise(*problem_of(cost, [end for v in own for end in (v >= 0, v <= 1)], own_names(n)), certificate=file)
    corners = np.array(list(product((0, 1), repeat=n)))
    least = (np.einsum("ki,ij,kj->k", corners, matrix, corners) + corners @ slope).min()
    size = max(1.0, abs(least))
    assert found.lower <= least
    assert found.upper >= least - 1e-9 * size
    assert found.reason is MinimumReason.TIGHT
    if file.exists():
        assert max(float(t.bound) for t in check.check(check.read(file)) if t.single is None) >= found.lower - 1e-12


def own_names(n):
    return [f"v{k}" for k in range(n)]


@seeds
@settings(max_examples=20, deadline=None)
def test_the_minimum_over_a_polygon_agrees_with_a_grid(seed):
    rng = np.random.default_rng(seed)
    a, matrix, slope = rng.integers(-3, 4, (3, 2)), rng.integers(-4, 5, (2, 2)), rng.integers(-4, 5, 2)
    level = rng.integers(0, 4, 3)
    rows = [float(b) - float(u) * x - float(v) * y >= 0 for (u, v), b in zip(a, level, strict=True) if u or v]
    cost = sum(float(matrix[i, j]) * v * w for i, v in enumerate((x, y)) for j, w in enumerate((x, y)))
    cost = cost + float(slope[0]) * x + float(slope[1]) * y
    found = minimise(*problem_of(cost + 0 * x, [*rows, x >= -1, x <= 1, y >= -1, y <= 1], ["x", "y"]))
    grid = np.stack(np.meshgrid(*[np.linspace(-1, 1, 81)] * 2), axis=-1).reshape(-1, 2)
    inside = grid[(grid @ a.T <= level + 1e-12).all(axis=1)]
    least = (np.einsum("ki,ij,kj->k", inside, matrix, inside) + inside @ slope).min()
    assert found.lower <= least + 1e-9
    assert found.upper >= found.lower
    assert found.upper <= least + 1e-6


def test_zeros_and_ones_agree_with_enumeration():
    rng = np.random.default_rng(3)
    own = variables("a b c d e")
    matrix = rng.integers(-5, 6, (5, 5))
    cost = sum(float(matrix[i, j]) * own[i] * own[j] for i in range(5) for j in range(5))
    problem, objective = stated_problem(cost, [v**2 == v for v in own], dict.fromkeys("abcde", FREE))
    found = minimise(problem, objective)
    corners = np.array(list(product((0, 1), repeat=5)))
    least = np.einsum("ki,ij,kj->k", corners, matrix, corners).min()
    assert found.lower <= least <= found.upper < least + 1e-9
    assert found.reason is MinimumReason.TIGHT


def test_the_file_of_a_typed_problem_states_no_box_that_it_derives(tmp_path):
    minimise_typed(x * y - x, [x**2 + y**2 <= 4, y >= -1], certificate=tmp_path / "c.json")
    document = json.loads((tmp_path / "c.json").read_text())
    assert document["box"] == [[None, None], ["-0x1p+0", None]]
    check.check(document)


def test_the_lift_serves_an_objective_with_products(tmp_path):
    box = [end for v in (x, y, z) for end in (v >= -1, v <= 2)]
    problem, objective = problem_of(x * y - x * z, [x + y + z <= 2, *box], ["x", "y", "z"])
    found = minimise(problem, objective, method="lift", certificate=tmp_path / "c.json")
    grid = np.stack(np.meshgrid(*[np.linspace(-1, 2, 31)] * 3), axis=-1).reshape(-1, 3)
    inside = grid[grid.sum(axis=1) <= 2 + 1e-12]
    least = (inside[:, 0] * (inside[:, 1] - inside[:, 2])).min()
    assert found.lower <= least + 1e-9
    assert found.lower == pytest.approx(least, abs=1e-2)
    check.check(check.read(tmp_path / "c.json"))
